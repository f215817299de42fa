"""Channel: the plane that is thresholded later, luminance or the red difference Cr."""

from typing import Literal

import cv2
import numpy as np

from app.pipeline.types import U8

COLOURLESS = 4
"""Levels. A picture whose Cr spans less has no colour (JPEG's rounding alone gives 2)."""


class Channel:
    """BGR to one plane, by ITU-R BT.601, full range, as JFIF has it.

    ``Y = 0.299 R + 0.587 G + 0.114 B``, ``Cr = 0.713 (R - Y) + 128``, in the fixed-point arithmetic
    of ``cv2.cvtColor``. Skin is redder than nearly everything around it, so Cr tells hand from
    background where luminance does not. A picture without colour falls back to luminance.
    """

    def __init__(self, channel: Literal["luminance", "cr"]) -> None:
        self._channel = channel
        self._ycrcb: U8 = np.empty(0, np.uint8)
        self._plane: U8 = np.empty(0, np.uint8)

    def __call__(self, pixels: U8) -> U8:
        """Pick the plane.

        Args:
            pixels: (h, w, 3) BGR or (h, w, 1) grey.

        Returns:
            (h, w); a buffer that the next call overwrites.
        """
        if pixels.shape[2] == 1:
            return pixels[:, :, 0]
        if self._ycrcb.shape != pixels.shape:
            self._ycrcb = np.empty(pixels.shape, np.uint8)
            self._plane = np.empty(pixels.shape[:2], np.uint8)
        if self._channel == "luminance":
            cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY, dst=self._plane)
            return self._plane
        cv2.cvtColor(pixels, cv2.COLOR_BGR2YCrCb, dst=self._ycrcb)
        cv2.extractChannel(self._ycrcb, 1, dst=self._plane)
        low, high, _, _ = cv2.minMaxLoc(self._plane)
        if high - low < COLOURLESS:
            cv2.extractChannel(self._ycrcb, 0, dst=self._plane)
        return self._plane
