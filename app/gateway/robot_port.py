"""The gateway's side of one robot: its newest state, what is wrong with it, and asking it things.

Every call that waits for the node is blocking and belongs in a thread. Nothing here raises because
the node is away: it is offline then, and comes back.
"""

import contextlib
import logging
import threading
import time
from collections.abc import Callable
from typing import Protocol

from app.config import DEFAULT_PROFILE, Settings
from app.errors import CannotStart, FarhandError, LinkFailed, RobotUnavailable
from app.gateway.node_process import NodeProcess, node_command
from app.gateway.stop_memory import StopMemory
from app.link.gateway_end import GatewayEnd, OnPicture
from app.link.messages import (
    Command,
    Description,
    DryRunReport,
    DryRunRequest,
    LeaseReply,
    LeaseRequest,
    State,
    StopRequest,
)
from app.link.session import socket_endpoint
from app.process_lock import ProcessLock
from app.robot.latch_lock import lock_latch
from app.robot.models import model_assets
from app.scratch import ScratchFolder, remove_left_behind

log = logging.getLogger(__name__)

TEND_S = 0.2
DRY_RUN_S = 30.0
"""A check breaks off after 12 s by itself; on a slow machine its arm has to be made first."""
LOST = "the robot was stopped and has not been reset, but does not say so: it is stopped again"
RESEND_S = 0.1
"""A stop that is not confirmed is sent again this often."""


class Watch(Protocol):
    """Something that runs until closed."""

    def close(self) -> None:
        """End it."""
        ...


