"""A real node: its own process, PyBullet, a unix socket, and somebody at the other end."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from app.config import NodeSettings
from app.link.actions import Action, Home, JogCartesian, JogJoint, Pose, TurnJoint
from app.link.gateway_end import GatewayEnd
from app.link.messages import Command, LeaseReply, LeaseRequest, State, StopRequest, key
from app.link.node_end import NodeEnd
from app.link.session import open_session, socket_endpoint
from app.robot.latch import StopLatch
from app.robot.node import Node
from tests.robot.fakes import FakeArm
from tests.robot.models.profiles import TOML, write_profile

ROOT = Path(__file__).parents[2]
JOG = JogJoint(joint=1, velocity=1.0)
MOVING = 0.02
"""rad/s"""


def wait_for(condition: Callable[[], object], what: str, timeout: float = 15.0) -> None:
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(f"did not happen within {timeout} s: {what}")
        time.sleep(0.005)


class Remote:
    """Drives a node over the link, and keeps every state with the node's own time."""

    made: ClassVar[list["Remote"]] = []

    def __init__(self, endpoint: str, holder: str = "anna") -> None:
        self.holder = holder
        self.states: list[State] = []
        self.epoch = 0
        self.sequence = 0
        self.last_tick = 0
        self.end = GatewayEnd("puma", endpoint, on_state=self.states.append, timeout=30)
        self.made.append(self)
        wait_for(lambda: self.states, "the first state", 30)

    @property
    def state(self) -> State:
        return self.states[-1]

    def ask(self, kind: str, **more: object) -> LeaseReply:
        request = LeaseRequest(kind=kind, holder=self.holder, epoch=self.epoch, **more)
        reply = self.end.ask(request, timeout=5)
        if kind == "take" and reply.granted:
            assert reply.epoch is not None
            self.epoch = reply.epoch
        return reply

    def command(self, action: Action | None, hold: int) -> Command:
        self.sequence += 1
        return Command(
            epoch=self.epoch,
            sequence=self.sequence,
            tick=self.state.tick,
            frame=self.sequence,
            hold=hold,
            gesture=None if action is None else action.type,
            action=action,
        )

    def show(
        self,
        action: Action | None,
        hold: int,
        until: Callable[[], object],
        what: str,
        timeout: float = 15.0,
    ) -> None:
        """Thirty commands a second until a condition holds."""
        deadline = time.monotonic() + timeout
        while not until():
            if time.monotonic() > deadline:
                raise AssertionError(f"did not happen: {what}; {self.state}")
            self.last_tick = self.state.tick
            self.end.send(self.command(action, hold))
            time.sleep(1 / 30)

    def ready(self) -> None:
        assert self.ask("take").granted
        assert self.ask("arm").granted
        self.show(None, 0, lambda: self.state.mode == "armed", "armed")

    def speed(self) -> float:
        return max(map(abs, self.state.velocities))

    def moved_after(self, tick: int) -> float:
        """For how long after ``tick`` (of the node) the arm moved, ms."""
        moving = [s.tick for s in self.states if max(map(abs, s.velocities)) > MOVING]
        return max([t for t in moving if t > tick], default=tick) - tick


class NodeProcess:
    def __init__(self, *more: str, latch: Path | None = None) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="fh-"))
        self.endpoint = socket_endpoint(self.folder / "n.sock")
        self.latch = latch or self.folder / "latch"
        self.more = [*more, "--latch", str(self.latch), "--no-cameras", "--no-dry-runs"]
        self.start()

    def start(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "app.robot.node", "--endpoint", self.endpoint, *self.more],
            cwd=ROOT,
        )

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


@pytest.fixture(autouse=True)
def no_link_is_left() -> Iterator[None]:
    """One that a failed test left open has threads that would keep the run from ending."""
    yield
    for remote in Remote.made:
        remote.end.close()
    Remote.made.clear()


@pytest.fixture
def node() -> Iterator[NodeProcess]:
    process = NodeProcess()
    yield process
    process.close()


