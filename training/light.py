"""Light and camera: what happens to a hand's colours, and to the whole picture."""

import cv2
import numpy as np
from numpy.typing import NDArray

F32 = NDArray[np.float32]
Rng = np.random.Generator


def field(shape: tuple[int, int], rng: Rng, amount: float, cells: int = 4) -> F32:
    """(h, w) smooth field about 1, of standard deviation ``amount``."""
    coarse = rng.normal(1.0, amount, (cells, cells)).astype(np.float32)
    return np.asarray(cv2.resize(coarse, shape[::-1], interpolation=cv2.INTER_CUBIC), np.float32)


def skin(colour: F32, cover: F32, behind: F32, rng: Rng, *, gentle: bool = False) -> F32:
    """Another skin in another light: gain, gamma, tint and shading of the hand.

    Half of the hands are brought near the brightness of what is behind them, as one light would.
    """
    area = float(cover.sum())
    if area < 20:
        return colour
    mean = float((colour.mean(2) * cover).sum() / area)
    if gentle:
        if rng.random() < 0.5:
            return colour
        gain = np.exp(rng.normal(0, 0.15))
    elif rng.random() < 0.5:
        gain = np.clip(float(behind.mean()) * np.exp(rng.normal(0, 0.35)), 12, 235) / mean
    else:
        gain = np.exp(rng.uniform(np.log(22), np.log(235))) / mean
    tint = np.exp(rng.normal(0, 0.03 if gentle else 0.09, 3)).astype(np.float32)
    # Dark skin is more saturated than a dark picture of light skin (von Luschan's scale).
    depth = rng.uniform(-0.1, 0.2)
    tint = tint * np.exp(np.array([-0.9, -0.25, 0.45], np.float32) * depth)
    gamma = 1.0 if gentle else np.exp(rng.normal(0, 0.15))
    lit = 255 * np.clip(colour * gain / 255, 1e-3, 3) ** gamma
    shading = field(cover.shape, rng, 0.05 if gentle else 0.16)
    mixed = np.clip(lit * tint * shading[:, :, None], 0, 255).astype(np.float32)
    if not gentle:
        return mixed
    weight = cover[:, :, None]
    return np.asarray(colour * (1 - weight) + mixed * weight, np.float32)


def cast_shadow(picture: F32, cover: F32, rng: Rng) -> None:
    """Darken the picture, in place, where the hand's shadow falls."""
    shift = rng.normal(0, 8, 2)
    moved = cv2.warpAffine(cover, np.array([[1, 0, shift[0]], [0, 1, shift[1]]]), cover.shape[::-1])
    soft = cv2.GaussianBlur(moved, (0, 0), rng.uniform(1, 6))
    picture *= 1 - rng.uniform(0.1, 0.6) * soft[:, :, None]


def camera(picture: F32, rng: Rng) -> NDArray[np.uint8]:
    """Exposure, white balance, blur, noise and compression of the whole picture."""
    if rng.random() < 0.5:
        picture = picture * field(picture.shape[:2], rng, 0.12, cells=3)[:, :, None]
    if rng.random() < 0.7:
        gain = np.exp(rng.normal(0, 0.3))
        balance = np.exp(rng.normal(0, 0.08, 3))
        picture = 255 * np.clip(picture / 255 * gain * balance, 0, 1) ** np.exp(rng.normal(0, 0.2))
    if rng.random() < 0.2:
        # Another saturation.
        grey = picture.mean(2, keepdims=True)
        picture = grey + (picture - grey) * rng.uniform(0.2, 1.5)
    if rng.random() < 0.3:
        picture = cv2.GaussianBlur(picture.astype(np.float32), (0, 0), rng.uniform(0.4, 1.8))
    if rng.random() < 0.2:
        length = int(rng.integers(3, 12))
        kernel = np.zeros((length, length), np.float32)
        angle = rng.uniform(0, np.pi)
        reach = length / 2 * np.array([np.cos(angle), np.sin(angle)])
        ends = [tuple(int(v) for v in length / 2 + s * reach) for s in (-1, 1)]
        cv2.line(kernel, ends[0], ends[1], 1.0)
        picture = cv2.filter2D(picture.astype(np.float32), -1, kernel / max(kernel.sum(), 1e-6))
    if rng.random() < 0.5:
        noise = rng.normal(0, rng.uniform(1, 12), picture.shape)
        picture = picture + noise
    out = np.clip(picture + 0.5, 0, 255).astype(np.uint8)
    if rng.random() < 0.06:
        out = cv2.cvtColor(cv2.cvtColor(out, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    if rng.random() < 0.5:
        quality = int(rng.integers(30, 95))
        _, data = cv2.imencode(".jpg", out, [cv2.IMWRITE_JPEG_QUALITY, quality])
        out = cv2.imdecode(data, cv2.IMREAD_COLOR)
    return np.ascontiguousarray(out)
