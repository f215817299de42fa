"""What happens to the robot, seen in the states that it publishes."""

import re
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple, Protocol

from app.gateway.diary.snapshots import Snapshots
from app.gateway.diary.writer import Writer
from app.link.messages import State, Transition

ASKED = 16
"""Newest requests to stop that a step of the robot is compared with."""
SILENT_S = 1.0
"""A robot that is silent for less is not worth telling."""
STUTTERS_S = 60.0
"""So long after a silence was told only a longer one is: a machine that is overworked stutters for
minutes, and must not push everything else out of the timeline."""
LONG_S = 5.0
_SOURCE = re.compile(r" \(([^()]*)\)$")


class Seen(Protocol):
    """A robot, as :class:`app.gateway.robot_port.RobotPort` has it."""

    @property
    def state(self) -> State | None:
        """The newest state."""
        ...

    @property
    def online(self) -> bool:
        """Whether it speaks."""
        ...


class Asked(NamedTuple):
    """A stop, and where it came from."""

    reason: str
    """As the robot will repeat it."""
    who: str | None
    by: str
    """``button``, ``gesture`` or ``rest``; of a stop that was not asked for here ``program`` or
    ``robot``."""


class RobotDiary:
    """Compares each state with the one before. Used on the event loop.

    Control, faults and silence are told by how they differ; arming and stops by the steps of the
    safety supervisor (``State.transitions``), which no look is too late for. What the robot did
    before it was first seen is not told.

    Args:
        robot: Whose states.
        writer: Where to.
        snapshots: For pictures of stops and faults.
        clock: Seconds that only rise.
    """

    def __init__(
        self,
        robot: Seen,
        writer: Writer,
        snapshots: Snapshots,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._clock = clock
        self._robot = robot
        self._writer = writer
        self._snapshots = snapshots
        self._asked: deque[Asked] = deque(maxlen=ASKED)
        self._heard: float | None = None
        """When it spoke last; None before it ever did."""
        self._silence_told = float("-inf")
        self._controller: str | None = None
        self._fault: int | None = None
        """Token of the fault that lasts."""
        self._silence: int | None = None
        self._step: int | None = None
        """Number of the newest step that was told."""
        self._tick = 0

    def asked(self, who: str, reason: str, by: str) -> None:
        """A session, or a program over REST, asks for a stop."""
        self._asked.append(Asked(f"{reason} ({who})", who, by))

    def unconfirmed(self, who: str, by: str) -> None:
        """The robot has not said that it stopped."""
        self._snapshots.want(self._writer.record("unconfirmed", who=who, by=by))

    def look(self) -> None:
        """Tell what is new."""
        state, online = self._robot.state, self._robot.online
        self._say_silence(online)
        if state is None or not online:
            return
        self._say_steps(state)
        if state.controller != self._controller:
            self._writer.record("control", who=state.controller, before=self._controller)
            self._controller = state.controller
        if state.fault is not None and self._fault is None:
            self._fault = self._writer.record("fault", lasts=True, reason=state.fault)
            self._snapshots.want(self._fault)
        elif state.fault is None and self._fault is not None:
            self._writer.finish(self._fault)
            self._fault = None

    def _say_silence(self, online: bool) -> None:
        now = self._clock()
        if online:
            self._heard = now
            if self._silence is not None:
                self._writer.finish(self._silence)
                self._writer.record("robot_back")
                self._silence = None
            return
        if self._heard is None or self._silence is not None:
            return
        silent_s = now - self._heard
        stutters = now - self._silence_told < STUTTERS_S
        if silent_s >= (LONG_S if stutters else SILENT_S):
            self._silence = self._writer.record("robot_lost", lasts=True, ago_s=silent_s)
            self._silence_told = now

    def _say_steps(self, state: State) -> None:
        steps = state.transitions
        newest = steps[-1].number if steps else 0
        restarted = state.tick < self._tick
        self._tick = state.tick
        if self._step is None:
            self._step = newest
        if restarted:
            self._step = 0
        told = self._step
        self._step = newest
        for step in steps:
            if step.number > told:
                self._say_step(step, state)

    def _say_step(self, step: Transition, state: State) -> None:
        match step.before, step.after:
            case _, "stopped":
                self._say_stop(step)
            case "stopped", _:
                self._writer.record("reset")
            case "disarmed", _:
                self._writer.record("armed", who=state.controller)
            case _, "disarmed":
                self._writer.record("disarmed", reason=step.reason)
            case "armed", "holding":
                self._writer.record("hold", category="S2", doubt=state.doubt, reason=step.reason)

    def _say_stop(self, step: Transition) -> None:
        reason = step.reason or ""
        found = next((each for each in reversed(self._asked) if each.reason == reason), None)
        if found is None:
            source = _SOURCE.search(reason)
            found = Asked(reason, *_source(source[1] if source else ""))
        token = self._writer.record(
            "stop", category=step.stop, who=found.who, by=found.by, reason=reason
        )
        self._snapshots.want(token)


def _source(source: str) -> tuple[str | None, str]:
    """Who stopped the robot, and by what, when it was not asked for here."""
    if source == "sequence":
        return None, "program"
    if source.startswith("operator-"):
        return source, "gesture"
    return None, "robot"
