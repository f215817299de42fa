"""Live: the stage ``find``, from a frame to the landmarks of its hand and their silhouette."""

from typing import Self

import cv2
import numpy as np

from app.config import LandmarkSettings, PipelineSettings
from app.pipeline.hand_landmarks import files
from app.pipeline.hand_landmarks.outline import draw
from app.pipeline.hand_landmarks.tracker import HandTracker, Tracked, palm_middle
from app.pipeline.hand_landmarks.types import MIDDLE_MCP, WRIST, HandLandmarks
from app.pipeline.palm import Palm
from app.pipeline.types import U8, Side, Way

MASK_SIDE = 180
"""Pixels. The silhouette's shorter side has at least so many, as the masks of other ways."""
COVERED = 0.9
"""Of the landmarks in the picture that a mask has to hold: 19 of 21; two may lie beside it."""
NEAR = 0.25
"""Palm radii within which it holds them."""
LARGER = 4.0
"""Times the silhouette's area: so much more a mask may have, with a bare arm."""
PALM_RADIUS = 0.46
"""Of the palm's inscribed circle, in palm lengths."""


class ByLandmarks:
    """A frame to its hand. One a pipeline.

    Attributes:
        way: For the frame's message.
        second: Whether there is a second hand.
    """

    def __init__(self, settings: LandmarkSettings) -> None:
        self._settings = settings
        self._track = HandTracker(settings)
        self._seen = Tracked(None, False, False, None)
        self.way = Way("landmarks", "")
        """The same whether or not a hand is seen: nothing else was tried first."""

    @classmethod
    def where_wanted(cls, settings: PipelineSettings) -> Self | None:
        """None when the settings say so, or with ``auto`` where a network is missing.

        Raises:
            CannotStart: with ``on``, where a network is missing.
        """
        return cls(settings.landmarks) if wanted(settings) else None

    def reset(self) -> None:
        """Forget the hand that is followed."""
        self._track.reset()

    @property
    def second(self) -> bool:
        """Whether another hand is in the picture."""
        return self._seen.second

    def __call__(self, pixels: U8) -> tuple[HandLandmarks | None, U8, Palm | None]:
        """Find the hand.

        Returns:
            Its landmarks, in pixels of ``pixels``; the picture at the size of the masks; and the
            hand's silhouette and palm at that size. None and None without a hand.
        """
        self._seen = self._track(pixels)
        hand = self._seen.hand
        if hand is None:
            return None, shrunk(pixels), None
        height, width = pixels.shape[:2]
        shape = mask_shape(height, width)
        return hand, shrunk(pixels), silhouette(hand, shape, (shape[1] / width, shape[0] / height))

    def nothing(self, pixels: U8) -> Palm:
        """A palm that is none, for a picture of this size."""
        return Palm(np.zeros(pixels.shape[:2], np.uint8), 0, 0, 0.0, 0, None)

    def why_none(self) -> str:
        """Why there is no hand in the last frame."""
        unsure = self._seen.unsure
        if unsure is None:
            return "no hand in the picture"
        return (
            "no hand in the picture: what is most like one is hardly one "
            f"({unsure:.2f}, at least {self._settings.min_presence:.2f} needed)"
        )


def wanted(settings: PipelineSettings) -> bool:
    """Whether hands are found by landmarks: by these settings, on this machine."""
    mine = settings.landmarks
    if mine.mode == "on":
        return True
    if mine.mode == "off" or settings.binarise.mode != "auto":
        return False
    networks = (
        files.find("palm", mine.palm, mine.folder),
        files.find("hand", mine.hand, mine.folder),
        # For photographs.
        files.find("palm", "full", mine.folder),
        files.find("hand", "full", mine.folder),
        files.find("hand", "lite", mine.folder),
    )
    return all(found.path is not None for found in networks)


def mask_shape(height: int, width: int) -> tuple[int, int]:
    """(h, w) of the mask for a picture: halved as long as it stays large enough."""
    while min(height, width) // 2 >= MASK_SIDE:
        height, width = height // 2, width // 2
    return height, width


def shrunk(pixels: U8) -> U8:
    """The picture at the size of its masks."""
    height, width = mask_shape(*pixels.shape[:2])
    if (height, width) == pixels.shape[:2]:
        return pixels
    small = cv2.resize(pixels, (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.uint8).reshape(height, width, -1)


def silhouette(hand: HandLandmarks, shape: tuple[int, int], scale: tuple[float, float]) -> Palm:
    """The hand drawn from its landmarks, and its palm's circle; see :func:`outline.draw`."""
    mask = draw(hand, shape, scale)
    x, y = palm_middle(hand)
    radius = PALM_RADIUS * hand.palm_length * (scale[0] + scale[1]) / 2
    at = (
        min(max(round(x * scale[0]), 0), shape[1] - 1),
        min(max(round(y * scale[1]), 0), shape[0] - 1),
    )
    return Palm(mask, *at, max(radius, 1.0), cv2.countNonZero(mask), arm_from(hand))


def agrees(palm: Palm, drawn: Palm, hand: HandLandmarks | None, pixels: U8, small: U8) -> bool:
    """Whether a mask of the hand shows what its landmarks do.

    Args:
        palm: Of the mask, at the size of ``small``.
        drawn: The silhouette of the landmarks, at the same size.
        hand: The landmarks, in pixels of ``pixels``.
        pixels: The picture.
        small: The same at the size of the masks.
    """
    if hand is None or palm.area > LARGER * drawn.area:
        return False
    height, width = small.shape[:2]
    reach = max(1, round(NEAR * drawn.radius))
    grown = cv2.dilate(palm.piece, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))
    scale = np.array([width / pixels.shape[1], height / pixels.shape[0]], np.float32)
    at = np.rint(hand.points[:, :2] * scale).astype(int)
    inside = ((at >= 0) & (at < (width, height))).all(axis=1)
    if not inside.any():
        return False
    covered = grown[at[inside, 1], at[inside, 0]]
    return float(covered.mean()) >= COVERED


def arm_from(hand: HandLandmarks) -> Side:
    """The side of the picture that the arm comes from, seen from the palm."""
    across, down = (hand.points[WRIST] - hand.points[MIDDLE_MCP])[:2]
    if abs(down) >= abs(across):
        return "bottom" if down >= 0 else "top"
    return "right" if across > 0 else "left"
