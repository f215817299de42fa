import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
import zenoh

from app.link.header import HEADER_SIZE, FrameHeader
from app.link.messages import State, key
from app.link.session import open_session, socket_endpoint
from app.robot import camera
from app.robot.beside import LINK_PATIENCE_S, NewestState
from app.robot.models import load_model

ROOT = Path(__file__).parents[2]
HOME = load_model("puma560").poses["home"]


def wait_for(condition: Callable[[], object], seconds: float = 120.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


class Node:
    """The node's end of the link: publishes states, as the control loop does."""

    def __init__(self, session: zenoh.Session) -> None:
        self._publisher = session.declare_publisher(key("puma", "state"))
        self.joints = HOME
        self.running = True
        self.tick = 1000
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._stop.wait(1 / 60):
            if self.running:
                self.tick += 16
                self._publisher.put(self.state().encode())

    def state(self) -> State:
        return State(
            robot="puma",
            tick=self.tick,
            mode="armed",
            armed=True,
            controller=None,
            epoch=0,
            joints=self.joints,
            velocities=(0.0,) * 6,
            commanded=self.joints,
            gripper=0.08,
            tool_position=(0.5, 0.0, 0.7),
            tool_orientation=(0.0, 0.0, 1.0, 0.0),
        )

    def garbage(self) -> None:
        self._publisher.put(b'{"robot": "puma", "tick": -1}')

    def close(self) -> None:
        self._stop.set()
        self._thread.join()


class Viewer:
    """Subscribes to one camera."""

    def __init__(self, session: zenoh.Session, name: str) -> None:
        self.pictures: list[tuple[FrameHeader, bytes]] = []
        self._subscriber = session.declare_subscriber(
            key("puma", f"camera/{name}"), lambda sample: self._take(sample.payload.to_bytes())
        )

    def _take(self, message: bytes) -> None:
        self.pictures.append((FrameHeader.unpack(message), message[HEADER_SIZE:]))

    def next(self, count: int = 1) -> list[tuple[FrameHeader, bytes]]:
        """The pictures that come from now on."""
        seen = len(self.pictures)
        wait_for(lambda: len(self.pictures) >= seen + count)
        return self.pictures[seen:]

    def close(self) -> None:
        self._subscriber.undeclare()


def decode(jpeg: bytes) -> np.ndarray:
    picture = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    return picture


@pytest.fixture
def endpoint() -> Iterator[str]:
    with tempfile.TemporaryDirectory(prefix="fh-") as folder:
        yield socket_endpoint(Path(folder) / "link")


@pytest.fixture
def session(endpoint: str) -> Iterator[zenoh.Session]:
    session = open_session(endpoint, listen=True)
    yield session
    session.close()


@pytest.fixture
def node(session: zenoh.Session) -> Iterator[Node]:
    node = Node(session)
    yield node
    node.close()


def command(endpoint: str) -> list[str]:
    words = "--robot puma --profile puma560 --renderer software --endpoint"
    return [sys.executable, "-m", "app.robot.camera", *words.split(), endpoint]


@pytest.fixture
def process(endpoint: str, session: zenoh.Session) -> Iterator[subprocess.Popen[bytes]]:
    process = subprocess.Popen(command(endpoint), cwd=ROOT)
    yield process
    process.kill()
    process.wait()


def test_pictures_come_only_while_somebody_watches(
    session: zenoh.Session, node: Node, process: subprocess.Popen[bytes]
) -> None:
    wrist = Viewer(session, "wrist")
    for header, jpeg in wrist.next(3):
        picture = decode(jpeg)
        assert picture.shape == (240, 320, 3)
        assert picture.std() > 20
        assert 1000 < header.tick <= node.tick
        assert header.captured_ms == header.tick
    wrist.close()
    # The last pictures may still be on their way; then there are no more.
    quiet = time.monotonic() + 0.5
    count = len(wrist.pictures)
    while time.monotonic() < quiet:
        if len(wrist.pictures) != count:
            count, quiet = len(wrist.pictures), time.monotonic() + 0.5
        time.sleep(0.02)
    sequence = wrist.pictures[-1][0].sequence
    again = Viewer(session, "wrist")
    # Had pictures been drawn all the while, their numbers would have gone on.
    assert again.next()[0][0].sequence <= sequence + 2


def test_pictures_follow_the_joints_and_are_numbered(
    session: zenoh.Session, node: Node, process: subprocess.Popen[bytes]
) -> None:
    viewers = [Viewer(session, name) for name in ("wrist", "scene")]
    before = [decode(viewer.next(2)[-1][1]) for viewer in viewers]
    node.joints = tuple(load_model("puma560").poses["tray"])
    tick = node.tick
    for viewer, old in zip(viewers, before, strict=True):
        wait_for(lambda viewer=viewer: viewer.pictures[-1][0].tick > tick + 50)
        new = decode(viewer.pictures[-1][1])
        assert (np.abs(new.astype(int) - old).max(axis=2) > 30).mean() > 0.02
        numbers = [header.sequence for header, _ in viewer.pictures]
        ticks = [header.tick for header, _ in viewer.pictures]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        assert ticks == sorted(set(ticks))


def test_keeps_to_its_rate_and_sends_no_state_twice(
    session: zenoh.Session, node: Node, process: subprocess.Popen[bytes]
) -> None:
    scene = Viewer(session, "scene")
    scene.next()
    begun = time.monotonic()
    count = len(scene.next(30))
    assert count / (time.monotonic() - begun) < camera.MAX_RATE_HZ * 1.15
    node.running = False
    wait_for(lambda: scene.pictures[-1][0].tick == node.tick)
    sent = len(scene.pictures)
    late = Viewer(session, "scene")
    # A new viewer of the same camera gets nothing old; the first one gets no repetition.
    time.sleep(0.5)
    assert len(scene.pictures) == sent
    assert late.pictures == []
    wrist = Viewer(session, "wrist")
    assert wrist.next()[0][0].tick == node.tick  # nobody has had this one yet
    node.running = True
    scene.next()


def test_survives_a_state_that_makes_no_sense(
    session: zenoh.Session, node: Node, process: subprocess.Popen[bytes]
) -> None:
    wrist = Viewer(session, "wrist")
    wrist.next()
    for _ in range(20):
        node.garbage()
        time.sleep(0.002)
    wrist.next(2)
    assert process.poll() is None


def test_runs_behind_everybody_else(
    session: zenoh.Session, node: Node, process: subprocess.Popen[bytes]
) -> None:
    Viewer(session, "wrist").next()
    assert os.getpriority(os.PRIO_PROCESS, process.pid) >= camera.NICENESS
    # Linux weighs sessions first: it must have a session of its own, as nice as it is.
    assert os.getsid(process.pid) == process.pid
    group = Path(f"/proc/{process.pid}/autogroup")
    if group.exists() and (told := group.read_text().split()):  # empty where it groups nothing
        assert told[-1] == str(camera.NICENESS)


def test_ends_when_asked(
    session: zenoh.Session, node: Node, process: subprocess.Popen[bytes]
) -> None:
    Viewer(session, "wrist").next()
    process.send_signal(signal.SIGINT)  # a Ctrl-C is the node's business
    Viewer(session, "scene").next()
    process.terminate()
    assert process.wait(10) == 0


@pytest.mark.parametrize("hangs", [False, True])
def test_ends_when_its_parent_is_gone(
    session: zenoh.Session, node: Node, endpoint: str, hangs: bool
) -> None:
    program = (
        "import subprocess, sys, time; child = subprocess.Popen(sys.argv[1:]);"
        "print(child.pid, flush=True); time.sleep(60)"
    )
    parent = subprocess.Popen(
        [sys.executable, "-c", program, *command(endpoint)], cwd=ROOT, stdout=subprocess.PIPE
    )
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    try:
        Viewer(session, "wrist").next()
        if hangs:
            os.kill(child, signal.SIGSTOP)
        parent.kill()
        wait_for(lambda: not running(child))
    finally:
        parent.kill()
        parent.wait()
        parent.stdout.close()
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)


