"""Drawings of the starter gestures, as the page shows how to hold the hand.

A right hand as a webcam sees it, thumb on the right; the page mirrors it like the webcam's picture.
"""

import os
from collections.abc import Iterator
from pathlib import Path

import cv2

from app.gestures.hand.pose import HandPose
from app.gestures.hand.poses import POSES
from app.gestures.hand.render import HandLook, HandView, Image, render_hand

SIZE = (168, 196)
"""Width and height, pixels."""
_VIEW = HandView(length=146.0, centre=(72.0, 110.0))
_LOOK = HandLook(background=(48, 40, 32))
_QUALITY = 60
"""Of WebP: about 1 KB a drawing."""


def drawings(poses: dict[str, HandPose] = POSES) -> Iterator[tuple[str, Image]]:
    """Name and drawing of every pose; BGR uint8, shape (196, 168, 3)."""
    for name, pose in poses.items():
        yield name, render_hand(pose, SIZE, _VIEW, _LOOK)


def write_drawings(folder: Path) -> None:
    """Write ``NAME.webp`` for every starter gesture into a folder that is there, each whole."""
    for name, picture in drawings():
        done, data = cv2.imencode(".webp", picture, [cv2.IMWRITE_WEBP_QUALITY, _QUALITY])
        assert done
        part = folder / f".{name}.part"
        part.write_bytes(data.tobytes())
        os.replace(part, folder / f"{name}.webp")
