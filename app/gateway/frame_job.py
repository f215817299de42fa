"""The work on one frame, done in a thread: recognise, decide, command, describe."""

import base64
import time
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from app.config import Settings
from app.gateway.drive import Decision, Driver, Situation
from app.gateway.eyes import FrozenCamera
from app.gateway.gallery import Enrolled
from app.gateway.numbers import Counter, tick_ms
from app.gateway.robot_port import RobotPort
from app.pipeline import FrameResult, Pipeline

DETAIL_WIDTH = 160
"""Pixels of the masks in a detail view."""


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


@dataclass(frozen=True)
class FrameDone:
    """What came of a frame."""

    messages: tuple[dict[str, Any], ...]
    decision: Decision
    timing_ms: dict[str, float]


class FrameWorker:
    """One session's pipeline and driver. One frame at a time, on whichever thread."""

    def __init__(
        self,
        session: str,
        settings: Settings,
        enrolled: Enrolled,
        robot: RobotPort,
        holds: Counter,
    ) -> None:
        self._settings = settings
        self._robot = robot
        self._pipeline = Pipeline(settings.pipeline, enrolled.matcher)
        self._enrolled = enrolled
        self._driver = Driver(session, holds)
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
        if job.detail:
            frame["detail"] = self._detail(result, job.enrolled)
        messages = [frame]
        if result.event is not None:
            event = result.event
            messages.append(gesture_message(event.gesture, event.phase, event.seq))
        return FrameDone(tuple(messages), decision, timing)

    def end(self, now: float) -> dict[str, Any] | None:
        """Frames stopped coming: the ``gesture`` message that ends a held one, once it is due."""
        event = self._pipeline.tick(now)
        if event is None:
            return None
        if event.phase == "end":
            self._driver.end()
        return gesture_message(event.gesture, event.phase, event.seq)

    def _detail(self, result: FrameResult, enrolled: Enrolled) -> dict[str, Any]:
        height, width = result.mask.shape
        small = (DETAIL_WIDTH, max(1, round(DETAIL_WIDTH * height / width)))
        mask = cv2.resize(result.mask, small, interpolation=cv2.INTER_AREA)
        template = result.template
        return {
            "mask": bit_png(mask),
            "template": None if template is None else bit_png(template),
            "distances": {name: round(value, 4) for name, value in result.distances.items()},
            "threshold": enrolled.matcher.max_distance,
            "wrist": None if result.wrist is None else result.wrist._asdict(),
        }


def gesture_message(gesture: str, phase: str, seq: int) -> dict[str, Any]:
    """The ``gesture`` message."""
    return {"type": "gesture", "gesture": gesture, "phase": phase, "seq": seq}


def bit_png(mask: NDArray[Any]) -> str:
    """A mask of 0 and 1 as a one-bit PNG in base64; 1 is white."""
    done, data = cv2.imencode(
        ".png", np.where(mask, np.uint8(255), np.uint8(0)), [cv2.IMWRITE_PNG_BILEVEL, 1]
    )
    assert done
    return base64.b64encode(data.tobytes()).decode("ascii")
