"""Silhouettes by gesture, varied as people and cameras vary them, for the shape network.

A silhouette is (h, w) of 0 and 1 with the arm leaving below. Gestures of different sources are
never held against one another: a "five" is one shape, whoever calls it so.
"""

from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from app.gestures.hand import Finger, HandPose, HandView, Thumb, hand_mask, jitter
from app.pipeline.mask import LearnedMask
from app.pipeline.palm import PalmFinder
from app.pipeline.wrist import cut_at, erase_arm
from training.drawn import random_pose
from training.photos import U8, choose, digit_mask

HEIGHT, WIDTH = 40, 30
"""Pixels of a view, as :class:`app.pipeline.views.Views` makes them for smooth features."""
_CANVAS = 140
_MIDDLE = (70.0, 65.0)
Rng = np.random.Generator


class Silhouette(NamedTuple):
    """One hand: its mask, and the gesture it shows, unique within its source."""

    mask: U8
    gesture: str


def by_threshold(data: Path, *, held: bool | None) -> list[Silhouette]:
    """Of the digit photographs, by Otsu's threshold."""
    found = []
    for path in choose(data / "digits", held=held):
        photo = cv2.resize(cv2.imread(str(path)), (100, 100), interpolation=cv2.INTER_AREA)
        mask = digit_mask(photo)
        if mask is not None:
            fine = cv2.resize(255 * mask, (120, 120), interpolation=cv2.INTER_CUBIC) > 127
            found.append(Silhouette(fine.astype(np.uint8), path.parent.name))
    return found


def by_network(folder: Path, *, held: bool | None) -> list[Silhouette]:
    """Of the photographs in a folder, by the network of the mask, as the product sees them."""
    find_palm = PalmFinder()
    found = []
    for path in choose(folder, held=held):
        photo = cv2.imread(str(path))
        scale = 320 / max(photo.shape[:2])
        photo = cv2.resize(photo, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        masked = LearnedMask()(photo)
        palm = find_palm(masked.mask, masked.bounds)
        if not palm.found or palm.arm not in ("bottom", None):
            continue
        # Down to the wrist, so that the arm leaves at the lower edge.
        x, y, width, height = cv2.boundingRect(palm.piece)
        piece = palm.piece[y : y + height, x : x + width] * np.uint8(255)
        scale = 120 / max(width, height)
        small = cv2.resize(piece, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        found.append(Silhouette((small > 127).astype(np.uint8), path.parent.name))
    return found


def from_renderer(gestures: int, each: int, seed: int) -> list[Silhouette]:
    """Drawn hands: all ways to stretch five fingers, then poses at random."""
    rng = np.random.default_rng(seed)
    found = []
    for number in range(gestures):
        pose = _stretched(number) if number < 32 else random_pose(rng)
        for _ in range(each):
            view = HandView(length=85, centre=(60, 55))
            mask = hand_mask(jitter(pose, 0.1, rng), (120, 120), view)
            found.append(Silhouette(mask, str(number)))
    return found


def _stretched(number: int) -> HandPose:
    fingers = []
    for finger, place in enumerate((1.5, 0.4, -0.6, -1.6)):
        up = number >> finger & 1
        bend = 1 - up
        spread = 0.12 * place * (1 if up else 0.2)
        fingers.append(Finger(1.4 * bend + 0.03, 1.75 * bend + 0.03, 0.55 * bend, spread))
    thumb = Thumb(0.95, 0.15, -0.2, -0.1) if number & 16 else Thumb(0.6, 0.6, 0.95, 0.8)
    return HandPose(*fingers, thumb)


class Vary:
    """One silhouette to many: turn, stretch, shear, fingers' spread, wrist cut, ragged rims."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self._find_palm = PalmFinder()

    def __call__(self, mask: U8) -> U8:
        """(HEIGHT, WIDTH) of 0 and 1."""
        rng = self._rng
        for _ in range(5):
            palm = self._find_palm(self._warped(mask))
            if not palm.found:
                continue
            hand = palm.piece
            if palm.arm is not None:
                side = "bottom" if rng.random() < 0.9 else palm.arm
                erase_arm(hand, cut_at(palm._replace(arm=side), rng.uniform(0.9, 1.8)))
            if rng.random() < 0.6:
                turn = cv2.getRotationMatrix2D(_MIDDLE, rng.uniform(-17, 17), 1)
                hand = cv2.warpAffine(hand, turn, (_CANVAS, _CANVAS), flags=cv2.INTER_NEAREST)
            x, y, width, height = cv2.boundingRect(hand)
            if min(width, height) >= 3:
                box = hand[y : y + height, x : x + width] * np.uint8(255)
                small = cv2.resize(box, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
                return (small > 127).astype(np.uint8)
        raise ValueError("a silhouette without a palm")

    def _warped(self, mask: U8) -> U8:
        rng = self._rng
        height, width = mask.shape
        turn = rng.normal(0, 0.25)
        scale = 100 / max(height, width) * np.exp(rng.normal(0, 0.1))
        stretch, shear = np.exp(rng.normal(0, 0.1)), rng.normal(0, 0.12)
        c, s = np.cos(turn), np.sin(turn)
        shape = np.array([[scale * stretch, scale * shear], [0, scale / stretch]])
        matrix = np.array([[c, -s], [s, c]]) @ shape
        shift = np.array(_MIDDLE) - matrix @ np.array([width / 2, height / 2])
        back = cv2.invertAffineTransform(np.column_stack([matrix, shift])).astype(np.float32)
        size = (_CANVAS, _CANVAS)
        # A smooth field of small shifts moves fingers against one another.
        coarse = rng.normal(0, 3.0, (2, 5, 5)).astype(np.float32)
        y, x = np.mgrid[0:_CANVAS, 0:_CANVAS].astype(np.float32)
        x += cv2.resize(coarse[0], size, interpolation=cv2.INTER_CUBIC)
        y += cv2.resize(coarse[1], size, interpolation=cv2.INTER_CUBIC)
        from_x = back[0, 0] * x + back[0, 1] * y + back[0, 2]
        # What would lie below the silhouette is more of its arm.
        from_y = np.minimum(back[1, 0] * x + back[1, 1] * y + back[1, 2], height - 1.01)
        soft = cv2.remap(mask * np.float32(255), from_x, from_y, cv2.INTER_LINEAR)
        soft = cv2.GaussianBlur(soft, (0, 0), float(np.exp(rng.uniform(np.log(0.6), np.log(2.2)))))
        ragged = rng.normal(0, rng.uniform(0, 40), (28, 28)).astype(np.float32)
        soft += cv2.resize(ragged, size, interpolation=cv2.INTER_CUBIC)
        return (soft > rng.uniform(90, 165)).astype(np.uint8)
