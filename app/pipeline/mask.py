"""Learned mask: a small network says of every pixel whether it is hand, in any room.

The network (training/MODEL_CARD.md) sees the whole picture first. Where the hand fills little of
it, a second look at the part round its palm gives the fingers; in a stream that part is looked at
directly as long as the hand stays in it, so that most frames take one look. What is followed may
not be the hand: when something moves beside it, the whole picture is looked at again.
"""

import math
from typing import NamedTuple

import cv2
import numpy as np

from app.pipeline.network import load
from app.pipeline.palm import MIN_CONTACT, arm_side
from app.pipeline.regrow import regrow
from app.pipeline.types import F32, U8, Box, Side

MODEL = "hand_mask.onnx"
SIDE = 160
"""Pixels. A look has about as many in all as a square of this side, as in training."""
STEP = 16
"""Pixels. The network halves a picture four times, so its sides are multiples of this."""
THRESHOLD = 0.6
"""Share of hand from which a pixel is hand: a little more than half keeps close fingers apart."""
REACH = 4.6
"""Palm radii from the palm's centre to the edge of a second look; finger tips are within 4."""
ASIDE, BEHIND = 3.6, 2.6
"""The same to either side, and towards the arm, where it is seen from which side the arm comes:
what lies beyond is cut off at the wrist, or is another thing."""
FARTHEST, ROUND = 7.0, 0.6
"""The same for a piece of the mask that reaches farther than that, as fingers do when the circle
lies near the wrist; and what is seen beyond its end."""
FINE = 24.0
"""Pixels of a palm's radius, at most, in a look that follows; more makes it no clearer. Of whole
webcam pictures 0.84 are told apart with 24, 0.81 with 20 and 0.78 with 17; of crops round a hand
0.95 at full size, 0.93 with 23 and 0.83 with 17."""
AGAIN, NEW = 5, 30
"""Frames after which the whole picture is looked at again although the hand is followed: the first
when something changed beside it, the second in any case."""
WORTH_IT, STAYS = 0.6, 0.1
"""A second look is taken when its part is smaller than this part of the picture. In a stream the
way taken is kept for so much beyond it: the two masks differ at the rim, and going to and fro
would look like motion."""
SAME_MEAN, SAME_MOST = 0.8, 6.0
"""Levels, mean and largest, between thumbnails of two pictures that show the same: sensor noise
stays below when averaged, a finger tip that moves does not."""
MOST_SKIPPED = 5
"""Frames in a row that the last mask may stand for; a mistake never lasts."""
BESIDE, CELLS = 24, 6
"""Levels by which at least so many cells of the thumbnail change when something comes into view
beside the part that is followed."""
_THUMB = (40, 30)


GROWN = 5.0
"""Palm radii that the longer side of a part has at least; a hand that came nearer has fewer."""


