"""A parametric hand: anatomy, pose, skeleton, raster, skin, picture."""

from app.gestures.hand.pose import Finger, HandPose, Thumb, blend, jitter
from app.gestures.hand.poses import POSES, RELAXED
from app.gestures.hand.render import (
    HandLook,
    HandSprite,
    HandView,
    hand_mask,
    render_hand,
    render_sprite,
)
from app.gestures.hand.skin import TONES

__all__ = [
    "POSES",
    "RELAXED",
    "TONES",
    "Finger",
    "HandLook",
    "HandPose",
    "HandSprite",
    "HandView",
    "Thumb",
    "blend",
    "hand_mask",
    "jitter",
    "render_hand",
    "render_sprite",
]
