"""Pictures of a hand: pose, view and look in, pixels out."""

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from app.gestures.hand.pose import HandPose
from app.gestures.hand.raster import Frame, crop, rasterise
from app.gestures.hand.skeleton import pose_skeleton
from app.gestures.hand.skin import TONES, paint

Image = NDArray[np.uint8]
FINE = 2
"""Drawn this many times finer, then averaged."""


@dataclass(frozen=True, slots=True)
class HandView:
    """Where the hand is in the picture, and how large."""

    length: float = 250.0
    """Wrist to the tip of a straight middle finger, pixels."""
    centre: tuple[float, float] | None = None
    """Where the middle of the hand's length is: column, row. None: so that the hand is centred."""
    turn: float = 0.0
    """rad, clockwise in the picture, about that middle; 0 has the arm coming from below."""
    left: bool = False
    """A left hand: the mirror image. Both show the palm."""


@dataclass(frozen=True, slots=True)
class HandLook:
    """Colours, light and the camera's faults."""

    skin: tuple[int, int, int] = TONES["medium"]
    """BGR in full light."""
    light: tuple[float, float, float] = (-0.45, -0.55, 0.9)
    """Direction to the light: right, down, towards the eye."""
    background: tuple[int, int, int] = (208, 203, 196)
    """BGR at the top of the picture."""
    background_below: tuple[int, int, int] | None = None
    """BGR at the bottom; None: the same as at the top."""
    gradient: float = 0.0
    """How much darker the whole picture is at its right edge than at its left, 0 to 1."""
    blur: float = 0.0
    """Standard deviation of the lens's blur, pixels."""
    noise: float = 0.0
    """Standard deviation of the sensor's noise, grey levels."""


class HandSprite(NamedTuple):
    """A hand without a background."""

    colour: NDArray[np.float32]
    """BGR times cover, 0 to 255, shape (height, width, 3)."""
    cover: NDArray[np.float32]
    """How much of each pixel the hand covers, 0 to 1, shape (height, width)."""


def render_sprite(
    pose: HandPose, size: tuple[int, int], view: HandView, look: HandLook, fine: int = FINE
) -> HandSprite:
    """Draw a hand alone.

    Args:
        pose: Joint angles.
        size: Width and height in pixels.
        view: Where and how large.
        look: Skin and light are used.
        fine: Drawn this many times finer.
    """
    skeleton = pose_skeleton(pose)
    # Only the part of the picture that holds the hand is worked on.
    frame, (top, left) = crop(skeleton.cones, _frame(size, view, fine), fine)
    relief = rasterise(skeleton.cones, frame)
    colour = paint(skeleton, relief, frame, look.skin, look.light)
    cover = np.clip(0.5 - relief.distance / np.float32(frame.pixel), 0.0, 1.0)
    colour *= cover[..., None]
    top, left, height, width = (n // fine for n in (top, left, *frame.shape))
    if fine > 1:
        colour = _smaller(colour, (width, height))
        cover = _smaller(cover, (width, height))
    whole = HandSprite(
        np.zeros((size[1], size[0], 3), np.float32), np.zeros((size[1], size[0]), np.float32)
    )
    window = slice(top, top + height), slice(left, left + width)
    whole.colour[window], whole.cover[window] = colour, cover
    return whole


def render_hand(
    pose: HandPose,
    size: tuple[int, int] = (640, 480),
    view: HandView | None = None,
    look: HandLook | None = None,
    seed: int = 0,
) -> Image:
    """Draw a hand before a plain background.

    Args:
        pose: Joint angles.
        size: Width and height in pixels.
        view: Where and how large.
        look: Colours, light, blur and noise.
        seed: Of the noise; the same arguments give the same picture.

    Returns:
        BGR, uint8, shape (height, width, 3).
    """
    view, look = view or HandView(), look or HandLook()
    sprite = render_sprite(pose, size, view, look)
    picture = compose(sprite, backdrop(size, look))
    picture = through_lens(picture, look)
    if look.noise:
        noise = np.random.default_rng(seed).normal(0.0, look.noise, picture.shape)
        picture = picture + noise.astype(np.float32)
    return to_bytes(picture)


def hand_mask(
    pose: HandPose, size: tuple[int, int] = (640, 480), view: HandView | None = None
) -> Image:
    """Where the hand is: 1 for pixels that it covers by half or more, else 0.

    Returns:
        uint8, shape (height, width).
    """
    sprite = render_sprite(pose, size, view or HandView(), HandLook())
    return (sprite.cover >= 0.5).astype(np.uint8)


def backdrop(size: tuple[int, int], look: HandLook) -> NDArray[np.float32]:
    """The background alone, BGR, 0 to 255."""
    width, height = size
    top = np.array(look.background, np.float32)
    below = np.array(look.background_below or look.background, np.float32)
    share = np.linspace(0.0, 1.0, height, dtype=np.float32)[:, None, None]
    return np.repeat(top + share * (below - top), width, axis=1)


def compose(sprite: HandSprite, background: NDArray[np.float32]) -> NDArray[np.float32]:
    """The hand before a background, BGR, 0 to 255."""
    return sprite.colour + background * (1.0 - sprite.cover)[..., None]


def through_lens(plane: NDArray[np.float32], look: HandLook) -> NDArray[np.float32]:
    """Uneven light and blur, of a picture or of a sprite's planes (a cover only blurs).

    Both are linear, so that a sprite and its background may pass the lens one by one.
    """
    if look.gradient and plane.ndim == 3:
        fall = np.linspace(1.0, 1.0 - look.gradient, plane.shape[1], dtype=np.float32)
        plane = plane * fall[None, :, None]
    if look.blur:
        plane = np.asarray(cv2.GaussianBlur(plane, (0, 0), look.blur), np.float32)
    return plane


def to_bytes(picture: NDArray[np.float32]) -> Image:
    """Eight bits a channel, rounded."""
    return np.asarray(np.clip(picture + 0.5, 0, 255), np.uint8)


def _smaller(plane: NDArray[np.float32], size: tuple[int, int]) -> NDArray[np.float32]:
    return np.asarray(cv2.resize(plane, size, interpolation=cv2.INTER_AREA), np.float32)


def _frame(size: tuple[int, int], view: HandView, fine: int) -> Frame:
    """Pixels (fine ones) to hand: undo the shift, the turn, the mirror and the scale."""
    width, height = size
    column, row = view.centre or (width / 2, height / 2)
    scale = view.length * fine
    cos, sin = np.cos(view.turn), np.sin(view.turn)
    flip = -1.0 if view.left else 1.0
    # x_hand = flip (cos u + sin v) / s, y_hand = 1/2 - (-sin u + cos v) / s, u and v from centre
    u0, v0 = fine * column - 0.5, fine * row - 0.5
    linear = np.array([[flip * cos, flip * sin], [sin, -cos]]) / scale
    shift = np.array([0.0, 0.5]) - linear @ np.array([u0, v0])
    return Frame(np.column_stack([linear, shift]), (height * fine, width * fine), 1.0 / scale)
