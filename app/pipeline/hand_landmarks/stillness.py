"""Stillness: whether a hand rests, by its landmarks, in parts of its palm's length.

A mask flickers at its rim and a hand in the air trembles; neither changes what the fingers do. So
two things are measured, both independent of how near the hand is:

- its speed, palm lengths a second: how far the palm's middle is from where it was
  :data:`OVER_S` ago;
- its change of shape: the distance, in the unit in which gestures are compared
  (:class:`~app.pipeline.hand_landmarks.shape.ShapeFeatures`), from what it was ``settle_s`` ago.
"""

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from app.config import MotionSettings
from app.pipeline.hand_landmarks.tracker import palm_middle
from app.pipeline.hand_landmarks.types import HandLandmarks
from app.pipeline.types import F32

OVER_S = 0.1
"""Seconds over which speed is measured: three frames of most webcams."""
EARLY = 0.05
"""Part of a span by which a sample may be too young: cameras are not punctual."""
HELD = 2.0
"""A gesture that is held already may move so many times faster."""


class Rest(NamedTuple):
    """What the landmarks say of the hand's motion.

    Attributes:
        speed: Palm lengths a second; None until the hand was seen for long enough.
        change: Of its shape over the settling time, in the unit of a match; None likewise.
        still: It may be matched.
        nearly_still: It may go on holding a gesture.
        settled: A gesture may start.
    """

    speed: float | None
    change: float | None
    still: bool
    nearly_still: bool
    settled: bool


class _Sample(NamedTuple):
    at: float
    x: float
    y: float
    length: float
    features: F32


class Stillness:
    """One hand, frame after frame."""

    def __init__(self, settings: MotionSettings) -> None:
        self._settings = settings
        self._past: deque[_Sample] = deque()

    def reset(self) -> None:
        """Forget the hand."""
        self._past.clear()

    def __call__(self, hand: HandLandmarks, features: F32, now: float) -> Rest:
        """Look at a hand.

        Args:
            hand: As it was found.
            features: (v, d) of it, as it is compared; of two rows the nearer one counts.
            now: Seconds, monotonic.
        """
        settings = self._settings
        newest = _Sample(now, *palm_middle(hand), max(hand.palm_length, 1e-3), features)
        self._past.append(newest)
        span = max(OVER_S, settings.settle_s)
        while len(self._past) > 1 and self._past[1].at <= now - span * (1 - EARLY):
            self._past.popleft()
        before, long_ago = self._since(now, OVER_S), self._since(now, settings.settle_s)
        speed = None if before is None else _speed(before, newest)
        change = None if long_ago is None else _apart(long_ago.features, features)
        limit = settings.hand_speed
        still = speed is not None and speed < limit
        settled = settings.settle_s <= 0 or (change is not None and change < settings.hand_settle)
        nearly = speed is not None and speed < HELD * limit
        return Rest(speed, change, still, nearly, still and settled)

    def _since(self, now: float, span: float) -> _Sample | None:
        """The youngest sample that is so old."""
        due = now - span * (1 - EARLY)
        old = [sample for sample in self._past if sample.at <= due]
        return old[-1] if old else None


def _speed(before: _Sample, now: _Sample) -> float:
    way = math.hypot(now.x - before.x, now.y - before.y)
    return way / now.length / max(now.at - before.at, 1e-3)


def _apart(one: F32, other: F32) -> float:
    difference = one[:, None] - other[None]
    return float(np.sqrt(np.einsum("abd,abd->ab", difference, difference).min()))
