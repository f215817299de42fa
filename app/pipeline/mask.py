"""Learned mask: a small network says of every pixel whether it is hand, in any room.

The network (training/MODEL_CARD.md) sees the whole picture first. Where the hand fills little of
it, a second look at the part round its palm gives the fingers; in a stream that part is looked at
directly as long as the hand stays in it, so that most frames take one look.
"""

import math
from typing import NamedTuple

import cv2
import numpy as np

from app.pipeline.network import load
from app.pipeline.types import F32, U8, Box

MODEL = "hand_mask.onnx"
SIDE = 160
"""Pixels. A look has about as many in all as a square of this side, as in training."""
STEP = 16
"""Pixels. The network halves a picture four times, so its sides are multiples of this."""
THRESHOLD = 0.6
"""Share of hand from which a pixel is hand: a little more than half keeps close fingers apart."""
REACH = 4.6
"""Palm radii from the palm's centre to the edge of a second look; finger tips are within 4."""
WORTH_IT = 0.6
"""A second look is taken when its part is smaller than this part of the picture."""
SAME_MEAN, SAME_MOST = 0.8, 6.0
"""Levels, mean and largest, between thumbnails of two pictures that show the same: sensor noise
stays below when averaged, a finger tip that moves does not."""
MOST_SKIPPED = 5
"""Frames in a row that the last mask may stand for; a mistake never lasts."""
ROUND = 12
"""Pictures after which the whole of one is looked at again, for what is beside the hand."""
_THUMB = (40, 30)


class Hand(NamedTuple):
    """Where a coarse look found a palm, in pixels of the picture."""

    x: float
    y: float
    radius: float


class Masked(NamedTuple):
    """What the network made of one picture.

    Attributes:
        mask: (h, w), hand or bare arm = 1. A buffer.
        bounds: The part that was looked at; what lies outside of it is 0.
        sure: Mean share of hand over the mask, 0.5 to 1; 0 when the mask is empty.
    """

    mask: U8
    bounds: Box
    sure: float


