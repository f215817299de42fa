"""The work on one frame, done in a thread: recognise, decide, command, describe."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.config import Settings
from app.gateway.detail import detail, glass
from app.gateway.drive import Decision, Driver, Situation
from app.gateway.eyes import FrozenCamera
from app.gateway.gallery import Enrolled
from app.gateway.numbers import Counter, tick_ms
from app.gateway.robot_port import RobotPort
from app.link.messages import StopRequest
from app.pipeline import Pipeline


@dataclass(frozen=True)
class FrameJob:
    """One frame and all that was known when it arrived."""

    seq: int
    jpeg: bytes
    arrived: float
    """``time.monotonic()``"""
    arrival: int
    """Number of the message within its session."""
    situation: Situation
    enrolled: Enrolled
    detail: bool
    glass: bool = False
    """With ``detail``: what the glass box shows, too."""


@dataclass(frozen=True)
class FrameDone:
    """What came of a frame."""

    messages: tuple[dict[str, Any], ...]
    decision: Decision
    timing_ms: dict[str, float]
    template: bytes | None = None
    """600 bytes: the hand with which a gesture starts."""


class FrameWorker:
    """One session's pipeline and driver. One frame at a time, on whichever thread.

    Args:
        session: Name of the session.
        settings: Of the whole server.
        enrolled: The gallery to begin with.
        robot: Gets the commands.
        holds: Numbers of showings; shared by all sessions.
        sequence: Numbers of commands; shared by all that commands for this session.
        stop: Stops the robot; called on the thread, as soon as it is known that a frame says stop.
    """

    def __init__(
        self,
        session: str,
        settings: Settings,
        enrolled: Enrolled,
        robot: RobotPort,
        holds: Counter,
        sequence: Counter,
        stop: Callable[[StopRequest], None],
    ) -> None:
        self._settings = settings
        self._robot = robot
        self._stop = stop
        self._pipeline = Pipeline(settings.pipeline, enrolled.matcher)
        self._enrolled = enrolled
        self._driver = Driver(session, holds, sequence)
        self._frozen = FrozenCamera(settings.gateway.frozen_ms)

    def run(self, job: FrameJob) -> FrameDone:
        """Process a frame and command the robot.

        Raises:
            FrameRefused: the frame is not what it should be; nothing moves because of it.
        """
        began = time.monotonic()
        if job.enrolled is not self._enrolled:
            another = job.enrolled.gallery != self._enrolled.gallery
            self._pipeline.matcher = job.enrolled.matcher
            self._enrolled = job.enrolled
            self._driver.gestures_changed(all_of_them=another)
        result = self._pipeline(job.jpeg, seq=job.seq, now=job.arrived)
        frozen = self._frozen(result.digest, job.arrived)
        decision = self._driver.decide(
            result.gesture, job.seq, job.situation, cause=result.cause, frozen=frozen
        )
        if decision.stop is not None:
            self._stop(decision.stop)  # before anything else is sent, drawn or encoded
        if decision.command is not None:
            self._robot.send(decision.command)
        ended = time.monotonic()
        timing = dict(result.timing_ms)
        timing["wait"] = (began - job.arrived) * 1000
        timing["total"] = (ended - job.arrived) * 1000
        frame = result.as_message(tick_ms())
        frame["timing_ms"] = {stage: round(value, 3) for stage, value in timing.items()}
        frame["gesture"] = result.gesture
        frame["reason"] = decision.reason or result.reason
        frame["doubt"] = decision.doubt
        # The command is on its way by now: looking on costs the robot no time.
        if job.detail:
            frame["detail"] = detail(result, job.enrolled)
        if job.detail and job.glass:
            frame["detail"]["glass"] = glass(result, job.enrolled, self._settings.pipeline)
        messages, template = [frame], None
        if result.event is not None:
            event = result.event
            messages.append(gesture_message(event.gesture, event.phase, event.seq))
            if event.phase == "start" and result.template is not None:
                template = np.packbits(result.template).tobytes()
        return FrameDone(tuple(messages), decision, timing, template)

    def end(self, now: float) -> dict[str, Any] | None:
        """Frames stopped coming: the ``gesture`` message that ends a held one, once it is due."""
        event = self._pipeline.tick(now)
        if event is None:
            return None
        if event.phase == "end":
            self._driver.end()
        return gesture_message(event.gesture, event.phase, event.seq)


def gesture_message(gesture: str, phase: str, seq: int) -> dict[str, Any]:
    """The ``gesture`` message."""
    return {"type": "gesture", "gesture": gesture, "phase": phase, "seq": seq}
