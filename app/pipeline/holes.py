"""Holes: dark creases and gaps between bent fingers that a threshold takes for background."""

import cv2

from app.pipeline.types import U8

MOST_HOLES = 100
"""A mask with more is noise, and filling them would only take time."""


def fill_holes(mask: U8, largest: float) -> None:
    """Fill, in place, every hole smaller than ``largest`` parts of the mask's white pixels.

    A hole of a few pixels changes the signed distances (``features.py``) of the whole middle of a
    hand, and the palm's circle. The ring of a thumb that meets a finger is some 5% of hand and
    forearm and stays.

    Args:
        mask: (h, w), 0 or 1.
        largest: 0 fills none.
    """
    if largest <= 0:
        return
    outlines, tree = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    if tree is None:
        return
    # With RETR_CCOMP an outline that has a parent (column 3) is that of a hole.
    parents = tree[0, :, 3].tolist()
    holes = [outline for outline, parent in zip(outlines, parents, strict=True) if parent >= 0]
    if not holes or len(holes) > MOST_HOLES:
        return
    limit = largest * cv2.countNonZero(mask)
    small = [hole for hole in holes if cv2.contourArea(hole) < limit]
    cv2.drawContours(mask, small, -1, 1, cv2.FILLED)
