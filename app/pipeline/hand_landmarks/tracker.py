"""Tracker: the hand in a stream of frames, found once and followed by its own landmarks."""

import math
from typing import NamedTuple

import numpy as np

from app.config import LandmarkSettings
from app.pipeline.hand_landmarks.files import path_of
from app.pipeline.hand_landmarks.landmarker import Landmarker
from app.pipeline.hand_landmarks.palms import PalmDetector, whole
from app.pipeline.hand_landmarks.region import region_of_hand, region_of_palm
from app.pipeline.hand_landmarks.types import PALM, HandLandmarks, PalmDetection, Region
from app.pipeline.types import F32, U8

SECOND_EVERY, SECOND_SEEN = 15, 5
"""Frames after which a second hand is looked for again: while none is there, and while one is."""
WIDENED = (1.0, 1.5)
"""How much wider than the picture it is looked at, in turn, while no hand is there: a hand that
fills the picture is found with a margin round it only."""
WEAK = 0.6
"""A palm's score may be so many times lower when the landmarks' presence says that it is one."""
SAME = 0.5
"""Of a hand's region: a palm whose middle is nearer to the hand's than this is of that hand."""
SMALLEST = 0.03
"""Of the picture's longer side: palms shorter than this tell no fingers apart."""


class Tracked(NamedTuple):
    """What a frame shows.

    Attributes:
        hand: The hand that is followed; None when there is none.
        second: Whether another hand was there when one was last looked for.
        found: Whether the palm detector ran, and so the frame took longer.
        unsure: The presence of what was looked at and is not taken for a hand; None when no palm
            was found at all.
    """

    hand: HandLandmarks | None
    second: bool
    found: bool
    unsure: float | None


class HandTracker:
    """(h, w, 3) BGR or (h, w, 1) grey, the next of a stream, to the hand in it.

    The detector looks at the whole picture only while no hand is followed, and now and then for a
    second one. Holds interpreters and buffers: one a pipeline, and one thread's at a time.

    Raises:
        CannotStart: a network is missing.
    """

    def __init__(self, settings: LandmarkSettings) -> None:
        self._settings = settings
        self._detector = PalmDetector(path_of("palm", settings.palm, settings.folder))
        self._landmarker = Landmarker(path_of("hand", settings.hand, settings.folder))
        self.reset()

    def reset(self) -> None:
        """Forget the hand that is followed."""
        self._region: Region | None = None
        self._candidate: Region | None = None
        self._second = False
        self._frames = 0
        self._turn = 0

    def __call__(self, pixels: U8) -> Tracked:
        """Find the hand in a frame."""
        if self._region is None:
            return self._find(pixels)
        hand = self._landmarker(pixels, self._region)
        if not self._is_hand(hand, pixels):
            # Looked for again in the next frame: one frame never pays for both.
            self._region, self._second = None, False
            return Tracked(None, False, False, hand.presence)
        self._region = region_of_hand(hand.points)
        self._frames += 1
        looked = self._look_for_second(pixels, hand)
        return Tracked(hand, self._second, looked, None)

    def _find(self, pixels: U8) -> Tracked:
        where = whole(pixels, WIDENED[self._turn])
        self._turn = (self._turn + 1) % len(WIDENED)
        palms = self._detector(pixels, WEAK * self._settings.min_palm, where)
        if not palms:
            return Tracked(None, False, True, None)
        hand = self._landmarker(pixels, region_of_palm(palms[0]))
        if not self._is_hand(hand, pixels):
            return Tracked(None, False, True, hand.presence)
        self._region, self._frames = region_of_hand(hand.points), 0
        others = [palm for palm in palms[1:] if not is_of(palm, hand)]
        self._candidate = region_of_palm(others[0]) if others else None
        return Tracked(hand, False, True, None)

    def _look_for_second(self, pixels: U8, hand: HandLandmarks) -> bool:
        """Detector in one frame, landmarks of what it found in the next; True when it ran."""
        if self._candidate is not None:
            other = self._landmarker(pixels, self._candidate)
            self._second = self._is_hand(other, pixels) and not same_hand(other, hand)
            self._candidate, self._frames = None, 0
            return False
        if self._frames < (SECOND_SEEN if self._second else SECOND_EVERY):
            return False
        self._frames = 0
        palms = self._detector(pixels, self._settings.min_palm)
        others = [palm for palm in palms if not is_of(palm, hand)]
        self._candidate = region_of_palm(others[0]) if others else None
        self._second = self._second and bool(others)
        return True

    def _is_hand(self, hand: HandLandmarks, pixels: U8) -> bool:
        """Whether it is one, large enough, and its palm is in the picture."""
        height, width = pixels.shape[:2]
        x, y = palm_middle(hand)
        return (
            hand.presence >= self._settings.min_presence
            and hand.palm_length >= SMALLEST * max(height, width)
            and 0 <= x < width
            and 0 <= y < height
        )


def palm_middle(hand: HandLandmarks) -> tuple[float, float]:
    """The middle of the palm, pixels."""
    middle: F32 = np.mean(hand.points[list(PALM), :2], axis=0)
    return float(middle[0]), float(middle[1])


def is_of(palm: PalmDetection, hand: HandLandmarks) -> bool:
    """Whether a palm that was found is that of a hand."""
    x, y = palm_middle(hand)
    middle = (palm.box[:2] + palm.box[2:]) / 2
    return math.hypot(float(middle[0]) - x, float(middle[1]) - y) < SAME * hand.region.side


def same_hand(one: HandLandmarks, other: HandLandmarks) -> bool:
    """Whether both are where one hand is."""
    (x, y), (u, v) = palm_middle(one), palm_middle(other)
    return math.hypot(x - u, y - v) < SAME * other.region.side
