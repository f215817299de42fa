"""ROI: the box round the hand, by the paper's offsets."""

import cv2
import numpy as np
from numpy.typing import NDArray

from app.config import RoiSettings
from app.pipeline.types import U8, Box


class RegionOfInterest:
    """Each side moves inwards until a line holds more white pixels than the offset.

    ``Hor_offset = m/100`` for rows and ``Ver_offset = n/100`` for columns of a mask ``m`` wide and
    ``n`` high (Raheja, Rajsekhar, Chaudhary), so that specks and hairs do not widen the box.
    """

    def __init__(self, settings: RoiSettings) -> None:
        self._offset = settings.offset
        self._rows: NDArray[np.int32] = np.empty(0, np.int32)
        self._columns: NDArray[np.int32] = np.empty(0, np.int32)

    def __call__(self, mask: U8) -> Box | None:
        """Box ``(x, y, width, height)`` in a (h, w) mask of 0 and 1; None without a hand."""
        height, width = mask.shape
        if self._rows.shape != (height, 1) or self._columns.shape != (1, width):
            self._rows = np.empty((height, 1), np.int32)
            self._columns = np.empty((1, width), np.int32)
        cv2.reduce(mask, 1, cv2.REDUCE_SUM, dst=self._rows, dtype=cv2.CV_32S)
        cv2.reduce(mask, 0, cv2.REDUCE_SUM, dst=self._columns, dtype=cv2.CV_32S)
        rows = np.flatnonzero(self._rows[:, 0] > self._offset * width)
        columns = np.flatnonzero(self._columns[0] > self._offset * height)
        if rows.size == 0 or columns.size == 0:
            return None
        x, y = int(columns[0]), int(rows[0])
        return x, y, int(columns[-1]) + 1 - x, int(rows[-1]) + 1 - y
