"""Seen: what was found in a photograph, for whoever wants to know what would be enrolled."""

from typing import NamedTuple

import numpy as np

from app.pipeline.hand_landmarks.fingers import FINGERS, stretched
from app.pipeline.hand_landmarks.photo import PhotoHand
from app.pipeline.types import Box

SURE_SIDE = 0.8
"""Probability from which a hand is said to be a right or a left one."""


class SeenHand(NamedTuple):
    """What a photograph shows. JSON-compatible by :meth:`as_json`.

    Attributes:
        size: Width and height of the photograph as it is shown, pixels.
        points: 21 of (x, y) in pixels of it, some of which may be outside of it; None where no
            landmarks were found, or are not looked for.
        right: Probability, 0 to 1, that it is a right hand; None likewise.
        stretched: See :func:`~app.pipeline.hand_landmarks.fingers.stretched`; None likewise.
        agrees: Whether the mask holds what the landmarks show; where it does not, their outline
            has taken its place. None without landmarks, or without a mask.
        region: The hand without its arm, in pixels of the photograph; None without a hand.
    """

    size: tuple[int, int]
    points: tuple[tuple[float, float], ...] | None = None
    right: float | None = None
    stretched: tuple[bool | None, ...] | None = None
    agrees: bool | None = None
    region: Box | None = None

    def as_json(self) -> dict[str, object]:
        """As docs/protocol.md has it: at most some 700 bytes."""
        hand = None
        if self.right is not None:
            side = "right" if self.right >= SURE_SIDE else "left"
            known = self.right >= SURE_SIDE or self.right <= 1 - SURE_SIDE
            hand = {"hand": side if known else None, "right": round(self.right, 3)}
        return {
            "size": list(self.size),
            "landmarks": None if self.points is None else [list(point) for point in self.points],
            "handedness": hand,
            "fingers": None
            if self.stretched is None
            else dict(zip(FINGERS, self.stretched, strict=True)),
            "mask_agrees": self.agrees,
            "region": None if self.region is None else list(self.region),
        }


def seen_by_landmarks(
    found: PhotoHand, scale: tuple[float, float], size: tuple[int, int], agrees: bool | None
) -> SeenHand:
    """What landmarks show.

    Args:
        found: In pixels of the picture that was looked at.
        scale: Of the photograph's pixels to these, across and down.
        size: Of the photograph.
        agrees: As in :class:`SeenHand`.
    """
    points = found.hand.points[:, :2] * np.array(scale, np.float32)
    left, top = np.clip(points.min(axis=0), 0, size)
    right, bottom = np.clip(points.max(axis=0), 0, size)
    box = (round(left), round(top), round(right - left), round(bottom - top))
    return SeenHand(
        size,
        tuple((round(float(x), 1), round(float(y), 1)) for x, y in points),
        found.shape.right,
        stretched(found.shape),
        agrees,
        box if box[2] and box[3] else None,
    )
