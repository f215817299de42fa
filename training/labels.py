"""Masks of the webcam photographs from their landmarks: a skeleton says where, GrabCut how far.

``python -m training.labels --data PHOTOS --work DIR`` reads ``landmarks.json`` (training.landmarks)
and writes ``labels.npz``. Along the bones a pixel is hand, far from them it is not; GrabCut
(C. Rother, V. Kolmogorov, A. Blake, SIGGRAPH 2004) decides between by colour. The arm beyond the
wrist gets no weight: it may be skin or sleeve. A label is kept when its area fits its skeleton and
it is one piece.
"""

import argparse
import json
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from training.compose import Whole
from training.photos import HAND_SIDE, U8, Hand, choose, hand_boxes

F32 = NDArray[np.float32]
SIDE = 240
"""Pixels of the longer side of a box when it is labelled."""
FINGERS = ((1, 2, 3, 4), (5, 6, 7, 8), (9, 10, 11, 12), (13, 14, 15, 16), (17, 18, 19, 20))
PALM = (0, 1, 5, 9, 13, 17)


def _skeleton(points: NDArray[np.int32], shape: tuple[int, int], thickness: float) -> U8:
    drawn = np.zeros(shape, np.uint8)
    width = max(1, round(thickness))
    cv2.fillPoly(drawn, [points[list(PALM)]], 1)
    cv2.polylines(drawn, [points[list(PALM)]], True, 1, width)
    for finger in FINGERS:
        cv2.polylines(drawn, [points[list(finger)]], False, 1, width)
    return drawn


def mask_from(picture: U8, landmarks: NDArray[np.float64]) -> tuple[U8, U8] | None:
    """Mask and weight of one box.

    Args:
        picture: (h, w, 3) BGR.
        landmarks: (21, 2) in 0..1.

    Returns:
        (h, w) mask of 0 and 1, (h, w) weight of 0 and 1; None when the label is not to be trusted.
    """
    height, width = picture.shape[:2]
    points = np.round(landmarks * (width, height)).astype(np.int32)
    wrist, middle = points[0].astype(float), points[9].astype(float)
    scale = max(
        float(np.linalg.norm(middle - wrist)), float(np.linalg.norm(points[5] - points[17]))
    )
    sure = _skeleton(points, (height, width), 0.10 * scale)
    palm = np.zeros_like(sure)
    cv2.fillPoly(palm, [points[list(PALM)]], 1)
    near = _skeleton(points, (height, width), 0.34 * scale)
    far = _skeleton(points, (height, width), 0.62 * scale)
    # The arm: a strip from the wrist away from the fingers.
    away = (wrist - middle) / max(np.linalg.norm(wrist - middle), 1e-6)
    arm = np.zeros_like(sure)
    start, end = wrist + 0.1 * scale * away, wrist + 4 * scale * away
    cv2.line(arm, tuple(int(v) for v in start), tuple(int(v) for v in end), 1, round(0.95 * scale))
    trimap = np.full((height, width), cv2.GC_BGD, np.uint8)
    trimap[(far == 1) | (arm == 1)] = cv2.GC_PR_BGD
    trimap[near == 1] = cv2.GC_PR_FGD
    trimap[sure == 1] = cv2.GC_FGD
    if trimap.min() == trimap.max() or not (trimap == cv2.GC_BGD).any():
        return None
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.grabCut(picture, trimap, (0, 0, 0, 0), *models, 4, cv2.GC_INIT_WITH_MASK)
    mask = ((trimap == cv2.GC_FGD) | (trimap == cv2.GC_PR_FGD)).astype(np.uint8)
    mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    count, pieces, stats, _ = cv2.connectedComponentsWithStats(mask)
    if count < 2:
        return None
    largest = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    mask = (pieces == largest).astype(np.uint8)
    weight = np.ones_like(mask)
    weight[(arm == 1) & (far == 0)] = 0
    seen = weight == 1
    inside, thin = float(mask[seen].sum()), float(near[seen].sum())
    # A hand that is far larger or smaller than its bones took the background, or lost a finger.
    missing = float((near[seen] * (1 - mask[seen])).sum()) / max(thin, 1)
    if not 0.75 < inside / max(thin, 1) < 1.45 or missing > 0.18:
        return None
    return mask, weight


