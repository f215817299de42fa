"""Features: a silhouette as a vector that principal component analysis can work on."""

import cv2
import numpy as np

from app.config import MatchSettings
from app.pipeline.template import WIDTH
from app.pipeline.types import F32, U8

SQUASH = 9 / WIDTH
"""Widths of the view. Distances beyond it hardly count; 4/60 to 9/60 measured the same."""


class Features:
    """(v, h, w) views of 0 and 1 to (v, h*w) float32 in [-1, 1].

    ``distance``: ``tanh((d_in - d_out) / s)``, where ``d_in`` and ``d_out`` are the Euclidean
    distances to the background and to the hand. An outline that is off by a pixel changes it a
    little everywhere near, where the pixels themselves flip.

    ``binary``: ``2 p - 1``, the pixels themselves (paper).
    """

    def __init__(self, settings: MatchSettings) -> None:
        self._distance = settings.features == "distance"

    def __call__(self, views: U8) -> F32:
        """Returns (v, h*w), a new array."""
        if not self._distance:
            return (views.reshape(len(views), -1).astype(np.float32) * 2) - 1
        out = np.empty(views.shape, np.float32)
        outside = np.empty(views.shape, np.float32)
        for view, rest, row, far in zip(views, views ^ 1, out, outside, strict=True):
            cv2.distanceTransform(view, cv2.DIST_L2, 3, dst=row)
            cv2.distanceTransform(rest, cv2.DIST_L2, 3, dst=far)
        out -= outside
        out *= 1 / (SQUASH * views.shape[2])
        np.tanh(out, out=out)
        return out.reshape(len(views), -1)
