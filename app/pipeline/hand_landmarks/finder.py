"""Finder: the hands in one picture of which nothing is known yet.

The palm detector was made for hands at some distance. A hand that fills the picture or is cut off
by its edge is found when the picture is seen with a margin round it; one that is turned far, or
small, when the picture is turned or looked at part by part. So a photograph, which may take more
time than a frame, is looked at in several ways until a hand is surely there. The landmarks' own
presence says whether it is one, which lets the detector's threshold be low.
"""

import math
from collections.abc import Iterator
from itertools import product

from app.pipeline.hand_landmarks.landmarker import Landmarker
from app.pipeline.hand_landmarks.palms import PalmDetector, whole
from app.pipeline.hand_landmarks.region import region_of_hand, region_of_palm
from app.pipeline.hand_landmarks.types import HandLandmarks, Region
from app.pipeline.types import U8

LEAST_PALM = 0.2
"""Score of a palm in a photograph that is worth asking for landmarks."""
SURE = 0.8
"""Presence from which no other look is taken."""
WIDER = (2.0, 1.4)
"""Of the 144 photographs of the digit signs and the webcam that the first look missed, the first of
these found 119 and the second 111."""
TURNS = (35, -35, 90, -90, 180)
"""Degrees."""
PART = 0.6
"""Of the picture's longer side: the parts that it is looked at one by one."""
PALMS = 3
"""Palms of one look that are asked for landmarks at most, the surest first."""


def looks(pixels: U8) -> Iterator[Region]:
    """What of a picture is looked at, one after the other."""
    yield whole(pixels)
    for wider in WIDER:
        yield whole(pixels, wider)
    for degrees in TURNS:
        yield whole(pixels, WIDER[-1])._replace(turn=math.radians(degrees))
    height, width = pixels.shape[:2]
    side = PART * max(height, width)
    for x, y in product((0.0, 0.5, 1.0), repeat=2):
        yield Region(
            side / 2 + x * max(width - side, 0), side / 2 + y * max(height - side, 0), side, 0.0
        )


class HandFinder:
    """(h, w, 3) BGR or (h, w, 1) grey to its hand, or None."""

    def __init__(self, detector: PalmDetector, landmarker: Landmarker) -> None:
        self._detector = detector
        self._landmarker = landmarker

    def __call__(self, pixels: U8, least: float) -> HandLandmarks | None:
        """Find the hand that is most surely one.

        Args:
            pixels: The picture.
            least: Presence that it has at least.

        Returns:
            Looked at as a hand that is followed: in the region of its own landmarks.
        """
        best: HandLandmarks | None = None
        for where in looks(pixels):
            for palm in self._detector(pixels, LEAST_PALM, where)[:PALMS]:
                hand = self._landmarker(pixels, region_of_palm(palm))
                if best is None or hand.presence > best.presence:
                    best = hand
            if best is not None and best.presence >= SURE:
                break
        if best is None or best.presence < least:
            return None
        again = self._landmarker(pixels, region_of_hand(best.points))
        return again if again.presence >= least else best
