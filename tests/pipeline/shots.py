"""Drawn photographs of hands, good and bad, for the tests of enrolment."""

import cv2
import numpy as np
import simplejpeg

from app.gestures.hand import POSES, HandView, render_hand


def hand(gesture: str = "stop", length: float = 270.0, center=(320.0, 240.0), **kw):
    """(480, 640, 3) BGR picture of a hand, its arm from below."""
    return render_hand(POSES[gesture], view=HandView(length, center, **kw))


def jpeg(picture) -> bytes:
    picture = np.ascontiguousarray(picture, np.uint8)
    return simplejpeg.encode_jpeg(picture, quality=90, colorspace="BGR")


def shaken(picture, pixels: int, degrees: float = 0.0):
    """The picture with the blur of a movement."""
    kernel = np.zeros((pixels, pixels), np.float32)
    kernel[pixels // 2] = 1 / pixels
    turn = cv2.getRotationMatrix2D((pixels / 2 - 0.5, pixels / 2 - 0.5), degrees, 1.0)
    kernel = cv2.warpAffine(kernel, turn, (pixels, pixels))
    return cv2.filter2D(picture, -1, kernel / kernel.sum())


def two_hands():
    """Two hands side by side."""
    left, right = hand("stop", 200.0, (180.0, 240.0)), hand("up", 200.0, (460.0, 240.0))
    return np.hstack([left[:, :320], right[:, 320:]])


def noisy(picture, seed: int, amount: float = 2.0):
    """The picture with the noise of a sensor."""
    noise = np.random.default_rng(seed).normal(0.0, amount, picture.shape)
    return np.clip(picture + noise, 0, 255).astype(np.uint8)