@pytest.fixture
def remote(node: NodeProcess) -> Iterator[Remote]:
    remote = Remote(node.endpoint)
    yield remote
    remote.end.close()


def test_the_whole_way(node: NodeProcess, remote: Remote) -> None:
    """One start of a node for what can be seen in one go: each start takes seconds."""
    description = remote.end.describe(5)
    assert (description.id, len(description.joints)) == ("puma", 6)
    remote.ready()
    start = remote.state.joints

    # a jog moves while it is held and ends smoothly
    remote.show(JOG, 1, lambda: remote.state.joints[0] > start[0] + 0.2, "joint 1 moves")
    assert remote.state.mode == "moving"
    assert remote.state.action == JOG
    remote.show(None, 1, lambda: remote.state.mode == "armed", "rest")
    assert remote.state.stop is None

    # a turn ends at its angle, as measured, and once
    before = remote.state.joints[0]
    remote.show(TurnJoint(joint=1, angle=-0.2), 2, lambda: remote.state.mode == "moving", "turn")
    remote.show(TurnJoint(joint=1, angle=-0.2), 2, lambda: remote.state.mode == "armed", "end")
    wait_for(lambda: remote.speed() < 1e-3, "standstill")
    assert remote.state.joints[0] == pytest.approx(before - 0.2, abs=1e-3)

    # nonsense moves nothing
    remote.show(None, 2, lambda: remote.state.reason is None, "no reason")
    remote.show(Pose(name="moon"), 3, lambda: remote.state.reason, "a reason")
    assert remote.state.reason is not None
    assert remote.state.reason.startswith("this robot has no pose 'moon'")
    with open_session(node.endpoint, listen=False) as session:
        session.put(key("puma", "command"), b'{"epoch": NaN}')
        wait_for(lambda: remote.state.dropped.get("invalid_command") == 1, "counted")
    stale = [remote.command(Home(), 4) for _ in range(5)]
    time.sleep(0.3)
    for command in stale:
        remote.end.send(command)
    # The newest wins: of five that arrive at once, the older ones may not even be read.
    wait_for(lambda: remote.state.dropped.get("expired", 0) >= 1, "stale burst dropped")
    assert remote.state.mode == "armed"

    # commands stop: standstill, as the node itself saw it
    remote.show(JogJoint(joint=1, velocity=4.3), 5, lambda: remote.speed() > 1.2, "full speed")
    wait_for(lambda: remote.state.mode == "holding", "S2")
    time.sleep(0.4)
    assert 0 < remote.moved_after(remote.last_tick) <= 500
    assert remote.state.reason == "no command in time: the picture or the link failed"

    # somebody else takes over
    other = Remote(node.endpoint, "ben")
    assert not other.ask("take").granted
    assert other.ask("take", takeover=True).granted
    assert other.state.armed is False or other.ask("arm").granted
    wait_for(lambda: remote.state.controller == "ben", "ben drives")
    assert remote.ask("arm").code == "no_control"
    assert other.ask("release").granted
    other.end.close()
    assert [s for s in remote.states if max(map(abs, s.velocities)) > 1.4312] == []


def test_a_stop_comes_through_a_flood_latches_and_survives_a_crash(
    node: NodeProcess, remote: Remote
) -> None:
    remote.ready()
    remote.show(JOG, 1, lambda: remote.speed() > 0.9, "joint 1 moves")
    flooding = threading.Event()

    def flood() -> None:
        while not flooding.is_set():
            remote.end.send(remote.command(JOG, 1))

    thread = threading.Thread(target=flood)
    thread.start()
    try:
        tick = remote.state.tick
        remote.end.stop(StopRequest(source="test", reason="enough"))
        wait_for(lambda: remote.state.stops == 1, "the stop arrived")
        wait_for(lambda: remote.speed() < 1e-3, "standstill")
    finally:
        flooding.set()
        thread.join()
    assert remote.moved_after(tick) < 500
    assert remote.state.mode == "stopped"
    remote.end.close()

    node.process.kill()
    node.process.wait()
    node.start()
    again = Remote(node.endpoint, "ben")
    assert (again.state.mode, again.state.stop) == ("stopped", "S1")
    assert again.state.epoch >= remote.epoch
    again.ask("take")
    assert again.ask("arm").code == "latched"
    assert again.ask("reset").granted
    wait_for(lambda: again.state.latch.status == "none", "the reset on the disk")
    assert again.ask("arm").granted
    again.end.close()


