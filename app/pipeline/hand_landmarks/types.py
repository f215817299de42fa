"""What the hand networks hand over, with shapes and units."""

from typing import NamedTuple

import numpy as np

from app.pipeline.types import F32

POINTS = 21
"""Landmarks of a hand: the wrist, then four of each finger from its root to its tip, thumb first.

Numbers as in F. Zhang et al., "MediaPipe Hands: On-device Real-time Hand Tracking", 2020.
"""
WRIST, THUMB_TIP, INDEX_MCP, MIDDLE_MCP, RING_MCP, PINKY_MCP = 0, 4, 5, 9, 13, 17
TIPS = (4, 8, 12, 16, 20)
PALM = (0, 5, 9, 13, 17)
"""The landmarks round the palm: the wrist and the roots of the four fingers."""


class Region(NamedTuple):
    """A turned square of a picture.

    Attributes:
        x: Of its centre, pixels.
        y: Of its centre, pixels.
        side: Pixels.
        turn: Radians from the picture's axes to the square's, clockwise as seen: up in the square
            is ``(sin turn, -cos turn)`` in the picture.
    """

    x: float
    y: float
    side: float
    turn: float


class PalmDetection(NamedTuple):
    """A palm that was found.

    Attributes:
        box: (4,) left, top, right, bottom, pixels.
        points: (7, 2) pixels: wrist, roots of index, middle, ring and little finger, and the two
            lower joints of the thumb.
        score: 0 to 1.
    """

    box: F32
    points: F32
    score: float


class HandLandmarks(NamedTuple):
    """One hand.

    Attributes:
        points: (21, 3). x and y in pixels of the picture; z in the same unit, from the wrist, away
            from the camera.
        world: (21, 3) metres, from the hand's middle: x right, y down, z away from the camera.
        presence: Probability, 0 to 1, that the region holds a hand.
        right: Probability, 0 to 1, that it is a right hand, in a picture that is not mirrored.
        region: That was looked at.
    """

    points: F32
    world: F32
    presence: float
    right: float
    region: Region

    def scaled(self, scale: float) -> "HandLandmarks":
        """The same hand in a picture so many times as large."""
        x, y, side, turn = self.region
        region = Region(x * scale, y * scale, side * scale, turn)
        return self._replace(points=self.points * np.float32(scale), region=region)

    @property
    def palm_length(self) -> float:
        """Pixels from the wrist to the root of the middle finger, depth included."""
        bone = self.points[MIDDLE_MCP] - self.points[WRIST]
        return float((bone @ bone) ** 0.5)
