"""The gateway's end of the link: commands and questions out; states and pictures in."""

import logging
import threading
import time
from collections import Counter
from collections.abc import Callable
from typing import Self

import zenoh

from app.errors import FrameRefused, LinkFailed, RobotUnavailable
from app.link.header import HEADER_SIZE, FrameHeader
from app.link.messages import (
    Command,
    Description,
    DryRunReport,
    DryRunRequest,
    LeaseReply,
    LeaseRequest,
    Message,
    State,
    StopRequest,
    key,
)
from app.link.reading import M, decode
from app.link.session import open_session

log = logging.getLogger(__name__)

_RETRY_S = 0.05
"""Between two attempts to connect while the node is still starting."""
_JOIN_S = 1.0

OnPicture = Callable[[FrameHeader, bytes], None]


class _Newest:
    """Calls ``handle`` with the newest payload of a key, on a thread of its own.

    A handler that is slower than the sender loses messages and falls no further behind: one slot
    holds the message that waits, and a newer one replaces it.
    """

    def __init__(self, session: zenoh.Session, on: str, handle: Callable[[bytes], None]) -> None:
        self._handle = handle
        self._slot: zenoh.Sample | None = None
        self._filled = threading.Event()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name=f"link {on}", daemon=True)
        self._thread.start()
        # A subscriber's blocking receive cannot be undeclared from another thread: so a callback.
        self._subscriber = session.declare_subscriber(on, self._take)

    def _take(self, sample: zenoh.Sample) -> None:
        self._slot = sample
        self._filled.set()

    def _run(self) -> None:
        while True:
            self._filled.wait()
            self._filled.clear()
            if self._closed:
                return
            sample, self._slot = self._slot, None
            if sample is None:
                continue
            try:
                self._handle(sample.payload.to_bytes())
            except Exception:
                log.exception("a message on %s could not be handled", sample.key_expr)

    def close(self) -> None:
        """Stop listening; waits shortly for a call in progress."""
        self._closed = True
        self._filled.set()
        try:
            self._subscriber.undeclare()  # type: ignore[no-untyped-call]
        except zenoh.ZError as error:
            log.debug("undeclare: %s", error)
        if threading.current_thread() is not self._thread:
            self._thread.join(_JOIN_S)