class Hand(NamedTuple):
    """Where a look found a palm, in pixels of the picture.

    Attributes:
        x: Of its centre.
        y: Of its centre.
        radius: Of its circle.
        arm: The side its arm comes from.
        extent: How far the piece of the mask reaches from the centre to the left, up, to the right
            and down.
    """

    x: float
    y: float
    radius: float
    arm: Side | None
    extent: tuple[float, float, float, float]


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
        self._followed = 0
        self._worth = WORTH_IT
        self._anchor: Hand | None = None
        """The hand by which part and fineness were chosen."""
        self._fine = math.inf
        self._arm: Side = "bottom"
        """Where the arm comes from, seen in the whole picture: fingers may touch a part's rim."""
        self._full = False
        """Whether the part reaches as far as any may."""
        self._around: U8 = np.empty(0, np.uint8)
        self._mask: U8 = np.empty(0, np.uint8)
        self._thumb: U8 = np.empty(0, np.uint8)
        self._masked: Masked | None = None
        self._skipped = 0
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
            return self._masked
        self._skipped, self._thumb = 0, thumb
        if self._mask.shape != pixels.shape[:2]:
            self._mask = np.empty(pixels.shape[:2], np.uint8)
            self._part, self._fine = None, math.inf
        whole = (0, 0, pixels.shape[1], pixels.shape[0])
        followed, how_fine = self._part, self._fine
        if followed is not None and self._stale(thumb, followed, whole):
            self._part, self._fine = None, math.inf
        bounds, fine = self._part or whole, self._fine
        share = self._look(pixels, bounds, fine)
        hand = _palm(share, bounds, whole)
        if bounds != whole and not (hand and self._keeps(hand, bounds, whole)):
            bounds = whole
            share = self._look(pixels, bounds)
            hand = _palm(share, bounds, whole)
        if afresh := bounds == whole:
            self._followed, self._around, self.everything = 0, thumb, share
            part: Box | None = None
            if hand and followed is not None and _inside(hand, followed, whole):
                # It is still the hand that is followed: looked at from elsewhere, its rim would
                # change, which looks like motion.
                part, fine = followed, how_fine
            elif hand:
                part, fine = _part_round(hand, whole, self._worth), FINE / hand.radius
                self._arm, self._full = hand.arm or "bottom", False
            if part is not None:
                closer = self._look(pixels, part, fine)
                seen = _palm(closer, part, whole)
                if seen and not self._full and _runs_out(seen, part, whole, self._arm):
                    # Closely seen, it has fingers that the first look had missed.
                    self._full = True
                    part = _part_round(seen._replace(arm=self._arm), whole, 1.0, FARTHEST) or part
                    closer = self._look(pixels, part, fine)
                    seen = _palm(closer, part, whole)
                if seen:
                    bounds, share, hand = part, closer, seen
        self._followed += 1
        self._go_after(hand, bounds, whole, fine if afresh and bounds != whole else None)
        self._masked = self._spread(share, bounds)
        return self._masked

    def _go_after(self, hand: Hand | None, bounds: Box, whole: Box, fine: float | None) -> None:
        """Choose what the next picture is looked at first: the same, for a hand that rests.

        ``fine`` is that of a part which was just chosen from the whole picture: it is kept, so that
        a stream sees a resting hand as a photograph of it is seen.
        """
        rests = hand is not None and self._anchor is not None and _rests(hand, self._anchor)
        if rests and bounds == (self._part or whole):
            return
        self._worth = WORTH_IT
        if hand:
            self._worth += STAYS if bounds != whole else -STAYS
        if fine is not None:
            self._part, self._fine = bounds, fine
        else:
            self._part = _part_round(hand, whole, self._worth) if hand else None
            self._fine = FINE / hand.radius if hand else math.inf
        self._anchor = hand

    def _keeps(self, hand: Hand, part: Box, whole: Box) -> bool:
        """Whether the part that is followed still shows all of the hand."""
        runs_out = not self._full and _runs_out(hand, part, whole, self._arm)
        return _inside(hand, part, whole) and not runs_out

    def look_round(self) -> None:
        """Look at the whole of the next picture that is not like this one."""
        self._followed = NEW

    def _stale(self, thumb: U8, part: Box, whole: Box) -> bool:
        """Whether another hand may have come into the picture beside the part."""
        if self._followed < AGAIN:
            return False
        if self._followed >= NEW or thumb.shape != self._around.shape:
            return True
        change = cv2.absdiff(thumb, self._around)
        x, y, width, height = part
        across, down = _THUMB[0] / whole[2], _THUMB[1] / whole[3]
        rows = slice(int(y * down), math.ceil((y + height) * down))
        columns = slice(int(x * across), math.ceil((x + width) * across))
        change[rows, columns] = 0
        most = change if change.ndim == 2 else change.max(axis=2)
        return bool(np.count_nonzero(most > BESIDE) >= CELLS)

    def _same(self, thumb: U8, pixels: U8) -> bool:
        if self._skipped >= MOST_SKIPPED or self._mask.shape != pixels.shape[:2]:
            return False
        if thumb.shape != self._thumb.shape:
            return False
        change = cv2.absdiff(thumb, self._thumb)
        return bool(change.mean() <= SAME_MEAN and change.max() <= SAME_MOST)

    def _look(self, pixels: U8, part: Box, most: float = math.inf) -> F32:
        """Share of hand of a part of the picture, at half the network's resolution."""
        self.looks += 1
        x, y, width, height = part
        scale = min(SIDE / math.sqrt(width * height), most)
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
        return regrow(share, np.asarray(seen, np.uint8), THRESHOLD)

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


