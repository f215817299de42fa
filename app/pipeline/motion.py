"""Motion gate: only a hand at rest is looked at (paper)."""

from typing import NamedTuple

import cv2
import numpy as np

from app.config import MotionSettings
from app.pipeline.types import U8


class Motion(NamedTuple):
    """What the gate says.

    Attributes:
        fraction: Part of the pixels that mismatch, 0 to 1; None before three frames were sampled.
        still: Fewer than the threshold mismatch.
        nearly_still: Fewer than the threshold for a gesture that is held already mismatch.
    """

    fraction: float | None
    still: bool
    nearly_still: bool


class MotionGate:
    """``mismatch = (f1 XOR f3) OR (f2 XOR f3)`` over the last three sampled binary frames.

    Motionless when the mismatch is fewer than 1% of the pixels (Raheja, Rajsekhar, Chaudhary:
    "Controlling a remotely located Robot using Hand Gestures in Real-time"). ``f3`` is the newest.
    Frames that come sooner than the sampling interval after the last sample leave the answer as it
    was.
    """

    def __init__(self, settings: MotionSettings) -> None:
        self._settings = settings
        self._frames: list[U8] = []
        self._mismatch: U8 = np.empty(0, np.uint8)
        self._other: U8 = np.empty(0, np.uint8)
        self.reset()

    def reset(self) -> None:
        """Forget all frames; the next three are waited for."""
        self._seen = 0
        self._sampled_at = float("-inf")
        self._last = Motion(None, False, False)

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
        if self._seen < 3:
            self._last = Motion(None, False, False)
            return self._last
        cv2.bitwise_xor(f1, f3, dst=self._mismatch)
        cv2.bitwise_xor(f2, f3, dst=self._other)
        cv2.bitwise_or(self._mismatch, self._other, dst=self._mismatch)
        fraction = cv2.countNonZero(self._mismatch) / mask.size
        self._last = Motion(
            fraction,
            fraction < self._settings.threshold,
            fraction < max(self._settings.threshold, self._settings.held_threshold),
        )
        return self._last