def label(data: Path, work: Path) -> dict[str, int]:
    """Label all boxes and write ``labels.npz``; returns how many were kept."""
    landmarks = json.loads((work / "landmarks.json").read_text())
    boxes = hand_boxes(data, work / "boxes.json")
    kept: dict[str, U8] = {}
    counts = {"kept": 0, "no landmarks": 0, "refused": 0}
    for path in choose(data / "webcam-box", held=None):
        name = f"{path.parent.name}/{path.stem}"
        if landmarks.get(name) is None:
            counts["no landmarks"] += 1
            continue
        picture = cv2.imread(str(path))
        scale = SIDE / max(picture.shape[:2])
        picture = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        found = mask_from(picture, np.array(landmarks[name]))
        if found is None:
            counts["refused"] += 1
            continue
        counts["kept"] += 1
        mask, weight = found
        kept[f"{name}|box"] = np.dstack([picture, 255 * mask, 255 * weight])
        frame = data / "webcam-full" / path.parent.name / f"{path.stem.removesuffix('-0')}.jpg"
        box = boxes.get(f"{path.parent.name}/{frame.stem}")
        if frame.exists() and box is not None:
            kept[f"{name}|frame"] = _in_frame(cv2.imread(str(frame)), box, mask, weight)
    np.savez(work / "labels.npz", **kept)
    return counts


def _in_frame(frame: U8, box: tuple[int, int, int, int], mask: U8, weight: U8) -> U8:
    """The whole frame with the box's label; what lies below the box may be its arm: no weight."""
    x, y, w, h = box
    height, width = frame.shape[:2]
    right, bottom = min(width, x + w), min(height, y + h)
    layers = np.dstack([frame, np.zeros_like(frame[:, :, 0]), np.full_like(frame[:, :, 0], 255)])
    layers[bottom:, max(0, x - w // 2) : right + w // 2, 4] = 0
    for layer, values in ((3, mask), (4, weight)):
        fitted = cv2.resize(255 * values, (w, h), interpolation=cv2.INTER_AREA)
        layers[y:bottom, x:right, layer] = fitted[: bottom - y, : right - x]
    return np.asarray(cv2.resize(layers, (320, 240), interpolation=cv2.INTER_AREA), np.uint8)


def load(path: Path, data: Path, *, held: bool | None) -> tuple[list[Whole], list[Hand]]:
    """Labelled pictures as they are, and the hands cut out of the boxes."""
    names = {f"{p.parent.name}/{p.stem}" for p in choose(data / "webcam-box", held=held)}
    wholes, hands = [], []
    with np.load(path) as stored:
        for key in stored.files:
            name, kind = key.split("|")
            if name not in names:
                continue
            layers = stored[key]
            colour = np.ascontiguousarray(layers[:, :, :3])
            cover = cv2.GaussianBlur(layers[:, :, 3], (0, 0), 0.8).astype(np.float32) / 255
            weight = layers[:, :, 4].astype(np.float32) / 255
            wholes.append(Whole(colour, cover, weight))
            if kind == "box":
                hands.append(_cut_out(colour, cover * weight, name.split("/")[0]))
    return wholes, hands


def _cut_out(colour: U8, cover: F32, name: str) -> Hand:
    size = (HAND_SIDE, HAND_SIDE)
    small = cv2.resize(colour, size, interpolation=cv2.INTER_AREA)
    inside = np.clip(cv2.resize(cover, size, interpolation=cv2.INTER_AREA), 0, 1)
    wrist = float(inside[-3:].mean(0).max()) > 0.8
    return Hand(small, inside.astype(np.float32), name, "webcam", wrist=wrist)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder of the photographs")
    parser.add_argument("--work", type=Path, required=True, help="folder of landmarks.json")
    args = parser.parse_args()
    print(label(args.data, args.work))


if __name__ == "__main__":
    main()