DRIVER = """
import sys, time
sys.path.insert(0, sys.argv[1])
from tests.robot.test_node import JogJoint, Remote
remote = Remote(sys.argv[2], "driver")
remote.ready()
jog = JogJoint(joint=1, velocity=-4.3)
remote.show(jog, 1, lambda: remote.speed() > 1.2, "full speed")
print("moving", flush=True)
remote.show(jog, 1, lambda: False, "killed")
"""


def test_the_arm_stops_when_its_driver_is_killed(node: NodeProcess, remote: Remote) -> None:
    driver = subprocess.Popen(
        [sys.executable, "-c", DRIVER, str(ROOT), node.endpoint], stdout=subprocess.PIPE, text=True
    )
    assert driver.stdout is not None
    assert driver.stdout.readline() == "moving\n"
    driver.kill()
    driver.wait()
    killed = remote.state.tick
    driver.stdout.close()
    wait_for(lambda: remote.state.mode != "moving", "S2")
    time.sleep(0.4)
    assert remote.moved_after(killed) <= 500
    wait_for(lambda: remote.state.controller is None, "the lease is free")
    assert remote.state.armed is False


def test_asked_to_end_it_stops_the_arm_first(node: NodeProcess, remote: Remote) -> None:
    remote.ready()
    remote.show(JOG, 1, lambda: remote.speed() > 0.9, "joint 1 moves")
    node.process.send_signal(signal.SIGTERM)
    assert node.process.wait(10) == 0
    assert remote.speed() < MOVING
    assert remote.state.mode == "disarmed"
    assert remote.state.reason == "the robot node ends: asked to end"


def test_it_ends_with_its_parent() -> None:
    folder = Path(tempfile.mkdtemp(prefix="fh-"))
    endpoint = socket_endpoint(folder / "n.sock")
    code = (
        "import os, subprocess, sys, time\n"
        "child = subprocess.Popen([sys.executable, '-m', 'app.robot.node', '--no-cameras',"
        " '--parent', str(os.getpid()), '--endpoint', sys.argv[1]])\n"
        "print(child.pid, flush=True)\n"
        "time.sleep(60)\n"
    )
    parent = subprocess.Popen(
        [sys.executable, "-c", code, endpoint], cwd=ROOT, stdout=subprocess.PIPE, text=True
    )
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    try:
        remote = Remote(endpoint)
        parent.kill()
        parent.wait()
        parent.stdout.close()
        wait_for(lambda: not remote.end.alive, "the node is gone")
        remote.end.close()
        child = 0
    finally:
        if child:
            os.kill(child, signal.SIGKILL)
        shutil.rmtree(folder, ignore_errors=True)


def test_a_loop_that_failed_brakes_whatever_the_error_says(tmp_path: Path) -> None:
    tmp_path.chmod(0o700)
    endpoint = f"unixsock-stream/{tmp_path}/n.sock"
    settings = NodeSettings(endpoint=endpoint, latch=tmp_path / "latch")
    arm = FakeArm()
    node = Node(settings, arm, NodeEnd("puma", endpoint))
    try:
        arm.braked = node.controller.braked = False
        node.stop_at_once("the control loop failed: " + "no profile " * 100)
        assert arm.braked
    finally:
        node.close()
    latched = StopLatch(settings.latch).load()
    assert latched is not None
    assert latched.category == "S0"
    assert latched.reason.startswith("the control loop failed: no profile")


