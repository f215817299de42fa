"""Region: the turned square of a picture in which a hand is looked for its landmarks.

The constants are those of MediaPipe's published graphs (Apache-2.0),
``palm_detection_detection_to_roi`` and ``hand_landmark_landmarks_to_roi``. The networks were
trained on such regions.
"""

import math

import cv2
import numpy as np

from app.pipeline.hand_landmarks.types import (
    INDEX_MCP,
    MIDDLE_MCP,
    RING_MCP,
    WRIST,
    PalmDetection,
    Region,
)
from app.pipeline.types import F32, U8

PALM_SCALE, PALM_SHIFT = 2.6, -0.5
"""The square round a palm's box: so many times its longer side, moved by so much of its height
towards the fingers."""
HAND_SCALE, HAND_SHIFT = 2.0, -0.1
"""The same round a hand's landmarks."""
STABLE = (0, 1, 2, 3, 5, 6, 9, 10, 13, 14, 17, 18)
"""Landmarks that bound it: without the fingers' ends, which move most."""


def region_of_palm(palm: PalmDetection) -> Region:
    """The square in which the hand of a palm lies, turned so that its fingers point up."""
    left, top, right, bottom = (float(value) for value in palm.box)
    turn = _turn(palm.points[0], palm.points[2])
    height = bottom - top
    x, y = _moved((left + right) / 2, (top + bottom) / 2, turn, PALM_SHIFT * height)
    return Region(x, y, PALM_SCALE * max(right - left, height), turn)


def region_of_hand(points: F32) -> Region:
    """The square in which a hand is looked for in the next frame, from its (21, 2 or 3) landmarks.

    Its axis runs from the wrist to the mean of the roots of index, middle and ring finger, the
    middle one counted twice.
    """
    flat = points[:, :2].astype(np.float64)
    root = (flat[INDEX_MCP] + flat[RING_MCP]) / 4 + flat[MIDDLE_MCP] / 2
    turn = _turn(flat[WRIST], root)
    cosine, sine = math.cos(turn), math.sin(turn)
    axes = np.array([[cosine, sine], [-sine, cosine]])
    upright = flat[list(STABLE)] @ axes.T
    low, high = upright.min(axis=0), upright.max(axis=0)
    x, y = (low + high) / 2 @ axes
    width, height = high - low
    x, y = _moved(float(x), float(y), turn, HAND_SHIFT * float(height))
    return Region(x, y, HAND_SCALE * float(max(width, height)), turn)


def _turn(wrist: F32, root: F32) -> float:
    """Radians by which the way from the wrist to the fingers' roots is turned from up."""
    across, down = float(root[0] - wrist[0]), float(root[1] - wrist[1])
    angle = math.pi / 2 - math.atan2(-down, across)
    return angle - 2 * math.pi * math.floor((angle + math.pi) / (2 * math.pi))


def _moved(x: float, y: float, turn: float, down: float) -> tuple[float, float]:
    return x - down * math.sin(turn), y + down * math.cos(turn)


def to_picture(region: Region, size: int) -> F32:
    """(2, 3) matrix from pixels of a look of ``size`` x ``size`` to those of the picture."""
    scale = region.side / size
    cosine, sine = math.cos(region.turn) * scale, math.sin(region.turn) * scale
    half = size / 2
    return np.array(
        [
            [cosine, -sine, region.x - half * (cosine - sine)],
            [sine, cosine, region.y - half * (sine + cosine)],
        ],
        np.float32,
    )


def as_seen(pixels: U8, region: Region, out: U8) -> None:
    """Fill ``out``, (s, s, 3) RGB, with a region; what lies outside of the picture is black.

    Args:
        pixels: (h, w, 3) BGR, or (h, w) or (h, w, 1) grey.
        region: Of the picture.
        out: A buffer.
    """
    size = out.shape[0]
    colour = pixels.ndim == 3 and pixels.shape[2] == 3
    seen = cv2.warpAffine(
        pixels,
        to_picture(region, size),
        (size, size),
        dst=out if colour else None,
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
    )
    cv2.cvtColor(seen, cv2.COLOR_BGR2RGB if colour else cv2.COLOR_GRAY2RGB, dst=out)
