"""Fingers: which of them are stretched and which are bent, from a hand's landmarks.

A finger is bent at its two outer joints; how far it leans at its root does not count. The thumb
bends little: it is told by how far its tip is from the little finger's root, since a thumb that is
put in lies over the palm.
"""

from typing import Final

import numpy as np

from app.pipeline.hand_landmarks.shape import HandShape
from app.pipeline.hand_landmarks.types import MIDDLE_MCP, PINKY_MCP, THUMB_TIP, WRIST
from app.pipeline.types import F32

FINGERS: Final = ("thumb", "index", "middle", "ring", "little")
"""In the order of the landmarks, and of every tuple of states."""
STRAIGHT, BENT = 1.2, 1.7
"""Rad, at the two outer joints of a finger together: stretched below the first, bent above the
second. Of the starter signs' samples bent ones have at least 1.9, and stretched ones at most
1.6, but for one finger of 1.84."""
THUMB_IN, THUMB_OUT = 0.9, 1.15
"""Palm lengths from the thumb's tip to the little finger's root: below the first it is put in,
above the second it is out. The same samples have at most 0.7 and at least 1.3."""

States = tuple[bool | None, ...]
"""Of the five fingers: stretched, bent, or None where that is in doubt."""


def stretched(hand: HandShape) -> States:
    """Which fingers of a hand are stretched."""
    points = hand.world
    palm = float(np.linalg.norm(points[MIDDLE_MCP] - points[WRIST]))
    away = float(np.linalg.norm(points[THUMB_TIP] - points[PINKY_MCP])) / max(palm, 1e-6)
    bends = [_bend(points[4 * finger + 1 : 4 * finger + 5]) for finger in range(1, 5)]
    thumb = True if away > THUMB_OUT else False if away < THUMB_IN else None
    return thumb, *(True if bend < STRAIGHT else False if bend > BENT else None for bend in bends)


def _bend(joints: F32) -> float:
    """Rad, of the (4, 3) joints of a finger, at the two in the middle."""
    bones = np.diff(joints, axis=0)
    bones /= np.maximum(np.linalg.norm(bones, axis=1, keepdims=True), 1e-6)
    cosines = np.clip(np.einsum("bi,bi->b", bones[1:], bones[:-1]), -1, 1)
    return float(np.arccos(cosines).sum())
