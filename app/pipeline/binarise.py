"""Binarise: global threshold (Otsu) to two colours, hand = 1."""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from app.config import BinariseSettings
from app.pipeline.holes import fill_holes
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
    their means; levels above it are one class. It is computed from the histogram that normalising
    leaves behind. With polarity ``auto`` the hand is the side that holds less of the picture's
    border: an arm crosses a part of one side, the background has the rest.
    """

    def __init__(self, settings: BinariseSettings) -> None:
        self._settings = settings
        self._mask: U8 = np.empty(0, np.uint8)

    def __call__(self, picture: Normalised) -> Binary:
        """Threshold one normalised plane."""
        plane = picture.plane
        if self._mask.shape != plane.shape:
            self._mask = np.empty(plane.shape, np.uint8)
        mask = self._mask
        level, difference = otsu(picture.counts)
        cv2.threshold(plane, level, 1, cv2.THRESH_BINARY, dst=mask)
        contrast = difference * (picture.high - picture.low) / 255
        light = self._hand_is_light(mask)
        if contrast <= 0 or contrast < self._settings.min_contrast:
            mask.fill(0)
        elif not light:
            cv2.bitwise_xor(mask, 1, dst=mask)  # type: ignore[call-overload]
        fill_holes(mask, self._settings.fill_holes)
        return Binary(mask, level, contrast, light)

    def _hand_is_light(self, mask: U8) -> bool:
        if self._settings.polarity != "auto":
            return self._settings.polarity == "light"
        height, width = mask.shape
        white = sum(cv2.countNonZero(line) for line in (mask[0], mask[-1], mask[:, 0], mask[:, -1]))
        return bool(white <= height + width)


_LEVELS = np.arange(256, dtype=np.float64)


def otsu(counts: NDArray[np.int32]) -> tuple[int, float]:
    """Threshold of a (256,) histogram, and the difference of the means of its two sides.

    With ``n(t)`` pixels of sum ``s(t)`` up to level ``t``, of ``N`` and ``S`` in all, the variance
    between the classes is proportional to ``(S n - N s)^2 / (n (N - n))``.
    """
    below = np.cumsum(counts, dtype=np.float64)
    total = np.cumsum(counts * _LEVELS)
    spread = total[-1] * below - below[-1] * total
    weights = below * (below[-1] - below)
    with np.errstate(divide="ignore", invalid="ignore"):
        between = np.where(weights > 0, spread * spread / weights, 0.0)
    level = int(between.argmax())
    if weights[level] <= 0:
        return level, 0.0
    return level, float(spread[level] / weights[level])