class LearnedMask:
    """(h, w, 3) BGR or (h, w, 1) grey to a mask. Holds the part where the hand was last seen."""

    def __init__(self) -> None:
        self._session = load(MODEL)
        self._part: Box | None = None
        self._mask: U8 = np.empty(0, np.uint8)
        self._thumb: U8 = np.empty(0, np.uint8)
        self._masked: Masked | None = None
        self._skipped = 0
        self._since_whole = 0
        self.everything: F32 | None = None
        """Share of hand of the whole picture, when all of it was looked at for the last one."""
        self.looks = 0
        """Looks that the last picture took: 0 when the one before stood for it."""

    def __call__(self, pixels: U8) -> Masked:
        """Find the hand in a picture, the next of a stream or the only one."""
        self.looks = 0
        self.everything = None
        thumb = np.asarray(cv2.resize(pixels, _THUMB, interpolation=cv2.INTER_AREA), np.uint8)
        if self._masked is not None and self._same(thumb, pixels):
            self._skipped += 1
            self._since_whole += 1
            return self._masked
        self._skipped, self._thumb = 0, thumb
        self._since_whole += 1
        if self._mask.shape != pixels.shape[:2]:
            self._mask = np.empty(pixels.shape[:2], np.uint8)
            self._part = None
        whole = (0, 0, pixels.shape[1], pixels.shape[0])
        bounds = self._part or whole
        share = self._look(pixels, bounds)
        hand = _palm(share, bounds)
        if bounds != whole and not (hand and _inside(hand, bounds, whole)):
            bounds = whole
            share = self._look(pixels, bounds)
            hand = _palm(share, bounds)
        if bounds == whole and hand and (part := _part_round(hand, whole)) is not None:
            closer = self._look(pixels, part)
            if (seen := _palm(closer, part)) is not None:
                bounds, share, hand = part, closer, seen
        if self.everything is None and self._since_whole >= ROUND:
            self._look(pixels, whole)
        self._part = _part_round(hand, whole) if hand else None
        self._masked = self._spread(share, bounds)
        return self._masked

    def look_round(self) -> None:
        """Look at the whole of the next picture."""
        self._since_whole = ROUND

    def _same(self, thumb: U8, pixels: U8) -> bool:
        if self._skipped >= MOST_SKIPPED or self._mask.shape != pixels.shape[:2]:
            return False
        if thumb.shape != self._thumb.shape:
            return False
        change = cv2.absdiff(thumb, self._thumb)
        return bool(change.mean() <= SAME_MEAN and change.max() <= SAME_MOST)

    def _look(self, pixels: U8, part: Box) -> F32:
        """Share of hand of a part of the picture, at half the network's resolution."""
        self.looks += 1
        x, y, width, height = part
        scale = SIDE / math.sqrt(width * height)
        size = _fitting(width * scale), _fitting(height * scale)
        shrinks = size[0] < width
        seen = cv2.resize(
            pixels[y : y + height, x : x + width],
            size,
            interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR,
        )
        if seen.ndim == 2:
            seen = cv2.cvtColor(seen, cv2.COLOR_GRAY2BGR)
        share: F32 = self._session.run(None, {"input": seen})[0]
        if part == (0, 0, pixels.shape[1], pixels.shape[0]):
            self.everything, self._since_whole = share, 0
        return share

    def _spread(self, share: F32, bounds: Box) -> Masked:
        """The share at the picture's own resolution, thresholded."""
        x, y, width, height = bounds
        fine = cv2.resize(share, (width, height), interpolation=cv2.INTER_LINEAR)
        inside = (fine > THRESHOLD).view(np.uint8)
        self._mask.fill(0)
        self._mask[y : y + height, x : x + width] = inside
        count = cv2.countNonZero(inside)
        sure = float(cv2.mean(fine, inside)[0]) if count else 0.0
        return Masked(self._mask, bounds, sure)


def _fitting(length: float) -> int:
    return min(max(round(length / STEP), 3), 24) * STEP


def _palm(share: F32, part: Box) -> Hand | None:
    """The largest inscribed circle of the share, in pixels of the picture; None when too small."""
    rows, columns = share.shape
    framed = np.zeros((rows + 2, columns + 2), np.uint8)
    framed[1:-1, 1:-1] = share > THRESHOLD
    distance = cv2.distanceTransform(framed, cv2.DIST_L2, 3)
    _, radius, _, (column, row) = cv2.minMaxLoc(distance)
    if radius < 1.5:
        return None
    x, y, width, height = part
    across, down = width / columns, height / rows
    return Hand(
        x + (column - 0.5) * across, y + (row - 0.5) * down, radius * math.sqrt(across * down)
    )


def _part_round(hand: Hand, whole: Box) -> Box | None:
    """The part for a second look; None when it is not worth one."""
    reach = REACH * hand.radius
    left, top = max(0, int(hand.x - reach)), max(0, int(hand.y - reach))
    right = min(whole[2], math.ceil(hand.x + reach))
    bottom = min(whole[3], math.ceil(hand.y + reach))
    if (right - left) * (bottom - top) >= WORTH_IT * whole[2] * whole[3]:
        return None
    return left, top, right - left, bottom - top


def _inside(hand: Hand, part: Box, whole: Box) -> bool:
    """Whether the part still shows all of the hand: it is no larger, nor at an inner rim."""
    x, y, width, height = part
    reach = 1.5 * hand.radius
    return (
        max(width, height) >= 1.3 * REACH * hand.radius
        and (x == 0 or hand.x - reach >= x)
        and (y == 0 or hand.y - reach >= y)
        and (x + width == whole[2] or hand.x + reach <= x + width)
        and (y + height == whole[3] or hand.y + reach <= y + height)
    )
