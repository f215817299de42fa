"""Landmarker: 21 landmarks of the hand in a region, by MediaPipe's hand landmark network."""

import math
from pathlib import Path

import numpy as np

from app.pipeline.hand_landmarks.region import as_seen, to_picture
from app.pipeline.hand_landmarks.runtime import Network
from app.pipeline.hand_landmarks.types import POINTS, HandLandmarks, Region
from app.pipeline.types import F32, U8

SIZE = 224
"""Pixels. Side of the square that the network looks at."""
DEPTH = 0.4
"""The network's depth is so many times that of a camera without perspective (``normalize_z`` of
MediaPipe's graph)."""


class Landmarker:
    """A picture and a region to a hand, whether there is one or not: its presence says."""

    def __init__(self, model: Path) -> None:
        self._network = Network(model)
        self._rgb: U8 = np.zeros((SIZE, SIZE, 3), np.uint8)
        self._input: F32 = np.zeros((SIZE, SIZE, 3), np.float32)

    def __call__(self, pixels: U8, region: Region) -> HandLandmarks:
        """Look at a region of a (h, w, 3) BGR or (h, w, 1) grey picture."""
        as_seen(pixels, region, self._rgb)
        np.multiply(self._rgb, np.float32(1 / 255), out=self._input)
        flat, presence, right, world = self._network(self._input)
        seen = flat.reshape(POINTS, 3)
        matrix = to_picture(region, SIZE)
        points = np.empty((POINTS, 3), np.float32)
        points[:, :2] = seen[:, :2] @ matrix[:, :2].T + matrix[:, 2]
        points[:, 2] = seen[:, 2] * (region.side / SIZE / DEPTH)
        metres = world.reshape(POINTS, 3)
        cosine, sine = math.cos(region.turn), math.sin(region.turn)
        turned = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]], np.float32)
        # MediaPipe calls this number "left", because it takes pictures to be mirrored.
        return HandLandmarks(points, metres @ turned, float(presence[0]), float(right[0]), region)
