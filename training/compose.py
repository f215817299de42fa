"""Composed training pictures: hands with a known mask, pasted into rooms, in any light.

Every sample is drawn from one generator, so that the same seed gives the same pictures.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from training import light
from training.clutter import clutter, plain
from training.network import SIDE
from training.photos import U8, Hand

F32 = NDArray[np.float32]
Rng = np.random.Generator


class Sample(NamedTuple):
    """One training picture.

    Attributes:
        picture: (SIDE, SIDE, 3) RGB uint8.
        cover: (SIDE/2, SIDE/2) float32, the part of each pixel that is hand or bare arm.
        weight: (SIDE/2, SIDE/2) float32, 0 where nobody knows.
    """

    picture: U8
    cover: F32
    weight: F32


@dataclass
class Whole:
    """A real picture with a checked mask: BGR, cover, and weight (0 where nobody knows)."""

    colour: U8
    cover: F32
    weight: F32


@dataclass
class Material:
    """What samples are made of."""

    hands: Sequence[Hand]
    drawn: Sequence[Hand]
    rooms: Sequence[U8]
    wholes: Sequence[Whole] = field(default_factory=list)


def sample(material: Material, rng: Rng) -> Sample:
    """One composed or real picture, lit, blurred, compressed."""
    if material.wholes and rng.random() < 0.4:
        picture, cover, weight = _real(material.wholes[rng.integers(len(material.wholes))], rng)
    else:
        picture, cover = _composed(material, rng)
        weight = np.ones_like(cover)
    picture = light.camera(picture, rng)
    half = (SIDE // 2, SIDE // 2)
    return Sample(
        cv2.cvtColor(picture, cv2.COLOR_BGR2RGB),
        cv2.resize(cover, half, interpolation=cv2.INTER_AREA),
        cv2.resize(weight, half, interpolation=cv2.INTER_AREA),
    )


def _composed(material: Material, rng: Rng) -> tuple[F32, F32]:
    if rng.random() < 0.75:
        picture = _room(material.rooms[rng.integers(len(material.rooms))], rng)
    else:
        picture = plain(rng)
    clutter(picture, rng)
    cover = np.zeros((SIDE, SIDE), np.float32)
    hands = rng.choice(3, p=(0.07, 0.86, 0.07))
    for _ in range(hands):
        pool = material.drawn if rng.random() < 0.3 else material.hands
        _paste(pool[rng.integers(len(pool))], picture, cover, two=hands == 2, rng=rng)
    return picture, cover


def _room(room: U8, rng: Rng) -> F32:
    height, width = room.shape[:2]
    side = float(np.exp(rng.uniform(np.log(0.35), 0.0))) * min(height, width)
    aspect = float(np.exp(rng.normal(0, 0.15)))
    w, h = min(width, int(side * aspect)), min(height, int(side / aspect))
    x, y = rng.integers(width - w + 1), rng.integers(height - h + 1)
    part = cv2.resize(room[y : y + h, x : x + w], (SIDE, SIDE), interpolation=cv2.INTER_AREA)
    if rng.random() < 0.5:
        part = part[:, ::-1]
    return part.astype(np.float32)


def _paste(hand: Hand, picture: F32, cover: F32, *, two: bool, rng: Rng) -> None:
    colour, skin, shown = _with_arm(hand, rng)
    _height, _width = hand.cover.shape
    rows, columns = np.nonzero(hand.cover > 0.5)
    top, bottom, left, right = rows.min(), rows.max(), columns.min(), columns.max()
    longest = max(bottom - top, right - left)
    size = float(np.exp(rng.uniform(np.log(0.2), np.log(0.55 if two else 0.95)))) * SIDE
    scale = size / longest
    turn = rng.normal(0, 0.35) if rng.random() < 0.7 else rng.uniform(-np.pi, np.pi)
    stretch, shear = np.exp(rng.normal(0, 0.1)), rng.normal(0, 0.12)
    flip = -1.0 if rng.random() < 0.5 else 1.0
    shape = np.array([[flip * scale * stretch, scale * shear], [0, scale / stretch]])
    c, s = np.cos(turn), np.sin(turn)
    matrix = np.array([[c, -s], [s, c]]) @ shape
    middle = np.array([(left + right) / 2, (top + bottom) / 2])
    slack = max(0.0, (SIDE - 0.8 * size) / 2)
    target = SIDE / 2 + rng.uniform(-slack, slack, 2)
    affine = np.column_stack([matrix, target - matrix @ middle])
    layers = np.dstack([colour, skin, shown])
    if scale < 0.6:
        # A warp samples points: what is shrunk a lot has to be smoothed first.
        layers = cv2.GaussianBlur(layers, (0, 0), 0.4 / scale)
    layers = cv2.warpAffine(layers, affine, (SIDE, SIDE), flags=cv2.INTER_LINEAR)
    skin, shown = layers[:, :, 3], layers[:, :, 4:5]
    colours = layers[:, :, :3] / np.maximum(shown, 1e-3)
    colours = light.skin(colours, skin, picture, rng)
    if rng.random() < 0.3:
        light.cast_shadow(picture, shown[:, :, 0], rng)
    picture *= 1 - shown
    picture += colours * shown
    cover *= 1 - shown[:, :, 0]
    cover += skin


def _with_arm(hand: Hand, rng: Rng) -> tuple[F32, F32, F32]:
    """The hand with a bare forearm and a sleeve below it.

    Returns:
        (h, w, 3) colour times what is shown, (h, w) hand and bare skin, (h, w) all that is shown.
    """
    height, width = hand.cover.shape
    length = 2 * height
    colour = np.zeros((height + length, width, 3), np.float32)
    skin = np.zeros((height + length, width), np.float32)
    skin[:height] = hand.cover
    colour[:height] = hand.colour * hand.cover[:, :, None]
    shown = skin.copy()
    row = hand.cover[-3:].mean(0)
    columns = np.nonzero(row > 0.5)[0]
    if not hand.wrist or len(columns) < 8:
        return colour, skin, shown
    strip = np.nan_to_num(
        (hand.colour[-4:] * hand.cover[-4:, :, None]).sum(0)
        / np.maximum(hand.cover[-4:].sum(0), 0.05)[:, None]
    ).astype(np.float32)
    first, last = columns[0], columns[-1]
    # The arm keeps the shading across the wrist and gets wider along the way.
    bare = int(length * rng.choice([0.0, rng.uniform(0, 0.35), 1.0], p=(0.25, 0.35, 0.4)))
    wider = rng.uniform(0.0, 0.35) * (last - first) / height
    drift = np.float32(rng.normal(0, 0.15))
    shade = 1 + 0.12 * np.cumsum(rng.normal(0, 1, 12)) / 3
    shade = np.interp(np.arange(length), np.linspace(0, length, 12), np.clip(shade, 0.6, 1.3))
    wider = np.float32(wider)
    centre, half = np.float32((first + last) / 2), np.float32((last - first) / 2 + 0.5)
    grid = np.arange(width, dtype=np.float32)
    y = np.arange(length, dtype=np.float32)[:, None]
    offset = grid[None, :] - (centre + drift * y)
    reach = half + wider * y
    arm = np.clip(reach - np.abs(offset) + 0.5, 0, 1)
    source = np.clip(centre + offset * (half - 2) / reach, first + 1, last - 1)
    arm_colour = strip[source.astype(int)] * shade[:, None, None].astype(np.float32)
    is_bare = (np.arange(length) < bare).astype(np.float32)[:, None]
    sleeve_reach = reach * np.float32(rng.uniform(1.0, 1.5))
    sleeve = np.clip(sleeve_reach - np.abs(offset) + 0.5, 0, 1) * (1 - is_bare)
    tone = rng.uniform(10, 245, 3) if rng.random() < 0.6 else np.full(3, rng.uniform(10, 245))
    pitch, slant = np.float32(rng.uniform(2, 12)), np.float32(rng.normal(0, 0.2))
    waves = 1 + np.float32(rng.uniform(0, 0.25)) * np.sin(y / pitch + offset * slant)
    rim = np.clip(1.1 - 0.5 * (offset / sleeve_reach) ** 2, 0.3, 1.1)
    cloth = tone.astype(np.float32) * (waves * rim)[:, :, None]
    below = arm * is_bare
    colour[height:] = arm_colour * below[:, :, None] + cloth * sleeve[:, :, None]
    skin[height:] = below
    shown[height:] = below + sleeve
    return colour, skin, shown


def _real(whole: Whole, rng: Rng) -> tuple[F32, F32, F32]:
    """A real picture turned, scaled and shifted a little; outside of it nobody knows."""
    height, width = whole.cover.shape
    zoom = float(np.exp(rng.uniform(np.log(0.75), np.log(1.6))))
    turn = rng.normal(0, 0.3) if rng.random() < 0.8 else rng.uniform(-np.pi, np.pi)
    c, s = np.cos(turn), np.sin(turn)
    flip = -1.0 if rng.random() < 0.5 else 1.0
    fit = SIDE * zoom / np.array([width, height]) * np.exp(rng.normal(0, 0.08, 2))
    matrix = np.array([[c, -s], [s, c]]) @ np.diag([flip * fit[0], fit[1]])
    rows, columns = np.nonzero(whole.cover > 0.5)
    centre = np.array([width / 2, height / 2])
    if len(rows) and zoom > 1:
        # The hand stays in the picture.
        centre += (1 - 1 / zoom) * (np.array([columns.mean(), rows.mean()]) - centre)
    target = SIDE / 2 + rng.normal(0, 0.06 * SIDE, 2)
    affine = np.column_stack([matrix, target - matrix @ centre])
    size = (SIDE, SIDE)
    colour = cv2.warpAffine(
        whole.colour, affine, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101
    ).astype(np.float32)
    cover = cv2.warpAffine(whole.cover, affine, size)
    weight = cv2.warpAffine(whole.weight, affine, size)
    colour = light.skin(colour, cover, colour, rng, gentle=True)
    return colour, cover, weight
