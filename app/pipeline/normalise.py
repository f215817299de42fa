"""Normalise: illumination stretched to the full range (paper: the other stage on the DSP)."""

from typing import NamedTuple, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from app.config import NormaliseSettings
from app.pipeline.types import U8


class Normalised(NamedTuple):
    """A plane stretched to 0..255.

    Attributes:
        plane: (h, w); a buffer that the next call overwrites.
        low: Level of the input that became 0.
        high: Level of the input that became 255.
        counts: (256,) pixels of each level of ``plane``. A buffer as well.
    """

    plane: U8
    low: int
    high: int
    counts: NDArray[np.int32]

    @classmethod
    def of(cls, plane: U8, low: int = 0, high: int = 255) -> Self:
        """A plane that is normalised already; its levels are counted."""
        return cls(plane, low, high, np.bincount(plane.ravel(), minlength=256).astype(np.int32))


class Normalise:
    """``out = clip(255 (in - low) / (high - low), 0, 255)`` as an integer look-up table.

    ``low`` and ``high`` are the levels below and above which a small part of the pixels lies, so
    that single hot or dead pixels do not set the range. Integer arithmetic, fixed shapes, nothing
    allocated for a frame of the shape of the one before it.
    """

    def __init__(self, settings: NormaliseSettings) -> None:
        self._clip = settings.clip
        self._out: U8 = np.empty(0, np.uint8)
        self._histogram: NDArray[np.float32] = np.zeros((256, 1), np.float32)
        self._below: NDArray[np.int32] = np.zeros(256, np.int32)
        self._counts: NDArray[np.int32] = np.zeros(256, np.int32)
        self._stretched: NDArray[np.int32] = np.zeros(256, np.int32)
        self._levels: NDArray[np.int32] = np.arange(256, dtype=np.int32)
        self._ramp: NDArray[np.int32] = np.zeros(256, np.int32)
        self._lut: U8 = np.zeros(256, np.uint8)

    def __call__(self, plane: U8) -> Normalised:
        """Stretch one (h, w) plane. A flat plane comes back as it is."""
        if self._out.shape != plane.shape:
            self._out = np.empty(plane.shape, np.uint8)
        cv2.calcHist([plane], [0], None, [256], [0, 256], hist=self._histogram)
        np.copyto(self._counts, self._histogram[:, 0], casting="unsafe")
        np.cumsum(self._counts, out=self._below)
        drop = int(plane.size * self._clip)
        low = int(np.searchsorted(self._below, drop, side="right"))
        high = int(np.searchsorted(self._below, plane.size - drop, side="left"))
        if high <= low:
            np.copyto(self._out, plane)
            return Normalised(self._out, low, low, self._counts)
        np.subtract(self._levels, low, out=self._ramp)
        np.multiply(self._ramp, 255, out=self._ramp)
        np.floor_divide(self._ramp, high - low, out=self._ramp)
        np.clip(self._ramp, 0, 255, out=self._ramp)
        np.copyto(self._lut, self._ramp, casting="unsafe")
        cv2.LUT(plane, self._lut, dst=self._out)
        # The new histogram follows from the old one; the picture need not be counted again.
        self._stretched.fill(0)
        np.add.at(self._stretched, self._lut, self._counts)
        return Normalised(self._out, low, high, self._stretched)