def _palm(share: F32, part: Box, whole: Box) -> Hand | None:
    """The largest inscribed circle of the share, in pixels of the picture; None when too small."""
    rows, columns = share.shape
    framed = np.zeros((rows + 2, columns + 2), np.uint8)
    framed[1:-1, 1:-1] = share > THRESHOLD
    distance = cv2.distanceTransform(framed, cv2.DIST_L2, 3)
    _, radius, _, (column, row) = cv2.minMaxLoc(distance)
    if radius < 1.5:
        return None
    *_, box = cv2.floodFill(framed, None, (column, row), 2)
    arm = arm_side((framed[1:-1, 1:-1] == 2).view(np.uint8), MIN_CONTACT * radius)
    x, y, width, height = part
    across, down = width / columns, height / rows
    left, top = (column - box[0]) * across, (row - box[1]) * down
    extent = left, top, box[2] * across - left, box[3] * down - top
    return Hand(
        x + (column - 0.5) * across,
        y + (row - 0.5) * down,
        radius * math.sqrt(across * down),
        arm,
        extent,
    )


_EXTENT: tuple[Side, ...] = ("left", "top", "right", "bottom")
_OPPOSITE: dict[Side, Side] = {"left": "right", "right": "left", "top": "bottom", "bottom": "top"}


def _part_round(hand: Hand, whole: Box, worth: float, least: float = 0.0) -> Box | None:
    """The part for a second look; None when it is more than ``worth`` of the picture.

    ``least`` palm radii are seen on every side but the arm's.
    """
    reach = []
    for side, seen in zip(_EXTENT, hand.extent, strict=True):
        if side == hand.arm:
            radii = BEHIND
        else:
            usual = REACH if hand.arm in (None, _OPPOSITE[side]) else ASIDE
            radii = max(usual, least, min(seen / hand.radius + ROUND, FARTHEST))
        reach.append(radii * hand.radius)
    left, top = max(0, int(hand.x - reach[0])), max(0, int(hand.y - reach[1]))
    right = min(whole[2], math.ceil(hand.x + reach[2]))
    bottom = min(whole[3], math.ceil(hand.y + reach[3]))
    if (right - left) * (bottom - top) >= worth * whole[2] * whole[3]:
        return None
    return left, top, right - left, bottom - top


def _rests(hand: Hand, anchor: Hand) -> bool:
    """Whether a hand is where and as large as it was, but for the jitter of a palm's circle."""
    away = math.hypot(hand.x - anchor.x, hand.y - anchor.y)
    return abs(hand.radius - anchor.radius) < 0.15 * anchor.radius and away < 0.4 * anchor.radius


def _runs_out(hand: Hand, part: Box, whole: Box, arm: Side) -> bool:
    """Whether the piece of the mask goes on beyond an inner rim of the part that is not the arm's.

    A rim's outermost 1/40 counts as touched: a look has few pixels more than that.
    """
    x, y, width, height = part
    left, up, right, down = hand.extent
    near = max(width, height) / 40
    touched = {
        "left": x > 0 and hand.x - left <= x + near,
        "top": y > 0 and hand.y - up <= y + near,
        "right": x + width < whole[2] and hand.x + right >= x + width - near,
        "bottom": y + height < whole[3] and hand.y + down >= y + height - near,
    }
    return any(is_touched for side, is_touched in touched.items() if side != arm)


def _inside(hand: Hand, part: Box, whole: Box) -> bool:
    """Whether the part still shows all of the hand: it is no larger, nor at an inner rim."""
    x, y, width, height = part
    reach = 1.5 * hand.radius
    return (
        max(width, height) >= GROWN * hand.radius
        and (x == 0 or hand.x - reach >= x)
        and (y == 0 or hand.y - reach >= y)
        and (x + width == whole[2] or hand.x + reach <= x + width)
        and (y + height == whole[3] or hand.y + reach <= y + height)
    )
