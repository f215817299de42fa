"""Palms: where in a picture palms are, by MediaPipe's palm detector.

A single-shot detector (W. Liu et al., "SSD", ECCV 2016): for each of 2,016 anchors a score, a box
and seven points of the palm. Anchors, decoding and the merging of overlapping boxes are those of
MediaPipe's published graph ``palm_detection_cpu`` (Apache-2.0).
"""

from pathlib import Path

import cv2
import numpy as np

from app.pipeline.hand_landmarks.runtime import Network
from app.pipeline.hand_landmarks.types import PalmDetection
from app.pipeline.types import F32, U8

SIZE = 192
"""Pixels. Side of the square that the network looks at."""
STRIDES = (8, 16, 16, 16)
"""Pixels between anchors, one a layer; each layer has two anchors at each place."""
CLIP = 100.0
"""Largest score, either way, before the sigmoid."""
OVERLAP = 0.3
"""Intersection over union from which two boxes are of one palm."""


def anchors() -> F32:
    """(2016, 2) centres of the anchors in parts of the square; each is as large as all of it."""
    centres = []
    layer = 0
    while layer < len(STRIDES):
        same = layer
        while same < len(STRIDES) and STRIDES[same] == STRIDES[layer]:
            same += 1
        cells = SIZE // STRIDES[layer]
        places = (np.arange(cells, dtype=np.float32) + 0.5) / cells
        grid = np.stack(np.meshgrid(places, places), axis=-1).reshape(-1, 2)
        centres.append(np.repeat(grid, 2 * (same - layer), axis=0))
        layer = same
    return np.concatenate(centres)


class PalmDetector:
    """(h, w, 3) BGR or (h, w, 1) grey to palms, the surest first."""

    def __init__(self, model: Path) -> None:
        self._network = Network(model)
        self._anchors = anchors()
        self._square: U8 = np.zeros((SIZE, SIZE, 3), np.uint8)
        self._input: F32 = np.zeros((SIZE, SIZE, 3), np.float32)

    def __call__(self, pixels: U8, least: float) -> list[PalmDetection]:
        """Find the palms with a score of at least ``least``."""
        height, width = pixels.shape[:2]
        scale = SIZE / max(height, width)
        w, h = max(1, round(width * scale)), max(1, round(height * scale))
        left, top = (SIZE - w) // 2, (SIZE - h) // 2
        small = cv2.resize(
            pixels, (w, h), interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
        )
        self._square.fill(0)
        code = cv2.COLOR_GRAY2RGB if small.ndim == 2 else cv2.COLOR_BGR2RGB
        cv2.cvtColor(small, code, dst=self._square[top : top + h, left : left + w])
        np.multiply(self._square, np.float32(1 / 255), out=self._input)
        raw, logits = self._network(self._input)
        scores: F32 = 1 / (1 + np.exp(-np.clip(logits[:, 0], -CLIP, CLIP)))
        sure = np.flatnonzero(scores >= least)
        if not len(sure):
            return []
        boxes, points = self._decode(raw[sure], sure)
        merged, sevens = merge(boxes, points, scores[sure], OVERLAP)
        shift, back = np.array([left, top], np.float32), np.float32(1 / scale)
        corners = (merged[:, :4] - np.tile(shift, 2)) * back
        sevens = (sevens - shift) * back
        return [
            PalmDetection(box, seven, float(score))
            for box, seven, score in zip(corners, sevens, merged[:, 4], strict=True)
        ]

    def _decode(self, raw: F32, which: np.ndarray) -> tuple[F32, F32]:
        """Boxes and points, pixels of the square: offsets from the anchors' centres."""
        centres = self._anchors[which] * SIZE
        middle, size = raw[:, :2] + centres, raw[:, 2:4]
        boxes = np.concatenate([middle - size / 2, middle + size / 2], axis=1)
        points = raw[:, 4:].reshape(len(raw), 7, 2) + centres[:, None]
        return boxes, points


def merge(boxes: F32, points: F32, scores: F32, overlap: float) -> tuple[F32, F32]:
    """Weighted non-maximum suppression.

    The surest box takes all that overlap it by more than ``overlap`` (intersection over union);
    what stands for them is the mean of their corners and points, weighted by score.

    Args:
        boxes: (n, 4) left, top, right, bottom.
        points: (n, p, 2).
        scores: (n,).
        overlap: 0 to 1.

    Returns:
        (m, 5) boxes with the score of the surest, and (m, p, 2) points, the surest first.
    """
    left = np.argsort(-scores, kind="stable")
    kept_boxes, kept_points = [], []
    while len(left):
        first = boxes[left[0]]
        low = np.maximum(boxes[left, :2], first[:2])
        high = np.minimum(boxes[left, 2:], first[2:])
        shared = np.prod(np.maximum(high - low, 0), axis=1)
        sizes = np.prod(boxes[left, 2:] - boxes[left, :2], axis=1)
        union = sizes + np.prod(first[2:] - first[:2]) - shared
        same = shared > overlap * union
        same[0] = True
        taken = left[same]
        weights = (scores[taken] / scores[taken].sum()).astype(np.float32)
        kept_boxes.append(np.append(weights @ boxes[taken], scores[left[0]]))
        kept_points.append(np.tensordot(weights, points[taken], 1))
        left = left[~same]
    return np.array(kept_boxes, np.float32), np.array(kept_points, np.float32)