class CameraWatch:
    """A camera being watched. The camera renders while at least one of these is open."""

    def __init__(self, newest: _Newest) -> None:
        self._newest = newest

    def close(self) -> None:
        """Stop watching."""
        self._newest.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class GatewayEnd:
    """One robot node as the gateway sees it.

    Blocking where a method says so; everything else returns at once. Thread-safe. Once open, it
    reconnects by itself when the node goes and comes back.

    Args:
        robot: The robot's id, part of every key.
        endpoint: Zenoh endpoint of the node.
        on_state: Called with each State (the newest only, should it be slow), on the link's thread.
        on_alive: Called with True when the node's liveliness token appears and with False when it
            vanishes (a few ms after a crash; not when the node merely hangs: see ``state_age_s``).
        timeout: s to keep trying while the node does not listen yet. Blocks.

    Raises:
        LinkFailed: nobody listens on the endpoint within ``timeout``.
    """

    def __init__(
        self,
        robot: str,
        endpoint: str,
        on_state: Callable[[State], None] | None = None,
        on_alive: Callable[[bool], None] | None = None,
        timeout: float = 5.0,
    ) -> None:
        self.robot = robot
        self.invalid: Counter[str] = Counter()
        """Messages that could not be read, by kind."""
        self._alive = threading.Event()
        self._newest: tuple[State, float] | None = None
        self._on_state = on_state
        self._on_alive = on_alive
        self._session = _connect(endpoint, timeout)
        self._commands = self._session.declare_publisher(
            key(robot, "command"),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.INTERACTIVE_HIGH,
            express=True,
        )
        # A key and a priority of its own: a stop is in no queue behind commands or pictures.
        self._stops = self._session.declare_publisher(
            key(robot, "stop"),
            congestion_control=zenoh.CongestionControl.BLOCK,
            priority=zenoh.Priority.REAL_TIME,
            express=True,
        )
        self._states = _Newest(self._session, key(robot, "state"), self._take_state)
        self._liveliness = self._session.liveliness().declare_subscriber(
            key(robot, "alive"), self._take_liveliness, history=True
        )

    @property
    def state(self) -> State | None:
        """The newest State, or None before the first."""
        return None if self._newest is None else self._newest[0]

    @property
    def alive(self) -> bool:
        """Whether the node's liveliness token is there."""
        return self._alive.is_set()

    @property
    def state_age_s(self) -> float:
        """Time since the newest State arrived, s; infinite before the first.

        The node's heartbeat: states come 60 times a second from its control loop itself.
        """
        return float("inf") if self._newest is None else time.monotonic() - self._newest[1]

    def send(self, command: Command) -> None:
        """Send what the newest frame asks for; dropped rather than queued when the link is full.

        Raises:
            RobotUnavailable: the link is closed.
        """
        self._put(self._commands, command)

    def stop(self, request: StopRequest) -> None:
        """Ask the node to stop. Its State.stops rises when it has arrived.

        Raises:
            RobotUnavailable: the link is closed.
        """
        self._put(self._stops, request)

    def ask(self, request: LeaseRequest, timeout: float = 1.0) -> LeaseReply:
        """Ask for the lease, or to arm, disarm or reset. Blocks up to ``timeout`` s.

        Raises:
            RobotUnavailable: the node did not answer in time.
        """
        return self._ask("lease", LeaseReply, request.encode(), timeout)

    def describe(self, timeout: float = 1.0) -> Description:
        """What the robot is. Blocks up to ``timeout`` s.

        Raises:
            RobotUnavailable: the node did not answer in time.
        """
        return self._ask("description", Description, b"", timeout)

    def dry_run(self, request: DryRunRequest, timeout: float = 30.0) -> DryRunReport:
        """Ask what an action would do; nothing moves. Blocks up to ``timeout`` s.

        Raises:
            RobotUnavailable: nobody answered in time.
        """
        return self._ask("dry_run", DryRunReport, request.encode(), timeout)

    def watch_camera(self, name: str, on_picture: OnPicture) -> CameraWatch:
        """Call ``on_picture(header, jpeg)`` with each picture, the newest only, on its own thread.

        The camera renders only while it is watched: close what is returned.
        """

        def take(payload: bytes) -> None:
            try:
                header = FrameHeader.unpack(payload)
            except FrameRefused:
                self.invalid["picture"] += 1
                return
            on_picture(header, payload[HEADER_SIZE:])

        return CameraWatch(_Newest(self._session, key(self.robot, f"camera/{name}"), take))

    def close(self) -> None:
        """Leave the link; no callback runs afterwards."""
        self._on_alive = None
        self._states.close()
        self._session.close()  # type: ignore[no-untyped-call]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _put(self, publisher: zenoh.Publisher, message: Message) -> None:
        try:
            publisher.put(message.encode())
        except zenoh.ZError as error:
            raise RobotUnavailable(f"the link to {self.robot} is closed", robot=self.robot) from (
                error
            )

    def _ask(self, what: str, kind: type[M], payload: bytes, timeout: float) -> M:
        deadline = time.monotonic() + timeout
        # A question to a node that is just starting would be lost: its token says it listens.
        self._alive.wait(timeout)
        try:
            replies = self._session.get(
                key(self.robot, what),
                payload=payload,
                timeout=max(0.01, deadline - time.monotonic()),
                congestion_control=zenoh.CongestionControl.DROP,  # of the reply, too
                priority=zenoh.Priority.INTERACTIVE_HIGH,
                express=True,
            )
            for reply in replies:
                if reply.ok is not None:
                    message = decode(kind, reply.ok.payload.to_bytes())
                    if message is not None:
                        return message
                    self.invalid[kind.__name__.lower()] += 1
        except zenoh.ZError as error:
            log.debug("%s: %s", what, error)
        # Without anybody to ask, Zenoh says so at once; its time-out ends a little before ours.
        silent = time.monotonic() >= deadline - timeout / 2
        what = f"did not answer within {timeout:g} s" if silent else "cannot answer that yet"
        raise RobotUnavailable(f"the robot node {self.robot!r} {what}", robot=self.robot)

    def _take_state(self, payload: bytes) -> None:
        state = decode(State, payload)
        if state is None:
            self.invalid["state"] += 1
            return
        self._newest = (state, time.monotonic())
        if self._on_state is not None:
            self._on_state(state)

    def _take_liveliness(self, sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.PUT:
            self._alive.set()
        else:
            self._alive.clear()
        if (tell := self._on_alive) is not None:
            try:
                tell(self.alive)
            except Exception:
                log.exception("on_alive failed")


def _connect(endpoint: str, timeout: float) -> zenoh.Session:
    deadline = time.monotonic() + timeout
    while True:
        try:
            return open_session(endpoint, listen=False)
        except LinkFailed:
            if time.monotonic() >= deadline:
                raise
        time.sleep(_RETRY_S)
