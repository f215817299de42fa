"""A real server in a thread, and a stand-in for the robot node that can be told to misbehave."""

import asyncio
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import uvloop
from fastapi import FastAPI
from websockets.sync.client import ClientConnection, connect

from app.config import ConnectionSettings, GatewaySettings, RobotSettings, Settings
from app.gateway.app import create_app
from app.gateway.connection_table import ConnectionTable
from app.gateway.hub import Hub
from app.gateway.serve import Server, bind, make_server
from app.link.header import FrameHeader
from app.link.messages import (
    CameraDescription,
    Clearance,
    Command,
    Description,
    JointDescription,
    LatchState,
    LeaseReply,
    LeaseRequest,
    State,
    StopRequest,
    Transition,
    key,
)
from app.link.node_end import NodeEnd
from app.link.session import open_session

TOKEN = "test-token-0123456789-abcdefghij"
BEARER = {"Authorization": f"Bearer {TOKEN}"}
WAIT_S = 20.0


def wait_for(condition: Callable[[], Any], what: str = "", timeout_s: float = WAIT_S) -> Any:
    """Wait until ``condition()`` is true and return it."""
    deadline = time.monotonic() + timeout_s
    while True:
        result = condition()
        if result:
            return result
        if time.monotonic() > deadline:
            raise AssertionError(f"waited {timeout_s} s in vain: {what}")
        time.sleep(0.005)


MANY = ConnectionSettings(requests_per_s=10_000, all_requests_per_s=10_000, begins_per_s=10_000)
"""Tests ask more in a second, without being signed in, than people do."""


def settings_for(folder: Path, endpoint: str | None = None, **gateway: Any) -> Settings:
    """Settings of a server on a free port; with an endpoint, its node runs elsewhere."""
    robot = RobotSettings() if endpoint is None else RobotSettings(spawn=False, endpoint=endpoint)
    # On a machine full of other tests, what stands back behind everything would never be done.
    gateway = {"viser": False, "work_niceness": 0, **gateway}
    return Settings(
        port=0,
        data_dir=folder / "data",
        token=TOKEN,
        robot=robot,
        gateway=GatewaySettings(**gateway),
        connections=MANY,
    )


class Running:
    """A server that runs."""

    def __init__(self, port: int, app: FastAPI, server: Server) -> None:
        hub: Hub = app.state.hub
        self.app = app
        self.server = server
        self.port = port
        self.hub = hub
        self.host = f"127.0.0.1:{port}"
        self.url = f"http://{self.host}"
        self.http = httpx.Client(base_url=self.url, headers=BEARER, timeout=60, trust_env=False)

    @property
    def table(self) -> ConnectionTable:
        """Its connections."""
        assert self.server.table is not None
        return self.server.table

    def operator(self, **options: Any) -> "Operator":
        """A new operator session."""
        return Operator(self.socket("/ws/operator", **options))

    def socket(self, path: str, **options: Any) -> ClientConnection:
        # The server asks whether we are there; we wait for it however busy the machine is.
        options = {"additional_headers": BEARER, "max_size": None, "ping_interval": None, **options}
        return connect(f"ws://{self.host}{path}", proxy=None, open_timeout=60, **options)


