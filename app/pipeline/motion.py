"""Motion gate: only a hand at rest is looked at (paper)."""

from collections import deque
from typing import NamedTuple

import cv2
import numpy as np

from app.config import MotionSettings
from app.pipeline.types import U8

EARLY = 0.05
"""Part of the settling time by which a sample may be too young."""
SWAY = 0.05
"""Of the square root of its area: so far a hand that has settled may be from where it was. It may
tremble, and sway as hands in the air do; what counts is that its shape stays."""


class Motion(NamedTuple):
    """What the gate says.

    Attributes:
        fraction: Part of the pixels that mismatch, 0 to 1; None before three frames were sampled.
        still: Fewer than the threshold mismatch.
        nearly_still: Fewer than the threshold for a gesture that is held already mismatch.
        settled: The hand looks as it did a while ago, so that a gesture may start.
        trembling: It has settled and is nearly still: a large hand that trembles moves more than 1%
            of the picture, and yet is at rest. Never, where settling is left out.
    """

    fraction: float | None
    still: bool
    nearly_still: bool
    settled: bool
    trembling: bool


class _Sample(NamedTuple):
    at: float
    mask: U8
    area: float
    x: float
    """Of the centre of gravity, pixels."""
    y: float

    @classmethod
    def of(cls, mask: U8, at: float) -> "_Sample":
        moments = cv2.moments(mask, binaryImage=True)
        area = moments["m00"]
        return cls(
            at, mask.copy(), area, moments["m10"] / max(area, 1), moments["m01"] / max(area, 1)
        )


class MotionGate:
    """``mismatch = (f1 XOR f3) OR (f2 XOR f3)`` over the last three sampled binary frames.

    Motionless when the mismatch is fewer than 1% of the pixels (Raheja, Rajsekhar, Chaudhary:
    "Controlling a remotely located Robot using Hand Gestures in Real-time"). ``f3`` is the newest.
    Frames that come sooner than the sampling interval after the last sample leave the answer as it
    was.

    Three frames are a tenth of a second, and a finger is less than 1% of the picture: one that
    bends without haste is "motionless" all the way. So a second question (ours) is asked before a
    gesture may start: with ``f0``, the youngest sample at least ``settle_s`` older than ``f3``, the
    hand has settled when ``|f0 XOR f3| / max(|f0|, |f3|)`` is under ``settle_threshold``, their
    centres of gravity laid upon one another if they are no farther apart than :data:`SWAY`. It goes
    by the clock and by the hand, and so holds at any frame rate and distance from the camera.
    """

    def __init__(self, settings: MotionSettings) -> None:
        self._settings = settings
        self._frames: list[U8] = []
        self._mismatch: U8 = np.empty(0, np.uint8)
        self._other: U8 = np.empty(0, np.uint8)
        self._past: deque[_Sample] = deque()
        self.reset()

    def reset(self) -> None:
        """Forget all frames; the next three are waited for."""
        self._seen = 0
        self._sampled_at = float("-inf")
        self._last = Motion(None, False, False, False, False)
        self._past.clear()

    @property
    def mismatch(self) -> U8 | None:
        """(h, w), 1 where the last sample differs: a buffer. None before three were sampled."""
        return None if self._last.fraction is None else self._mismatch

    def __call__(self, mask: U8, now: float) -> Motion:
        """Look at one (h, w) mask of 0 and 1; ``now`` in seconds, monotonic."""
        if self._frames and self._frames[0].shape != mask.shape:
            self._frames.clear()
            self.reset()
        if not self._frames:
            self._frames = [np.empty(mask.shape, np.uint8) for _ in range(3)]
            self._mismatch = np.empty(mask.shape, np.uint8)
            self._other = np.empty(mask.shape, np.uint8)
        if now - self._sampled_at < self._settings.interval_s:
            return self._last
        self._sampled_at = now
        self._frames.append(self._frames.pop(0))
        f1, f2, f3 = self._frames
        np.copyto(f3, mask)
        self._seen += 1
        settled = self._settled(mask, now)
        if self._seen < 3:
            self._last = Motion(None, False, False, False, False)
            return self._last
        cv2.bitwise_xor(f1, f3, dst=self._mismatch)
        cv2.bitwise_xor(f2, f3, dst=self._other)
        cv2.bitwise_or(self._mismatch, self._other, dst=self._mismatch)
        fraction = cv2.countNonZero(self._mismatch) / mask.size
        nearly = fraction < max(self._settings.threshold, self._settings.held_threshold)
        self._last = Motion(
            fraction,
            still=fraction < self._settings.threshold,
            nearly_still=nearly,
            settled=settled,
            trembling=nearly and settled and self._settings.settle_s > 0,
        )
        return self._last

    def _settled(self, mask: U8, now: float) -> bool:
        """Remember a sample, and hold it against the one from ``settle_s`` ago."""
        span = self._settings.settle_s
        if span <= 0:
            return True
        newest = _Sample.of(mask, now)
        self._past.append(newest)
        # Cameras are not punctual: a sample that is a little too young is old enough.
        due = now - span * (1 - EARLY)
        while len(self._past) > 1 and self._past[1].at <= due:
            self._past.popleft()
        oldest = self._past[0]
        area = max(oldest.area, newest.area)
        if oldest.at > due or area == 0:
            return False
        dx, dy = round(newest.x - oldest.x), round(newest.y - oldest.y)
        if dx * dx + dy * dy > SWAY * SWAY * area:
            return False
        changed = cv2.countNonZero(self._difference(oldest.mask, mask, dx, dy))
        return changed < self._settings.settle_threshold * area

    def _difference(self, before: U8, after: U8, dx: int, dy: int) -> U8:
        """Where the masks differ when the first is moved by (dx, dy); what leaves is left out."""
        height, width = after.shape
        x, y = max(dx, 0), max(dy, 0)
        here = after[y : height + min(dy, 0), x : width + min(dx, 0)]
        there = before[y - dy : height + min(dy, 0) - dy, x - dx : width + min(dx, 0) - dx]
        return np.asarray(cv2.bitwise_xor(there, here), np.uint8)
