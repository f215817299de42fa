"""Photo: the hand in one photograph, looked at as often as it takes.

A photograph is enrolled once and asked about for years, so it gets the larger networks and several
looks, whose mean has fewer errors. On the photographs
of development one enrolled photo gives 0.89 with the mean and 0.87 with one look.
"""

import functools
import threading
from pathlib import Path
from typing import NamedTuple

from app.config import LandmarkSettings
from app.pipeline.hand_landmarks.files import path_of
from app.pipeline.hand_landmarks.finder import HandFinder
from app.pipeline.hand_landmarks.landmarker import Landmarker
from app.pipeline.hand_landmarks.palms import PalmDetector
from app.pipeline.hand_landmarks.region import region_of_hand, region_of_palm
from app.pipeline.hand_landmarks.shape import HandShape
from app.pipeline.hand_landmarks.tracker import is_of, same_hand
from app.pipeline.hand_landmarks.types import HandLandmarks
from app.pipeline.types import U8


class PhotoHand(NamedTuple):
    """The hand in a photograph.

    Attributes:
        hand: Its landmarks, in pixels of the picture.
        shape: The mean of the looks.
        second: Whether there is another hand.
    """

    hand: HandLandmarks
    shape: HandShape
    second: bool


def find_in_photo(pixels: U8, settings: LandmarkSettings) -> PhotoHand | None:
    """Find the hand in a (h, w, 3) BGR or (h, w, 1) grey picture, from any thread.

    Raises:
        CannotStart: a network is missing.
    """
    return _looker(settings.folder)(pixels, settings)


@functools.cache
def _looker(folder: Path | None) -> "_Looker":
    return _Looker(folder)


class _Looker:
    """The networks for photographs: one set a process, one photograph at a time."""

    def __init__(self, folder: Path | None) -> None:
        self._detector = PalmDetector(path_of("palm", "full", folder))
        self._full = Landmarker(path_of("hand", "full", folder))
        self._lite = Landmarker(path_of("hand", "lite", folder))
        self._find = HandFinder(self._detector, self._full)
        self._lock = threading.Lock()

    def __call__(self, pixels: U8, settings: LandmarkSettings) -> PhotoHand | None:
        with self._lock:
            hand = self._find(pixels, settings.min_presence)
            if hand is None:
                return None
            again = self._full(pixels, region_of_hand(hand.points))
            small = self._lite(pixels, again.region)
            looks = [hand]
            looks += [look for look in (again, small) if look.presence >= settings.min_presence]
            second = self._second(pixels, hand, settings)
            return PhotoHand(hand, HandShape.of(looks), second)

    def _second(self, pixels: U8, hand: HandLandmarks, settings: LandmarkSettings) -> bool:
        for palm in self._detector(pixels, settings.min_palm):
            if not is_of(palm, hand):
                other = self._full(pixels, region_of_palm(palm))
                if other.presence >= settings.min_presence and not same_hand(other, hand):
                    return True
        return False
