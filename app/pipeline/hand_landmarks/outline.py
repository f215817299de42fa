"""Outline: a hand's silhouette drawn from its landmarks.

It stands for the mask where the landmarks have found the hand: no light wall takes a finger from
it, and no face joins it. The widths are those of a mean hand, in palm lengths (A. Poston, "Human
Engineering Design Data Digest", 2000: a finger is about a fifth as wide as the palm is long).
"""

import cv2
import numpy as np

from app.pipeline.hand_landmarks.shape import BONES
from app.pipeline.hand_landmarks.types import PALM, WRIST, HandLandmarks
from app.pipeline.types import U8

FINGER, THUMB, ROOT = 0.19, 0.22, 0.2
"""Widths of a finger, the thumb, and of the palm's rim beyond its landmarks."""
ARM, ARM_WIDTH = 0.45, 0.5
"""How much of the arm is drawn beyond the wrist, and how wide."""
SHIFT = 4
"""Bits below a pixel that OpenCV draws with."""


def draw(hand: HandLandmarks, shape: tuple[int, int], scale: tuple[float, float]) -> U8:
    """Draw a hand.

    Args:
        hand: In pixels of its picture.
        shape: (h, w) of the mask.
        scale: Of the mask's pixels to the picture's, across and down.

    Returns:
        (h, w) of 0 and 1, a new array.
    """
    mask = np.zeros(shape, np.uint8)
    points = hand.points[:, :2] * np.array(scale, np.float32)
    length = hand.palm_length * (scale[0] + scale[1]) / 2
    fixed = np.rint(points * (1 << SHIFT)).astype(np.int32)

    def line(start: np.ndarray, end: np.ndarray, width: float) -> None:
        thick = max(1, round(width * length))
        cv2.line(mask, start.tolist(), end.tolist(), 1, thick, cv2.LINE_8, SHIFT)

    middle = fixed[list(PALM[1:])].mean(axis=0)
    palm = cv2.convexHull(fixed[[0, 1, 2, *PALM[1:]]])
    cv2.fillPoly(mask, [palm], 1, cv2.LINE_8, SHIFT)
    cv2.polylines(mask, [palm], True, 1, max(1, round(ROOT * length)), cv2.LINE_8, SHIFT)
    for start, end in BONES:
        line(fixed[start], fixed[end], THUMB if end < 5 else FINGER)
    away = fixed[WRIST] - middle
    reach = float(np.hypot(*away)) or 1.0
    arm = fixed[WRIST] + np.rint(away / reach * ARM * length * (1 << SHIFT)).astype(np.int32)
    line(fixed[WRIST], arm, ARM_WIDTH)
    return mask