def test_it_ends_when_its_parent_was_gone_before_it_ran(tmp_path: Path) -> None:
    tmp_path.chmod(0o700)
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    arguments = ["--endpoint", f"unixsock-stream/{tmp_path}/n.sock", "--parent", str(gone.pid)]
    done = subprocess.run(
        [sys.executable, "-m", "app.robot.node", "--no-cameras", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0
    assert "ending: the process that started it is gone" in done.stderr


def test_a_stop_latch_has_one_node(node: NodeProcess, remote: Remote) -> None:
    """Two would delete one another's stops; the second is refused, also while the first hangs."""
    remote.end.stop(StopRequest(source="anna", reason="somebody is in the cell"))
    wait_for(lambda: remote.state.mode == "stopped", "the stop")
    node.process.send_signal(signal.SIGSTOP)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "app.robot.node", "--endpoint", node.endpoint + "2", *node.more],
            cwd=ROOT,
            capture_output=True,
            text=True,
            timeout=60,
        )
    finally:
        node.process.send_signal(signal.SIGCONT)
    assert done.returncode == 1
    said = done.stderr.strip().splitlines()[-1]
    latch = node.folder / "latch"
    assert said.startswith(f"the stop latch {latch} is in use by process {node.process.pid} since ")
    assert said.endswith("; end that robot node first, or give this one a latch of its own")
    assert latch.is_file()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--profile", "r2d2"], "there is no robot model 'r2d2'"),
        (["--id", "Puma!"], "id: String should match pattern"),
        (["--latch", "/proc/nowhere/latch"], "the stop latch /proc/nowhere/latch cannot be"),
    ],
)
def test_what_is_wrong_at_the_start_is_one_line(
    arguments: list[str], message: str, tmp_path: Path
) -> None:
    tmp_path.chmod(0o700)
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "app.robot.node",
            "--no-cameras",
            *["--endpoint", f"unixsock-stream/{tmp_path}/n.sock"],
            *arguments,
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert message in done.stderr.strip().splitlines()[-1]


@pytest.mark.parametrize(
    ("profile", "jog"),
    [
        ("kuka_iiwa", JogCartesian(linear=(0.0, 0.0, 0.1))),
        ("franka_panda", JogCartesian(linear=(0.0, 0.1, 0.0))),
        ("husky", JogCartesian(frame="tool", linear=(0.4, 0.0, 0.0), angular=(0.0, 0.0, 0.4))),
    ],
)
def test_every_profile_jogs_and_stops_in_a_process_of_its_own(
    profile: str, jog: JogCartesian
) -> None:
    node = NodeProcess("--profile", profile)
    try:
        remote = Remote(node.endpoint)
        description = remote.end.describe(5)
        assert description.model == profile
        assert len(description.joints) == len(remote.state.joints)
        remote.ready()
        before = np.array(remote.state.joints)
        moved = 0.05 if description.drives else 0.02

        def has_moved() -> bool:
            state = remote.state
            way = np.abs(np.array(state.joints) - before).max()
            return state.mode == "moving" and bool(way > moved)

        remote.show(jog, 1, has_moved, "it moves")
        tick = remote.state.tick
        remote.end.stop(StopRequest(source="test", reason="enough"))
        wait_for(lambda: remote.state.mode == "stopped", "S1")
        wait_for(lambda: remote.speed() < 1e-2, "standstill")
        assert remote.moved_after(tick) < 500
        assert (remote.state.base is not None) == description.drives
        remote.end.close()
    finally:
        node.close()


def test_a_profile_of_ones_own_and_a_wrong_one(tmp_path: Path) -> None:
    path = write_profile(tmp_path / "mine")
    node = NodeProcess("--profile", str(path))
    try:
        remote = Remote(node.endpoint)
        assert remote.end.describe(5).name == "Mine"
        remote.ready()
        remote.show(JogJoint(joint=2, velocity=0.2), 1, lambda: remote.state.joints[1] > 0.15, "go")
        remote.end.close()
    finally:
        node.close()
    path.write_text(TOML.replace("upper = 1.9", "upper = 2.5"))
    done = subprocess.run(
        [sys.executable, "-m", "app", "robot", "--endpoint", "x", "--profile", str(path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 1
    told = f"farhand: {path}:10: turn: upper 2.5 is beyond the URDF's 2.0\n"
    assert done.stderr.endswith(told), done.stderr