class Operator:
    """A client that speaks the operator protocol."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.hello = self.receive()
        assert self.hello["type"] == "hello"
        self.tick = self.hello["tick"]
        self.seq = 0

    def receive(self, timeout_s: float = WAIT_S) -> dict[str, Any]:
        message: dict[str, Any] = json.loads(self.socket.recv(timeout=timeout_s))
        self.tick = max(getattr(self, "tick", 0), message.get("tick", 0))
        return message

    def next(self, kind: str, timeout_s: float = WAIT_S, **values: Any) -> dict[str, Any]:
        """The next message of a type, with these values."""
        deadline = time.monotonic() + timeout_s
        while True:
            message = self.receive(max(0.01, deadline - time.monotonic()))
            if message["type"] == kind and all(
                message.get(name) == value for name, value in values.items()
            ):
                return message

    def send(self, type: str, **values: Any) -> None:
        self.socket.send(json.dumps({"type": type, **values}))

    def frame(self, jpeg: bytes, seq: int | None = None, tick: int | None = None) -> int:
        self.seq = self.seq + 1 if seq is None else seq
        tick = self.tick if tick is None else tick
        header = FrameHeader(self.seq, time.monotonic() * 1000, tick).pack()
        self.socket.send(header + jpeg)
        return self.seq

    def show(self, jpeg: bytes) -> dict[str, Any]:
        """Send a frame and return what became of it."""
        return self.next("frame", seq=self.frame(jpeg))

    def close(self) -> None:
        self.socket.close()

    def __enter__(self) -> "Operator":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@contextmanager
def running(settings: Settings) -> Iterator[Running]:
    """Run a server in a thread, as ``farhand serve`` does in the main one."""
    listener = bind(settings)
    port = listener.getsockname()[1]
    app = create_app(settings)
    server = make_server(app, settings)
    opened = threading.Event()
    failed: list[BaseException] = []

    async def run() -> None:
        async with app.router.lifespan_context(app):
            opened.set()
            await server.serve(sockets=[listener])

    def work() -> None:
        try:
            with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
                runner.run(run())
        except BaseException as error:
            failed.append(error)
        finally:
            opened.set()

    thread = threading.Thread(target=work, name="server")
    thread.start()
    opened.wait(60)
    if failed:
        thread.join()
        listener.close()
        raise failed[0]
    wait_for(lambda: server.started, "the server to start")
    here = Running(port, app, server)
    try:
        yield here
    finally:
        here.http.close()
        server.should_exit = True
        thread.join(20)
        listener.close()
        assert not thread.is_alive(), "the server did not end"
        if failed:
            raise failed[0]


NEAR = Clearance(
    distance=0.05,
    link="link3",
    thing="table",
    itself=False,
    points=((0.5, 0.0, 0.3), (0.5, 0.0, 0.25)),
)


class StandIn:
    """Speaks for a robot node in this process: the same link, the same answers, no arm.

    What a test needs of a node that a real one would never do is a switch here.
    """

    def __init__(self, folder: Path, robot: str = "puma") -> None:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self.endpoint = f"unixsock-stream/{folder / 'link'}"
        self.robot = robot
        self.silent = False
        """Publish no state and answer nothing, as a process that hangs."""
        self.deaf_to_stops = False
        self.resets = 0
        self.latch = LatchState()
        self.commands: list[Command] = []
        self.stops: list[StopRequest] = []
        self.requests: list[LeaseRequest] = []
        self.mode = "disarmed"
        self.holder: str | None = None
        self.epoch = 0
        self.frame: int | None = None
        self.steps = (Transition(number=1, tick=5, before="disarmed", after="armed"),)
        self._end = NodeEnd(robot, self.endpoint)
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="stand-in")
        self._thread.start()

    def close(self) -> None:
        self._ending.set()
        self._thread.join()
        self._end.close()

    def __enter__(self) -> "StandIn":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self) -> None:
        while not self._ending.wait(1 / 60):
            if self.silent:
                continue
            for stop in self._end.stop_requests():
                if not self.deaf_to_stops:
                    self.stops.append(stop)
                    self.mode = "stopped"
            for request, answer in self._end.lease_requests():
                self.requests.append(request)
                answer(self._reply(request))
            self._end.answer_descriptions(self.describe())
            for command in self._end.commands():
                self.commands.append(command)
                self.frame = command.frame
            self._end.publish_state(self.state())

    def _reply(self, request: LeaseRequest) -> LeaseReply:
        mine = request.holder == self.holder and request.epoch == self.epoch
        match request.kind:
            case "take":
                if self.holder not in (None, request.holder) and not request.takeover:
                    reason = f"{self.holder} has control"
                    return LeaseReply(granted=False, code="no_control", reason=reason)
                self.holder = request.holder
                self.epoch += 1
                return LeaseReply(granted=True, epoch=self.epoch)
            case "reset":
                self.resets += self.mode == "stopped"
                self.mode = "disarmed"
                return LeaseReply(granted=True)
            case "reset_scene":
                if self.mode not in ("disarmed", "stopped"):
                    return LeaseReply(granted=False, code="armed", reason="disarm it first")
                return LeaseReply(granted=True)
        if not mine:
            return LeaseReply(granted=False, code="no_control", reason="you do not have control")
        match request.kind:
            case "release":
                self.holder = None
                self.mode = "disarmed"
            case "arm":
                if self.mode == "stopped":
                    return LeaseReply(granted=False, code="stopped", reason="reset it first")
                self.mode = "armed"
            case "disarm":
                self.mode = "disarmed"
        return LeaseReply(granted=True, epoch=self.epoch)

    def state(self) -> State:
        return State(
            robot=self.robot,
            tick=time.monotonic_ns() // 1_000_000,
            mode=self.mode,
            armed=self.mode in ("armed", "moving", "holding"),
            controller=self.holder,
            epoch=self.epoch,
            stops=len(self.stops),
            resets=self.resets,
            latch=self.latch,
            joints=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6),
            velocities=(0.0,) * 6,
            commanded=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6),
            gripper=0.04,
            tool_position=(0.5, 0.0, 0.3),
            tool_orientation=(1.0, 0.0, 0.0, 0.0),
            frame=self.frame,
            clearance=NEAR,
            transitions=self.steps,
            dropped={"epoch": 3},
        )

    def describe(self) -> Description:
        joint = {"lower": -3.0, "upper": 3.0, "velocity": 1.0, "acceleration": 5.0, "jerk": 50.0}
        return Description(
            id=self.robot,
            name="Stand-in",
            model="puma560",
            joints=tuple(JointDescription(name=f"joint{n}", **joint) for n in range(1, 7)),
            poses={"home": (0.0,) * 6},
            gripper_max=0.08,
            cameras=tuple(
                CameraDescription(name=name, width=320, height=240, fov_degrees=60.0)
                for name in ("wrist", "scene")
            ),
        )


class StandInCamera:
    """Publishes numbered pictures while somebody watches, as the camera process does."""

    def __init__(
        self, node: StandIn, name: str, size: int = 20_000, jpeg: bytes | None = None
    ) -> None:
        self.published = 0
        self.watched = False
        self._session = open_session(node.endpoint, listen=False)
        self._publisher = self._session.declare_publisher(key(node.robot, f"camera/{name}"))
        self._jpeg = jpeg or b"\xff\xd8" + bytes(size) + b"\xff\xd9"
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="stand-in-camera")
        self._thread.start()

    def _run(self) -> None:
        while not self._ending.wait(1 / 50):
            self.watched = self._publisher.matching_status.matching
            if self.watched:
                self.published += 1
                header = FrameHeader(self.published, time.monotonic() * 1000, 1).pack()
                self._publisher.put(header + self._jpeg)

    def __enter__(self) -> "StandInCamera":
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join()
        self._session.close()


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        port: int = listener.getsockname()[1]
        return port
