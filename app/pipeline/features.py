"""Features: a silhouette as a vector that principal component analysis can work on."""

import math

import cv2
import numpy as np

from app.config import MatchSettings
from app.pipeline.network import load
from app.pipeline.template import WIDTH
from app.pipeline.types import F32, U8

SQUASH = 9 / WIDTH
"""Widths of the view. Distances beyond it hardly count; 4/60 to 9/60 measured the same."""


SHAPE_MODEL = "hand_shape.onnx"


class Features:
    """(v, h, w) views of 0 and 1 to (v, d) float32.

    ``shape``: the ``distance`` features, and beside them 48 numbers that a small network makes of
    the same (training/MODEL_CARD.md), close for one gesture whoever shows it. They have length
    ``w sqrt(h w)``, so that squared distances, divided by ``h w``, are the sum of the mean square
    difference of the outlines and ``w^2`` times the squared distance of the numbers.

    ``distance``: ``tanh((d_in - d_out) / s)``, where ``d_in`` and ``d_out`` are the Euclidean
    distances to the background and to the hand. An outline that is off by a pixel changes it a
    little everywhere near, where the pixels themselves flip.

    ``binary``: ``2 p - 1``, the pixels themselves (paper).
    """

    def __init__(self, settings: MatchSettings) -> None:
        self._settings = settings
        self._binary = settings.features == "binary"
        self._shape = load(SHAPE_MODEL) if settings.features == "shape" else None
        self._weight = settings.shape_weight

    def __reduce__(self) -> tuple[type["Features"], tuple[MatchSettings]]:
        """To another process without the network, which each process loads for itself."""
        return Features, (self._settings,)

    def __call__(self, views: U8) -> F32:
        """Returns (v, d), a new array; d is h*w, and 48 more with ``shape``."""
        if self._binary:
            return (views.reshape(len(views), -1).astype(np.float32) * 2) - 1
        out = np.empty(views.shape, np.float32)
        outside = np.empty(views.shape, np.float32)
        for view, rest, row, far in zip(views, views ^ 1, out, outside, strict=True):
            cv2.distanceTransform(view, cv2.DIST_L2, 3, dst=row)
            cv2.distanceTransform(rest, cv2.DIST_L2, 3, dst=far)
        out -= outside
        out *= 1 / (SQUASH * views.shape[2])
        np.tanh(out, out=out)
        rows = out.reshape(len(views), -1)
        if self._shape is None:
            return rows
        numbers: F32 = self._shape.run(None, {"input": out[:, None]})[0]
        numbers *= self._weight * math.sqrt(rows.shape[1])
        return np.concatenate([rows, numbers], axis=1)
