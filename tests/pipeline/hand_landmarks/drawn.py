"""Drawn hands for the networks: they find every starter pose, before a wall and in a room."""

import cv2
import numpy as np

from app.gestures.hand.poses import POSES
from app.gestures.hand.render import HandLook, HandView, compose, render_hand, render_sprite
from app.pipeline.types import U8

SIZE = (640, 480)


def plain(pose: str = "stop", *, turn: float = 0.0, length: float = 270.0) -> U8:
    """A hand before a plain wall, 640x480 BGR."""
    return render_hand(POSES[pose], view=HandView(length, turn=turn))


def in_room(pose: str = "stop", at: tuple[int, int] = (300, 260), length: float = 280.0) -> U8:
    """A hand before patches of many colours, 640x480 BGR."""
    sprite = render_sprite(POSES[pose], SIZE, HandView(length, at), HandLook())
    return compose(sprite, room().astype(np.float32)).clip(0, 255).astype(np.uint8)


def room(seed: int = 3) -> U8:
    """The patches alone."""
    patches = np.random.default_rng(seed).uniform(40, 220, (6, 8, 3))
    return cv2.resize(np.kron(patches, np.ones((40, 40, 1))), SIZE).astype(np.uint8)


def two_in_room() -> U8:
    """Two hands beside each other."""
    left = in_room("stop", (170, 260), 230.0)
    right = in_room("stop", (470, 260), 230.0)
    return np.hstack([left[:, :320], right[:, 320:]])
