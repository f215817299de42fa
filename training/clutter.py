"""What else is in a picture: plain walls, drawn faces, skin-coloured things, furniture."""

import cv2
import numpy as np
from numpy.typing import NDArray

from training.light import field
from training.network import SIDE

F32 = NDArray[np.float32]
Rng = np.random.Generator


def plain(rng: Rng) -> F32:
    """A wall or a table: one or two colours, a gradient, perhaps stripes."""
    ends = rng.uniform(5, 250, (2, 3))
    if rng.random() < 0.5:
        ends[1] = ends[0] * rng.uniform(0.6, 1.3)
    if rng.random() < 0.4:
        ends = np.repeat(ends.mean(1, keepdims=True), 3, 1) + rng.normal(0, 6, (2, 3))
    angle = rng.uniform(0, 2 * np.pi)
    y, x = np.mgrid[-1 : 1 : SIDE * 1j, -1 : 1 : SIDE * 1j]
    share = np.clip(0.5 + 0.5 * (x * np.cos(angle) + y * np.sin(angle)), 0, 1)
    if rng.random() < 0.25:
        share = 0.5 + 0.5 * np.sign(np.sin(rng.uniform(3, 25) * share + rng.uniform(0, 6)))
    picture = ends[0] + (ends[1] - ends[0]) * share[:, :, None]
    return np.asarray(
        np.clip(picture, 0, 255) * field((SIDE, SIDE), rng, 0.06)[:, :, None], np.float32
    )


def skin_tone(rng: Rng) -> NDArray[np.float64]:
    """A BGR colour between very light and very dark skin."""
    ends = np.array([[190, 205, 240], [105, 150, 205], [35, 55, 95]], float)
    at = rng.uniform(0, 2)
    low = min(int(at), 1)
    tone = ends[low] + (at - low) * (ends[low + 1] - ends[low])
    return np.asarray(np.clip(tone * rng.normal(1, 0.08, 3), 5, 255))


def clutter(picture: F32, rng: Rng) -> None:
    """Draw things that are no hands, in place."""
    if rng.random() < 0.3:
        for _ in range(rng.integers(1, 5)):
            _thing(picture, rng)
    if rng.random() < 0.3:
        _face(picture, rng)


def _thing(picture: F32, rng: Rng) -> None:
    colour = skin_tone(rng) if rng.random() < 0.5 else rng.uniform(0, 255, 3)
    cover = np.zeros((SIDE, SIDE), np.float32)
    x, y = (int(v) for v in rng.integers(0, SIDE, 2))
    a, b = (int(v) for v in rng.integers(4, SIDE // 2, 2))
    kind = rng.random()
    if kind < 0.4:
        cv2.rectangle(cover, (x - a // 2, y - b // 2), (x + a // 2, y + b // 2), 1.0, -1)
    elif kind < 0.7:
        cv2.ellipse(cover, (x, y), (a // 2, b // 2), float(rng.uniform(0, 180)), 0, 360, 1.0, -1)
    else:
        # A long thin thing: a pen, a cable, an edge.
        end = (x + int(rng.normal(0, SIDE / 2)), y + int(rng.normal(0, SIDE / 2)))
        cv2.line(cover, (x, y), end, 1.0, int(rng.integers(1, 14)))
    cover = cv2.GaussianBlur(cover, (0, 0), 0.7)[:, :, None]
    shade = field((SIDE, SIDE), rng, 0.12)[:, :, None]
    picture *= 1 - cover
    picture += np.clip(colour * shade, 0, 255).astype(np.float32) * cover


def _face(picture: F32, rng: Rng) -> None:
    """A head with neck, hair, eyes, brows, nose and mouth; a shirt below."""
    tone = skin_tone(rng)
    size = float(np.exp(rng.uniform(np.log(12), np.log(60))))
    x, y = rng.uniform(0, SIDE), rng.uniform(0, SIDE * 0.8)
    layer = np.zeros((SIDE, SIDE, 4), np.float32)

    def blob(dx: float, dy: float, w: float, h: float, colour: NDArray[np.float64]) -> None:
        centre = (int(x + dx * size), int(y + dy * size))
        axes = (max(1, int(w * size)), max(1, int(h * size)))
        bgra = (*(float(c) for c in colour), 255.0)
        cv2.ellipse(layer, centre, axes, float(rng.normal(0, 4)), 0, 360, bgra, -1)

    hair = rng.uniform(5, 90, 3) if rng.random() < 0.8 else rng.uniform(90, 220, 3)
    shirt = rng.uniform(0, 255, 3)
    if rng.random() < 0.7:
        blob(0, 2.3, rng.uniform(1.4, 2.2), 1.1, shirt)
    blob(0, 1.1, 0.4, 0.6, tone * 0.85)
    blob(0, -0.25, 0.85, rng.uniform(0.95, 1.2), hair)
    blob(0, 0, 0.72, 1.0, tone)
    for side in (-1, 1):
        blob(side * 0.3, -0.15, 0.12, 0.06, tone * 0.35 + 20)
        blob(side * 0.3, -0.32, 0.17, 0.04, hair)
    blob(0, 0.15, 0.1, 0.16, tone * 0.88)
    blob(0, 0.5, 0.26, rng.uniform(0.04, 0.12), tone * np.array([0.7, 0.6, 0.85]))
    if rng.random() < 0.2:
        blob(0, 0.65, 0.5, 0.35, hair)
    layer = cv2.GaussianBlur(layer, (0, 0), max(0.5, size / 30))
    cover = layer[:, :, 3:] / 255
    shade = field((SIDE, SIDE), rng, 0.15)[:, :, None]
    picture *= 1 - cover
    picture += np.clip(layer[:, :, :3] * shade, 0, 255)