class RobotPort:
    """One robot as the gateway knows it. Safe to use from any thread.

    Args:
        settings: Of the whole server; a node is started when ``settings.robot.spawn`` is on.

    Raises:
        CannotStart: the node runs elsewhere but no endpoint is given, no private folder for the
            link's socket can be made, or another node has the stop latch.
        LinkFailed: the socket's path is too long.
    """

    def __init__(self, settings: Settings) -> None:
        self.id = settings.robot.id
        self._silence_s = settings.gateway.robot_silence_ms / 1000
        self._ask_timeout_s = settings.gateway.lease_timeout_ms / 1000
        self._changed = threading.Condition()
        self._state: State | None = None
        self._state_at: float | None = None
        self._lost = False
        self._description: Description | None = None
        self._description_old = True
        self._link: GatewayEnd | None = None
        self._link_error: str | None = None
        self._ending = threading.Event()
        self._folder: ScratchFolder | None = None
        self._process: NodeProcess | None = None
        self._latch_lock: ProcessLock | None = None
        self.stop_memory = StopMemory(settings.data_dir / f"stop-{self.id}.remembered")
        endpoint = settings.robot.endpoint
        profile = settings.robot.profile or DEFAULT_PROFILE
        if settings.robot.profile is not None:
            model_assets(profile)  # a wrong one is told now, in a line, and not by a node that dies
        if settings.robot.spawn:
            latch = settings.data_dir / f"stop-{self.id}.latch"
            # Ours, not the node's: one that was killed may have it until its disk answers.
            self._latch_lock = lock_latch(latch)
            try:
                remove_left_behind()
                # Of mode 0700, so that nobody else reaches the socket in it.
                self._folder = ScratchFolder()
            except OSError as error:
                raise CannotStart(f"no private folder for the link: {error}") from error
            endpoint = socket_endpoint(self._folder.path / "link")
            self._process = NodeProcess(
                node_command(self.id, endpoint, latch, profile),
                last_word=lambda: self._state_at,
                hung_s=settings.gateway.robot_hung_ms / 1000,
                start_s=settings.gateway.robot_start_s,
                more=self._still_stopped,
            )
        if endpoint is None:
            raise CannotStart(
                "the robot node is said to run elsewhere, but not where: "
                "give its endpoint with --robot-endpoint"
            )
        self.endpoint = endpoint
        self._tender = threading.Thread(target=self._tend, name="robot-link", daemon=True)

    def start(self) -> None:
        """Start the node, if it is ours, and connect as soon as it answers."""
        if self._process is not None:
            self._process.start()
        self._tender.start()

    def close(self) -> None:
        """Disconnect, and end the node if it is ours."""
        self._ending.set()
        if self._tender.is_alive():
            self._tender.join(timeout=2.0)
        link, self._link = self._link, None
        if link is not None:
            link.close()
        if self._process is not None:
            self._process.close()
        if self._folder is not None:
            self._folder.close()
        if self._latch_lock is not None:
            self._latch_lock.close()
        self.stop_memory.close()

    # What is known

    @property
    def state(self) -> State | None:
        """The newest state, however old."""
        return self._state

    @property
    def live_state(self) -> State | None:
        """The newest state, if it is fresh."""
        return self._state if self.online else None

    @property
    def age_s(self) -> float | None:
        """Seconds since the newest state came; None before the first."""
        return None if self._state_at is None else time.monotonic() - self._state_at

    @property
    def online(self) -> bool:
        """Whether the robot speaks."""
        age = self.age_s
        return age is not None and age <= self._silence_s and not self._lost

    @property
    def fault(self) -> str | None:
        """What is wrong, in plain words, or None."""
        if self.online:
            return self._state.fault if self._state is not None else None
        if self._process is not None and self._process.fault is not None:
            return self._process.fault
        if self._lost:
            return "the robot node is gone"
        age = self.age_s
        if age is not None:
            return f"no word from the robot for {age:.1f} s"
        return self._link_error or "the robot has not answered yet"

    @property
    def description(self) -> Description | None:
        """What the robot is, once it has been asked."""
        return self._description

    @property
    def restarts(self) -> int:
        """How often our node was started again."""
        return 0 if self._process is None else self._process.restarts

    @property
    def node_pid(self) -> int | None:
        """Process id of our node."""
        return None if self._process is None else self._process.pid

    def wait_newer(self, timeout_s: float, so: Callable[[State], bool] = lambda _: True) -> bool:
        """Wait for a state that comes after this call and is so; False when none does."""
        since = time.monotonic()
        with self._changed:
            return self._changed.wait_for(lambda: self.has_newer(since, so), timeout_s)

    def has_newer(self, since: float, so: Callable[[State], bool] = lambda _: True) -> bool:
        """Whether a state came after ``since`` (s, monotonic) and is so."""
        state, at = self._state, self._state_at
        return state is not None and (at or 0.0) > since and so(state)

    # Asking

    def send(self, command: Command) -> None:
        """Send a command; dropped when there is no link."""
        link = self._link
        if link is not None:
            with contextlib.suppress(RobotUnavailable):
                link.send(command)

    def send_stop(self, request: StopRequest) -> None:
        """Tell the robot to stop, and do not wait; :meth:`stop` makes sure that it did."""
        link = self._link
        if link is not None:
            with contextlib.suppress(RobotUnavailable):
                link.stop(request)

    def stop(self, request: StopRequest, timeout_s: float) -> None:
        """Stop the robot, and wait until it says that it has understood.

        Raises:
            RobotUnavailable: it was not confirmed within ``timeout_s``.
        """
        before = self._state
        sent_at = time.monotonic()
        told = False

        def confirmed() -> bool:
            state, at = self._state, self._state_at
            if state is None or at is None or at <= sent_at:
                return False
            counted = before is not None and state.stops > before.stops
            return counted or state.mode == "stopped"

        while True:
            self.send_stop(request)
            if not told:  # after it was sent, because a log may make us wait
                told = True
                self.stop_memory.asked(request)
                log.warning("stop: %s (%s)", request.reason, request.source)
            left = sent_at + timeout_s - time.monotonic()
            with self._changed:
                if self._changed.wait_for(confirmed, max(0.0, min(RESEND_S, left))):
                    return
            if left <= RESEND_S:
                raise RobotUnavailable(
                    "the stop was sent but not confirmed: "
                    f"{self.fault or 'the robot did not answer in time'}",
                    robot=self.id,
                )

    def ask(self, request: LeaseRequest) -> LeaseReply:
        """Ask the node's control loop and wait for its answer.

        A robot that was stopped, and does not say so any more although nobody has reset it, is not
        asked to arm.

        Raises:
            RobotUnavailable: no answer came in time.
        """
        link = self._link
        if link is None or not self.online:
            raise RobotUnavailable(
                f"the robot cannot be asked: {self.fault or 'it does not answer'}", robot=self.id
            )
        if request.kind == "arm" and self.stop_memory.owed is not None:
            return LeaseReply(granted=False, code="latched", reason=LOST)
        reply = link.ask(request, timeout=self._ask_timeout_s)
        if request.kind == "reset" and reply.granted:
            # The node first: whoever of us two fails between comes back stopped.
            self.stop_memory.was_reset()
        return reply

    def dry_run(self, request: DryRunRequest) -> DryRunReport:
        """Ask what an action would do, and wait for the answer; nothing moves.

        Raises:
            RobotUnavailable: no answer came in time.
        """
        link = self._link
        if link is None or not self.online:
            raise RobotUnavailable(
                f"nothing can be checked: {self.fault or 'the robot does not answer'}",
                robot=self.id,
            )
        return link.dry_run(request, timeout=DRY_RUN_S)

    def watch_camera(self, name: str, callback: OnPicture) -> Watch:
        """Have ``callback`` called, on a thread of the link, with each picture of a camera.

        Raises:
            RobotUnavailable: there is no link to the robot yet.
        """
        link = self._link
        if link is None:
            raise RobotUnavailable(
                f"no pictures: {self.fault or 'the robot is not connected'}", robot=self.id
            )
        return link.watch_camera(name, callback)

    # On other threads

    def _take_state(self, state: State) -> None:
        with self._changed:
            self._state = state
            self._state_at = time.monotonic()
            self._lost = False
            self._changed.notify_all()
        if (stop := self.stop_memory.saw(state)) is not None and (link := self._link) is not None:
            log.warning("the robot does not show its stop, which is sent again: %s", stop.reason)
            with contextlib.suppress(RobotUnavailable):
                link.stop(stop)

    def _still_stopped(self) -> list[str]:
        """What a node that starts is told of what it may not remember itself."""
        stop = self.stop_memory.remembered
        return [] if stop is None else [f"--stopped={stop.reason}"]

    def _take_alive(self, alive: bool) -> None:
        if not alive:
            # Comes within ms of a crash; a state that follows takes it back.
            self._lost = True
            self._description_old = True

    def _tend(self) -> None:
        """Open the link as soon as the node listens; ask what it is whenever it is new."""
        while not self._ending.is_set():
            try:
                if self._link is None:
                    self._link = GatewayEnd(
                        self.id,
                        self.endpoint,
                        on_state=self._take_state,
                        on_alive=self._take_alive,
                        timeout=TEND_S,
                    )
                    self._link_error = None
                elif self._description_old and self.online:
                    self._description = self._link.describe(timeout=self._ask_timeout_s)
                    self._description_old = False
                    with self._changed:
                        self._changed.notify_all()
            except LinkFailed as error:
                self._link_error = error.message
            except FarhandError as error:
                log.debug("the robot does not describe itself: %s", error.message)
            except Exception:
                log.exception("the link to the robot")
            self._ending.wait(TEND_S)
