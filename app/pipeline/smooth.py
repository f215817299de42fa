"""Smooth: integer Gaussian (paper: one of the two stages that ran on the DSP)."""

import cv2
import numpy as np

from app.config import SmoothSettings
from app.pipeline.types import U8

BINOMIAL = {1: (1,), 3: (1, 2, 1), 5: (1, 4, 6, 4, 1), 7: (2, 7, 14, 18, 14, 7, 2)}
"""Weights of one dimension by kernel size; they sum to 1, 4, 16 and 64, so that dividing is a
shift. These are the kernels that OpenCV itself uses for 8-bit pictures with sigma 0."""


class Smooth:
    """Separable integer Gaussian, in fixed point, rounded once.

    ``out = (sum_ij w_i w_j in_ij + S/2) / S`` with ``S = (sum w)^2``, a power of two; borders are
    mirrored without repeating the edge. Nothing is allocated for a frame of the shape of the one
    before it, so that the stage can run on an edge node beside a camera.
    """

    def __init__(self, settings: SmoothSettings) -> None:
        self._size = (settings.kernel, settings.kernel)
        self._out: U8 = np.empty(0, np.uint8)

    def __call__(self, plane: U8) -> U8:
        """Smooth one (h, w) plane; returns a buffer that the next call overwrites."""
        if self._size[0] == 1:
            return plane
        if self._out.shape != plane.shape:
            self._out = np.empty(plane.shape, np.uint8)
        cv2.GaussianBlur(plane, self._size, 0, dst=self._out, borderType=cv2.BORDER_REFLECT_101)
        return self._out
