"""Binarise: global threshold (Otsu) to two colours, hand = 1."""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from app.config import BinariseSettings
from app.pipeline.normalise import Normalised
from app.pipeline.types import U8


class Binary(NamedTuple):
    """A thresholded plane.

    Attributes:
        mask: (h, w), hand = 1; all 0 when the contrast is too small. A buffer.
        threshold: Level of the normalised plane; lighter pixels are above it.
        contrast: Between the means of the two sides, in levels of the plane before normalising.
        light: True when the lighter side is the hand.
    """

    mask: U8
    threshold: int
    contrast: float
    light: bool


class Binarise:
    """Otsu's global threshold (N. Otsu, IEEE Trans. SMC 9(1), 1979).

    The threshold ``t`` maximises the variance between the classes
    ``w0 w1 (mu0 - mu1)^2`` over the histogram, where ``w`` are the classes' weights and ``mu``
    their means. With polarity ``auto`` the hand is the side that holds less of the picture's
    border: an arm crosses a part of one side, the background has the rest.
    """

    def __init__(self, settings: BinariseSettings) -> None:
        self._settings = settings
        self._mask: U8 = np.empty(0, np.uint8)
        self._histogram: NDArray[np.float32] = np.zeros((256, 1), np.float32)

    def __call__(self, picture: Normalised) -> Binary:
        """Threshold one normalised plane."""
        plane = picture.plane
        if self._mask.shape != plane.shape:
            self._mask = np.empty(plane.shape, np.uint8)
        mask = self._mask
        level, _ = cv2.threshold(plane, 0, 1, cv2.THRESH_BINARY | cv2.THRESH_OTSU, dst=mask)
        contrast = self._contrast(plane, int(level)) * (picture.high - picture.low) / 255
        light = self._hand_is_light(mask)
        if contrast <= 0 or contrast < self._settings.min_contrast:
            mask.fill(0)
        elif not light:
            cv2.bitwise_xor(mask, 1, dst=mask)  # type: ignore[call-overload]
        return Binary(mask, int(level), contrast, light)

    def _contrast(self, plane: U8, level: int) -> float:
        cv2.calcHist([plane], [0], None, [256], [0, 256], hist=self._histogram)
        counts = self._histogram[:, 0]
        below, above = float(counts[: level + 1].sum()), float(counts[level + 1 :].sum())
        if below == 0 or above == 0:
            return 0.0
        mean_below = float(_LEVELS[: level + 1] @ counts[: level + 1]) / below
        mean_above = float(_LEVELS[level + 1 :] @ counts[level + 1 :]) / above
        return mean_above - mean_below

    def _hand_is_light(self, mask: U8) -> bool:
        if self._settings.polarity != "auto":
            return self._settings.polarity == "light"
        height, width = mask.shape
        white = sum(cv2.countNonZero(line) for line in (mask[0], mask[-1], mask[:, 0], mask[:, -1]))
        return bool(white <= height + width)


_LEVELS = np.arange(256, dtype=np.float32)
