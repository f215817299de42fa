"""The dry-run process of a real node: its own process, asked over the link while the node works."""

import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from app.link.actions import Action, JogCartesian, MoveLinear, Pose, Repeat, Sequence, TurnJoint
from app.link.gateway_end import GatewayEnd
from app.link.messages import DryRunReport, DryRunRequest, key
from app.link.session import open_session, socket_endpoint
from tests.robot.test_node import ROOT, Remote, wait_for

HOME = Pose(name="home")
MINUTE = Sequence(
    steps=(
        Repeat(
            times=10,
            steps=(
                JogCartesian(linear=(0.0, 0.05, 0.0), duration=3.0),
                JogCartesian(linear=(0.0, -0.05, 0.0), duration=3.0),
            ),
        ),
    )
)


class Checked:
    """A node with its dry-run process."""

    def __init__(self, profile: str = "puma560", action: Action = HOME) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="fh-"))
        self.endpoint = socket_endpoint(self.folder / "n.sock")
        self.process = subprocess.Popen(
            [
                sys.executable, "-m", "app.robot.node", "--endpoint", self.endpoint,
                "--no-cameras", "--profile", profile,
            ],
            cwd=ROOT,
        )  # fmt: skip
        self.remote = Remote(self.endpoint)
        try:
            wait_for(lambda: self.ask(action) is not None, "the first answer", 120)
        except AssertionError:
            self.close()  # its threads would keep the tests from ending
            raise

    def ask(self, action: Action, start: str = "current") -> DryRunReport | None:
        """Once nothing else is being checked, and a child that was just started knows where the arm
        is. None: there is nobody to answer."""
        while (report := ask(self.remote.end, action, start)) is not None:
            if report.code not in ("busy", "robot_unavailable"):
                break
            time.sleep(0.05)
        return report

    def child(self) -> psutil.Process:
        (found,) = psutil.Process(self.process.pid).children()
        assert "app.robot.dry_run" in found.cmdline()
        return found

    def close(self) -> None:
        self.remote.end.close()
        self.process.kill()
        self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


def ask(end: GatewayEnd, action: Action, start: str = "current") -> DryRunReport | None:
    from app.errors import RobotUnavailable

    try:
        return end.dry_run(DryRunRequest(action=action, start=start), timeout=60)
    except RobotUnavailable:
        return None


@pytest.fixture(scope="module")
def checked() -> Iterator[Checked]:
    node = Checked()
    yield node
    node.close()


def test_it_begins_where_the_arm_is_and_nothing_moves(checked: Checked) -> None:
    remote = checked.remote
    remote.ready()
    turn = TurnJoint(joint=1, angle=0.3)
    there = remote.state.joints[0] + 0.3
    remote.show(turn, 1, lambda: abs(remote.state.joints[0] - there) < 1e-3, "the turn")
    before = remote.state.joints
    report = checked.ask(MoveLinear(offset=(0.0, 0.0, -0.1)))
    assert report is not None and report.code == "ok" and report.ok
    assert report.path.joints[0] == pytest.approx(before, abs=1e-3)
    start, end = report.path.tool[0], report.path.tool[-1]
    assert [b - a for a, b in zip(start, end, strict=True)] == pytest.approx([0, 0, -0.1], abs=1e-4)
    assert remote.state.joints == pytest.approx(before, abs=1e-3)
    home = checked.ask(MoveLinear(offset=(0.0, 0.0, -0.1)), "home")
    assert home is not None
    poses = remote.end.describe(5).poses
    assert home.path.joints[0] == pytest.approx(poses["home"], abs=1e-4)
    tray = checked.ask(Pose(name="tray"), "tray")
    assert tray is not None
    assert tray.path.joints[0] == pytest.approx(poses["tray"], abs=1e-4)
    assert tray.duration_s < 0.1


def test_it_says_what_would_break_a_limit(checked: Checked) -> None:
    report = checked.ask(
        Sequence(steps=(Pose(name="left"), MoveLinear(offset=(1.0, 0, 0)))), "home"
    )
    assert report is not None
    assert not report.ok
    assert [
        (problem.step, problem.kind) for problem in report.problems if problem.kind != "slowed"
    ] == [(2, "unreachable")]


def test_an_unknown_pose_to_begin_at_is_refused(checked: Checked) -> None:
    report = checked.ask(Pose(name="home"), "moon")
    assert report is not None
    assert (report.code, report.ok) == ("unknown_pose", False)
    assert report.reason.startswith("this robot has no pose 'moon' to begin at; it has: home,")


def test_it_is_busy_meanwhile_and_the_control_loop_is_not(checked: Checked) -> None:
    answers: list[DryRunReport | None] = []
    end = checked.remote.end
    asking = threading.Thread(target=lambda: answers.append(ask(end, MINUTE, "home")))
    ticks = len(checked.remote.states)
    asking.start()
    # Until the long one has begun, a short one may still be answered.
    busy: list[str] = []
    while asking.is_alive() and "busy" not in busy:
        short = ask(end, Pose(name="home"))
        busy.append("none" if short is None else short.code)
    asking.join()
    assert "busy" in busy or [each and each.code for each in answers] == ["busy"]
    assert len(checked.remote.states) > ticks
    long = answers[0]
    while long is None or long.code != "ok":
        # The short one was being checked, or still is.
        long = checked.ask(MINUTE, "home")
    assert long.ok
    assert long.duration_s == pytest.approx(62.7, abs=1.0)


def test_a_request_that_cannot_be_read_is_told_so(checked: Checked) -> None:
    session = open_session(checked.endpoint, listen=False)
    try:
        (reply,) = session.get(key("puma", "dry_run"), payload=b"{nonsense", timeout=20)
        assert reply.ok is not None
        report = DryRunReport.model_validate_json(reply.ok.payload.to_bytes())
        assert report.code == "invalid"
    finally:
        session.close()


def test_it_comes_back_when_killed_and_ends_with_the_node() -> None:
    node = Checked()
    try:
        child = node.child()
        child.kill()
        child.wait(10)
        wait_for(lambda: node.ask(Pose(name="home")) is not None, "a new one", 120)
        child = node.child()
        node.process.kill()
        node.process.wait()
        child.wait(20)
        assert not child.is_running()
    finally:
        node.close()


def test_a_base_is_asked_where_it_would_drive() -> None:
    ahead = MoveLinear(offset=(1.0, 0.0, 0.0))
    node = Checked("husky", ahead)
    try:
        report = node.ask(ahead)
        assert report is not None
        assert (report.code, report.ok) == ("ok", True)
        assert report.path.base[0] == pytest.approx((0.0, 0.0, 0.0), abs=0.01)
        assert report.path.base[-1] == pytest.approx((1.0, 0.0, 0.0), abs=0.01)
        assert node.remote.state.base == pytest.approx((0.0, 0.0, 0.0), abs=0.01)
        elsewhere = node.ask(ahead, "start")
        assert elsewhere is not None
        assert elsewhere.code == "unknown_pose"
        assert elsewhere.reason == "a robot that drives begins where it is: from is 'current'"
    finally:
        node.close()
