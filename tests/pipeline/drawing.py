"""Simple drawn hands: polygons on a plain background, the arm from any side."""

from pathlib import Path

import cv2
import numpy as np
import simplejpeg

from app.config import PipelineSettings
from app.pipeline import Gallery, PcaMatcher, extract_template

PHOTOS = Path(__file__).resolve().parents[2].parent / "shared" / "data"
# Polygons of one colour are no hands to the network, so they take the threshold's way.
SETTINGS = PipelineSettings.model_validate({"binarise": {"mode": "threshold"}})
SKIN = (120, 150, 210)
WALL = (190, 190, 190)
SHAPES = {"fist": (), "one": (0,), "two": (-20, 20), "five": (-70, -25, 0, 25, 50)}
TURNS = {
    "bottom": None,
    "left": cv2.ROTATE_90_CLOCKWISE,
    "top": cv2.ROTATE_180,
    "right": cv2.ROTATE_90_COUNTERCLOCKWISE,
}


def draw_mask(shape: str, size=(640, 480), side="bottom", shift=(0, 0), scale=1.0):
    """Mask of a hand whose arm enters at ``side``; ``size`` is (width, height)."""
    width, height = size if side in ("bottom", "top") else size[::-1]
    mask = np.zeros((height, width), np.uint8)
    unit = min(width, height) / 480 * scale
    cx, cy = width / 2 + shift[0], height * 0.55 + shift[1]
    cv2.circle(mask, (round(cx), round(cy)), round(70 * unit), 1, -1)
    arm = [(cx - 40 * unit, cy), (cx + 40 * unit, cy), (cx + 55 * unit, height)]
    arm.append((cx - 55 * unit, height))
    cv2.fillPoly(mask, [np.round(arm).astype(np.int32)], 1)
    for angle in SHAPES[shape]:
        a = np.radians(angle)
        tip = cx + 165 * unit * np.sin(a), cy - 165 * unit * np.cos(a)
        ends = (round(cx), round(cy)), (round(tip[0]), round(tip[1]))
        cv2.line(mask, *ends, 1, round(32 * unit))
    turn = TURNS[side]
    return mask if turn is None else np.ascontiguousarray(cv2.rotate(mask, turn))


def draw(shape: str, hand=SKIN, wall=WALL, noise=2.0, **kw):
    """(h, w, 3) BGR picture of a drawn hand."""
    mask = draw_mask(shape, **kw)
    picture = np.where(mask[..., None] == 1, np.float32(hand), np.float32(wall))
    picture += np.random.default_rng(1).normal(0, noise, picture.shape)
    return picture.clip(0, 255).astype(np.uint8)


def jpeg(picture, quality=85) -> bytes:
    return simplejpeg.encode_jpeg(
        np.ascontiguousarray(picture), quality, "BGR", colorsubsampling="420"
    )


def encoded(picture, suffix=".png", *flags) -> bytes:
    return cv2.imencode(suffix, picture, list(flags))[1].tobytes()


def gallery(shapes=tuple(SHAPES), settings=None, **kw) -> Gallery:
    settings = settings or SETTINGS
    made = [extract_template(jpeg(draw(shape, **kw)), settings).template for shape in shapes]
    return Gallery(tuple(shapes), np.stack(made))


def matcher(shapes=tuple(SHAPES), settings=None) -> PcaMatcher:
    settings = settings or SETTINGS
    return PcaMatcher.fit(gallery(shapes, settings), settings.match)
