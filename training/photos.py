"""The photographs that training starts from: hands with masks, hand-free backgrounds, boxes.

Everything is read from the folder that ``shared/data/README.md`` describes; nothing of it is kept
in the project. What is computed once (where the hands are in the whole frames) is cached.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

U8 = NDArray[np.uint8]

HELD_ROOMS = frozenset(("3", "5", "25", "46", "16", "96"))
"""Rooms of the webcam photographs that the first two stages never see: figures come from them."""
HELD_PEOPLE = 0.3
"""The last part of the digit photographs, in the order they were taken, kept aside likewise."""

HAND_SIDE = 130
"""Pixels. Hands are kept at about the size they will have in a training picture."""


@dataclass
class Hand:
    """A hand with its mask.

    Attributes:
        colour: (h, w, 3) BGR.
        cover: (h, w) float32, 0 to 1.
        label: The sign it shows.
        source: ``digits`` or ``webcam``.
        wrist: Whether the arm leaves at the lower edge, so that a forearm may be joined on.
    """

    colour: U8
    cover: NDArray[np.float32]
    label: str
    source: str
    wrist: bool


def is_held(path: Path, paths: list[Path]) -> bool:
    """Whether a photograph is kept aside; ``paths`` are all of its label, sorted."""
    if path.parent.parent.name == "digits":
        return paths.index(path) >= (1 - HELD_PEOPLE) * len(paths)
    return room(path) in HELD_ROOMS


def room(path: Path) -> str:
    """The recording that a webcam photograph is from."""
    return path.name.split("-")[0]


def labelled(folder: Path) -> dict[str, list[Path]]:
    """Photographs by label, sorted."""
    return {d.name: sorted(d.glob("*.jpg")) for d in sorted(folder.iterdir()) if d.is_dir()}


def choose(folder: Path, *, held: bool | None) -> list[Path]:
    """Photographs kept aside (True), not kept aside (False), or all (None)."""
    return [
        path
        for paths in labelled(folder).values()
        for path in paths
        if held is None or is_held(path, paths) == held
    ]


def digit_mask(photo: U8) -> U8 | None:
    """The hand in a digit photograph by Otsu's threshold on Cr; None when that is doubtful.

    Returns:
        (h, w) of 0 and 1: one piece that reaches the lower edge.
    """
    cr = cv2.GaussianBlur(cv2.cvtColor(photo, cv2.COLOR_BGR2YCrCb)[:, :, 1], (5, 5), 0)
    _level, mask = cv2.threshold(cr, 0, 1, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    if cr[mask == 1].mean() - cr[mask == 0].mean() < 8:
        return None
    count, pieces, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    if count < 2:
        return None
    largest = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    hand = (pieces == largest).astype(np.uint8)
    rest = int(mask.sum()) - int(hand.sum())
    area = float(hand.mean())
    border = float(
        np.concatenate([hand[0], hand[: len(hand) // 2, 0], hand[: len(hand) // 2, -1]]).mean()
    )
    if not 0.08 < area < 0.6 or rest > 0.1 * hand.sum() or border > 0.15 or not hand[-1].any():
        return None
    # Holes are fingers' shadows, not background, when they are small.
    filled = cv2.morphologyEx(hand, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    return np.asarray(filled, np.uint8)


def digit_hands(folder: Path, *, held: bool | None = False) -> list[Hand]:
    """Hands of the digit photographs whose mask can be trusted."""
    hands = []
    for path in choose(folder / "digits", held=held):
        photo = cv2.imread(str(path))
        if photo.shape[0] != 100:
            photo = cv2.resize(photo, (100, 100), interpolation=cv2.INTER_AREA)
        mask = digit_mask(photo)
        if mask is not None:
            size = (HAND_SIDE, HAND_SIDE)
            fine = cv2.resize(photo, size, interpolation=cv2.INTER_CUBIC)
            cover = cv2.resize(mask.astype(np.float32), size, interpolation=cv2.INTER_CUBIC)
            # Half a pixel inwards: the rim of the photograph is mixed with its background.
            cover = cv2.GaussianBlur(cover, (0, 0), 1.0)
            cover = np.clip((cover - 0.5) * 2.5 + 0.25, 0, 1).astype(np.float32)
            hands.append(Hand(fine, cover, path.parent.name, "digits", wrist=True))
    return hands


def hand_boxes(folder: Path, cache: Path) -> dict[str, tuple[int, int, int, int]]:
    """Where the box of ``webcam-box/L/NAME-0.jpg`` lies in ``webcam-full/L/NAME.jpg``.

    By normalised correlation over scales: the boxes are crops, so the best match is nearly exact.

    Returns:
        x, y, width, height in pixels of the whole frame, by ``L/NAME``.
    """
    if cache.exists():
        return {key: tuple(box) for key, box in json.loads(cache.read_text()).items()}
    boxes = {}
    for path in choose(folder / "webcam-full", held=None):
        crop_path = folder / "webcam-box" / path.parent.name / f"{path.stem}-0.jpg"
        if not crop_path.exists():
            continue
        frame, crop = cv2.imread(str(path), 0), cv2.imread(str(crop_path), 0)
        small = cv2.resize(frame, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
        best = (-1.0, (0, 0, 0, 0))
        for height in np.geomspace(20, small.shape[0], 40):
            h = round(float(height))
            w = round(crop.shape[1] * h / crop.shape[0])
            if h > small.shape[0] or not 8 <= w <= small.shape[1]:
                continue
            piece = cv2.resize(crop, (w, h), interpolation=cv2.INTER_AREA)
            _, score, _, (x, y) = cv2.minMaxLoc(
                cv2.matchTemplate(small, piece, cv2.TM_CCOEFF_NORMED)
            )
            if score > best[0]:
                best = (float(score), (4 * x, 4 * y, 4 * w, 4 * h))
        if best[0] > 0.8:
            boxes[f"{path.parent.name}/{path.stem}"] = best[1]
    cache.write_text(json.dumps(boxes))
    return boxes


def backgrounds(folder: Path, cache: Path, *, held: bool | None = False) -> list[U8]:
    """Parts of whole webcam frames without the hand, faces in view, as large as they can be."""
    boxes = hand_boxes(folder, cache)
    parts = []
    for path in choose(folder / "webcam-full", held=held):
        box = boxes.get(f"{path.parent.name}/{path.stem}")
        if box is None:
            continue
        frame = cv2.imread(str(path))
        _height, _width = frame.shape[:2]
        x, y, w, _h = box
        # Below the hand is its arm, so only what lies beside it or above is sure to be free of it.
        for part in (frame[:, : max(0, x)], frame[:, x + w :], frame[: max(0, y)]):
            if min(part.shape[:2]) >= 110:
                parts.append(np.ascontiguousarray(part))
    return parts
