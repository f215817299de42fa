"""Palm: the largest circle inside the mask, and the piece of the mask it lies in."""

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from app.pipeline.types import U8, Box, Side

SIDES: tuple[Side, ...] = ("bottom", "left", "top", "right")
MIN_CONTACT = 0.25
"""Palm radii. A piece that touches the picture's border on less has no arm in the picture."""
ALMOST, KEPT = 0.96, 0.9
"""In a fist, or a palm and its forearm, two circles may be nearly as large as each other. To and
fro between them the wrist would be cut here and there; so the one nearer the fingers becomes the
palm from the first of these parts of the largest, and stays it in a stream down to the second."""
NEAR = 0.4
"""Palm radii within which a circle is found again in the next picture."""


class Palm(NamedTuple):
    """The hand's piece and its palm.

    Attributes:
        piece: (h, w), 0 or 1: the connected piece round the palm, arm included. A buffer.
        x: Of the palm's centre, pixels.
        y: Of the palm's centre, pixels.
        radius: Of the largest inscribed circle, pixels; 0 when the mask is empty.
        area: Pixels of the piece.
        arm: The side at which the piece touches the border of what was looked at most, or None.
    """

    piece: U8
    x: int
    y: int
    radius: float
    area: int
    arm: Side | None

    @property
    def found(self) -> bool:
        """Whether there is anything white at all."""
        return self.radius > 0


def arm_side(piece: U8, least: float) -> Side | None:
    """The side where most of the piece's border pixels lie, if they are more than ``least``."""
    contact = (
        cv2.countNonZero(piece[-1]),
        cv2.countNonZero(piece[:, 0]),
        cv2.countNonZero(piece[0]),
        cv2.countNonZero(piece[:, -1]),
    )
    most = max(contact)
    return SIDES[contact.index(most)] if most > 0 and most >= least else None


class PalmFinder:
    """The maximum of the Euclidean distance transform is the palm's largest inscribed circle.

    ``radius = max_p min_{q not in mask} |p - q|`` (OpenCV's 5x5 chamfer approximation; Borgefors,
    CVGIP 34, 1986). What lies outside the picture counts as background, so that the whole circle is
    in the picture. Everything not connected to the palm is dropped.
    """

    def __init__(self, *, towards_fingers: bool = True) -> None:
        """``towards_fingers``: of circles almost as large, take the one nearest the fingers."""
        self._towards_fingers = towards_fingers
        self._piece: U8 = np.empty(0, np.uint8)
        self._framed: U8 = np.empty(0, np.uint8)
        self._distance: NDArray[np.float32] = np.empty(0, np.float32)
        self._last: tuple[int, int, float] | None = None
        """x, y and radius in the picture before this one."""

    def __call__(self, mask: U8, bounds: Box | None = None) -> Palm:
        """Find the palm in a (h, w) mask of 0 and 1.

        ``bounds`` is the part of the picture that a learned mask covers; None for a mask of all of
        it. A learned mask leaves sleeves out, so that a hand need not touch the border: its arm is
        taken to come from below then.
        """
        if self._piece.shape != mask.shape:
            self._piece = np.empty(mask.shape, np.uint8)
            framed = (mask.shape[0] + 2, mask.shape[1] + 2)
            self._framed = np.zeros(framed, np.uint8)
            self._distance = np.empty(framed, np.float32)
            self._last = None
        piece = self._piece
        np.copyto(self._framed[1:-1, 1:-1], mask)
        cv2.distanceTransform(self._framed, cv2.DIST_L2, 5, dst=self._distance)
        _, radius, _, (x, y) = cv2.minMaxLoc(self._distance)
        if radius <= 0:
            piece.fill(0)
            self._last = None
            return Palm(piece, 0, 0, 0.0, 0, None)
        x, y = x - 1, y - 1
        np.copyto(piece, mask)
        area, *_ = cv2.floodFill(piece, None, (x, y), 2)
        cv2.threshold(piece, 1, 1, cv2.THRESH_BINARY, dst=piece)
        seen = piece
        if bounds is not None:
            left, top, width, height = bounds
            seen = piece[top : top + height, left : left + width]
        arm = arm_side(seen, MIN_CONTACT * radius)
        if arm is None and bounds is not None:
            arm = "bottom"
        if self._towards_fingers:
            x, y, radius = self._nearest_fingers(x, y, radius, arm)
        return Palm(piece, x, y, radius, int(area), arm)

    def _nearest_fingers(
        self, x: int, y: int, most: float, arm: Side | None
    ) -> tuple[int, int, float]:
        """x, y and radius of the palm, given the largest circle's; remembered."""
        distance = self._distance[1:-1, 1:-1]
        upright = arm in ("bottom", "top", None)
        plateau = (distance >= ALMOST * most) & (self._piece > 0)
        lines = np.flatnonzero(plateau.any(axis=1 if upright else 0))
        # The plateau's end is not its summit, which lies a little farther in.
        deep = max(1, round(most / 2))
        if arm in ("top", "left"):
            part = slice(max(0, int(lines[-1]) - deep), int(lines[-1]) + 1)
        else:
            part = slice(int(lines[0]), int(lines[0]) + deep + 1)
        everything = slice(None)
        place = self._highest((part, everything) if upright else (everything, part))
        if self._last is not None:
            last_x, last_y, radius = self._last
            reach = math.ceil(NEAR * radius)
            rows = slice(max(0, last_y - reach), last_y + reach + 1)
            kept = self._highest((rows, slice(max(0, last_x - reach), last_x + reach + 1)))
            beyond = {
                "bottom": place[1] - kept[1],
                "top": kept[1] - place[1],
                "left": kept[0] - place[0],
                "right": place[0] - kept[0],
            }[arm or "bottom"]
            if kept[2] >= KEPT * most and beyond > 0:
                place = kept
        self._last = place
        return place

    def _highest(self, part: tuple[slice, slice]) -> tuple[int, int, float]:
        """x, y and radius of the largest circle of the piece whose centre lies in a part."""
        inner = self._distance[1:-1, 1:-1][part]
        _, radius, _, (x, y) = cv2.minMaxLoc(inner, self._piece[part])
        return x + (part[1].start or 0), y + (part[0].start or 0), radius