def running(pid: int) -> bool:
    with contextlib.suppress(FileNotFoundError, ProcessLookupError):
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    return False


def test_ends_when_the_link_is_gone(endpoint: str) -> None:
    session = open_session(endpoint, listen=True)
    process = subprocess.Popen(command(endpoint), cwd=ROOT)
    try:
        wait_for(lambda: session.info.peers_zid() or list(session.info.transports()))
        session.close()
        assert process.wait(LINK_PATIENCE_S + 15) == 0
    finally:
        process.kill()
        process.wait()


def test_a_model_that_is_not_there_is_one_line(endpoint: str) -> None:
    words = [*command(endpoint), "--profile", "r2d2"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    assert "there is no robot model 'r2d2'; there are: " in done.stderr
    assert "Traceback" not in done.stderr


def test_a_link_that_is_not_there_is_one_line(endpoint: str) -> None:
    done = subprocess.run(command(endpoint), cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    assert "cannot be opened" in done.stderr
    assert "Traceback" not in done.stderr


def test_the_newest_state_replaces_the_older_one() -> None:
    newest = NewestState()
    assert newest.wait(0, 0.0) == (0, None)
    newest.put(b"one")
    newest.put(b"two")
    assert newest.wait(0, 1.0) == (2, b"two")
    assert newest.wait(2, 0.0) == (2, b"two")
