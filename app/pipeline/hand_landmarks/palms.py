"""Palms: where in a picture palms are, by MediaPipe's palm detector.

A single-shot detector (W. Liu et al., "SSD", ECCV 2016): for each of 2,016 anchors a score, a box
and seven points of the palm. Anchors, decoding and the merging of overlapping boxes are those of
MediaPipe's published graph ``palm_detection_cpu`` (Apache-2.0).
"""

from pathlib import Path

import cv2
import numpy as np

from app.pipeline.hand_landmarks.region import as_seen, to_picture
from app.pipeline.hand_landmarks.runtime import Network
from app.pipeline.hand_landmarks.types import PalmDetection, Region
from app.pipeline.types import F32, U8

SIZE = 192
"""Pixels. Side of the square that the network looks at."""
STRIDES = (8, 16, 16, 16)
"""Pixels between anchors, one a layer; each layer has two anchors at each place."""
CLIP = 100.0
"""Largest score, either way, before the sigmoid."""
OVERLAP = 0.3
"""Intersection over union from which two boxes are of one palm."""
SHRINK = 0.75
"""A picture that is looked at smaller than this is made smaller by area first: no pixel is lost."""


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


def whole(pixels: U8, widened: float = 1.0) -> Region:
    """The square round a picture, ``widened`` times as large as it has to be."""
    height, width = pixels.shape[:2]
    return Region(width / 2, height / 2, widened * max(width, height), 0.0)


class PalmDetector:
    """(h, w, 3) BGR or (h, w, 1) grey to palms, the surest first."""

    def __init__(self, model: Path) -> None:
        self._network = Network(model)
        self._anchors = anchors()
        self._square: U8 = np.zeros((SIZE, SIZE, 3), np.uint8)
        self._input: F32 = np.zeros((SIZE, SIZE, 3), np.float32)

    def __call__(
        self, pixels: U8, least: float, where: Region | None = None
    ) -> list[PalmDetection]:
        """Find palms.

        Args:
            pixels: The picture.
            least: Score from which a palm counts.
            where: What is looked at; default: all of the picture.

        Returns:
            In pixels of the picture.
        """
        where = where or whole(pixels)
        self._look(pixels, where)
        raw, logits = self._network(self._input)
        scores = (1 / (1 + np.exp(-np.clip(logits[:, 0], -CLIP, CLIP)))).astype(np.float32)
        sure = np.flatnonzero(scores >= least)
        if not len(sure):
            return []
        boxes, points = self._decode(raw[sure], sure)
        merged, sevens = merge(boxes, points, scores[sure], OVERLAP)
        return [
            PalmDetection(*_back(box, seven, where), float(score))
            for box, seven, score in zip(merged[:, :4], sevens, merged[:, 4], strict=True)
        ]

    def _look(self, pixels: U8, where: Region) -> None:
        """Fill the input with a region, RGB, 0 to 1."""
        scale = SIZE / where.side
        if scale < SHRINK:
            height, width = pixels.shape[:2]
            w, h = max(1, round(width * scale)), max(1, round(height * scale))
            pixels = np.asarray(cv2.resize(pixels, (w, h), interpolation=cv2.INTER_AREA), np.uint8)
            across, down = w / width, h / height
            where = Region(where.x * across, where.y * down, SIZE, where.turn)
        as_seen(pixels, where, self._square)
        np.multiply(self._square, np.float32(1 / 255), out=self._input)

    def _decode(self, raw: F32, which: np.ndarray) -> tuple[F32, F32]:
        """Boxes and points, pixels of the square: offsets from the anchors' centres."""
        centres = self._anchors[which] * SIZE
        middle, size = raw[:, :2] + centres, raw[:, 2:4]
        boxes = np.concatenate([middle - size / 2, middle + size / 2], axis=1)
        points = raw[:, 4:].reshape(len(raw), 7, 2) + centres[:, None]
        return boxes, points


def _back(box: F32, points: F32, where: Region) -> tuple[F32, F32]:
    """A box and points of a look in pixels of the picture; the box stays upright."""
    matrix = to_picture(where, SIZE)
    middle = (box[:2] + box[2:]) / 2
    half = (box[2:] - box[:2]) / 2 * np.float32(where.side / SIZE)
    there = matrix[:, :2] @ middle + matrix[:, 2]
    return np.concatenate([there - half, there + half]), points @ matrix[:, :2].T + matrix[:, 2]


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
