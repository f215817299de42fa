"""Draw the pictures of docs/recognition.md: the project's drawn hand, room and face, no photograph.

Start it with ``python -m docs.make_recognition_pictures``.
"""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from app.config import MatchSettings, PipelineSettings
from app.gestures.hand import POSES, TONES, HandLook, HandView, jitter, render_hand, render_sprite
from app.gestures.hand.render import compose
from app.pipeline import extract_template
from app.pipeline.features import Features
from app.pipeline.mask import LearnedMask
from app.pipeline.palm import Palm, PalmFinder
from app.pipeline.template import resize_mask
from app.pipeline.views import Views
from app.pipeline.wrist import cut_at, erase_arm

U8 = NDArray[np.uint8]
PICTURES = Path(__file__).parent / "pictures"
SIZE = (320, 240)
GAP, HEAD = 12, 26
PAPER, INK, BLUE, RED = (255, 255, 255), (50, 40, 30), (200, 110, 20), (40, 40, 210)
COLOURS = ((200, 110, 20), (40, 140, 30), (40, 40, 210), (170, 40, 150), (20, 140, 220))
LARGEST = 150_000
"""Bytes of one picture."""


def room() -> NDArray[np.float32]:
    """(240, 320, 3) BGR: a wall, a shelf, a window, a person."""
    width, height = SIZE
    light = np.linspace(1.05, 0.75, width, dtype=np.float32)[None, :, None]
    picture = np.ascontiguousarray(np.full((height, width, 3), (168, 178, 186)) * light, np.float32)
    cv2.rectangle(picture, (12, 14), (92, 92), (225, 205, 170), -1)
    cv2.rectangle(picture, (12, 14), (92, 92), (90, 100, 110), 4)
    cv2.line(picture, (52, 14), (52, 92), (90, 100, 110), 3)
    cv2.rectangle(picture, (0, 168), (width, height), (62, 84, 112), -1)
    for number, colour in enumerate(((60, 70, 170), (110, 130, 60), (50, 120, 180), (130, 80, 70))):
        x = 104 + 14 * number
        cv2.rectangle(picture, (x, 20), (x + 11, 56), colour, -1)
    cv2.rectangle(picture, (98, 56), (172, 62), (50, 66, 90), -1)
    cv2.ellipse(picture, (258, 226), (56, 84), 0, 0, 360, (110, 80, 60), -1)
    cv2.rectangle(picture, (247, 116), (271, 150), (96, 128, 178), -1)
    cv2.ellipse(picture, (259, 78), (35, 44), 0, 0, 360, (36, 44, 60), -1)
    cv2.ellipse(picture, (259, 88), (28, 39), 0, 0, 360, (118, 152, 202), -1)
    for x in (248, 270):
        cv2.ellipse(picture, (x, 82), (5, 3), 0, 0, 360, (50, 50, 60), -1)
    cv2.ellipse(picture, (259, 107), (10, 3), 0, 0, 360, (92, 96, 168), -1)
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), 0.8), np.float32)


def scene(pose: str, length: float, centre: tuple[float, float]) -> U8:
    """A drawn hand in the drawn room."""
    sprite = render_sprite(POSES[pose], SIZE, HandView(length, centre), HandLook(TONES["medium"]))
    picture = compose(sprite, room())
    picture = picture + np.random.default_rng(4).normal(0, 2, picture.shape)
    return np.asarray(picture.clip(0, 255), np.uint8)


def tile(picture: U8, title: str, width: int, height: int) -> U8:
    """The picture fitted into a box, under its title."""
    if picture.ndim == 2:
        picture = np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), np.uint8)
    scale = min(width / picture.shape[1], height / picture.shape[0])
    size = round(picture.shape[1] * scale), round(picture.shape[0] * scale)
    fitted = cv2.resize(
        picture, size, interpolation=cv2.INTER_NEAREST if scale > 1 else cv2.INTER_AREA
    )
    out = np.full((height + HEAD, width, 3), PAPER, np.uint8)
    x = (width - size[0]) // 2
    out[HEAD : HEAD + size[1], x : x + size[0]] = fitted
    cv2.putText(out, title, (2, 17), cv2.FONT_HERSHEY_SIMPLEX, 0.43, INK, 1, cv2.LINE_AA)
    return out


def row(*tiles: U8) -> U8:
    """Tiles of one height side by side."""
    gap = np.full((tiles[0].shape[0], GAP, 3), PAPER, np.uint8)
    parts = [gap]
    for one in tiles:
        parts += [one, gap]
    return np.hstack(parts)


def save(name: str, picture: U8) -> None:
    path = PICTURES / f"{name}.png"
    cv2.imwrite(str(path), picture, [cv2.IMWRITE_PNG_COMPRESSION, 9])
    size = path.stat().st_size
    if size > LARGEST:
        raise SystemExit(f"{path} has {size} bytes: at most {LARGEST} are wanted")
    print(f"{path}: {size} bytes")


def shaded(picture: U8, mask: U8) -> U8:
    """What is not hand darkened."""
    out = picture.copy()
    out[mask == 0] = out[mask == 0] // 4
    return out


def signed(row_of_features: NDArray[np.float32], height: int, width: int) -> U8:
    """Inside blue, outside red, the outline white."""
    values = row_of_features.reshape(height, width)
    out = np.full((height, width, 3), 255, np.float32)
    inside, outside = np.clip(values, 0, 1), np.clip(-values, 0, 1)
    out[:, :, 1] -= 215 * np.maximum(inside, outside)
    out[:, :, 2] -= 235 * inside
    out[:, :, 0] -= 235 * outside
    return np.asarray(out.clip(0, 255), np.uint8)


def views_of(palm: Palm, settings: MatchSettings) -> U8:
    return Views(settings)(palm)


def draw_steps() -> None:
    """From a room to what is compared."""
    picture = scene("forward", 140, (128, 142))
    masked = LearnedMask()(picture)
    palm = PalmFinder()(masked.mask, masked.bounds)
    settings = PipelineSettings()
    cut = cut_at(palm, settings.wrist.radii)
    assert cut is not None
    measured = shaded(picture, palm.piece)
    cv2.circle(measured, (palm.x, palm.y), round(palm.radius), BLUE, 2, cv2.LINE_AA)
    cv2.circle(measured, (palm.x, palm.y), 2, BLUE, -1)
    cv2.line(measured, (0, cut.at), (SIZE[0], cut.at), RED, 2)
    hand = palm.piece.copy()
    erase_arm(hand, cut)
    x, y, width, height = cv2.boundingRect(hand)
    template = resize_mask(hand[y : y + height, x : x + width], 60, 80)
    views = views_of(palm, settings.match)
    features = Features(MatchSettings(features="distance"))(views)
    middle = len(views) // 2
    box = (225, 180)
    small = (135, 180)
    save(
        "recognition-steps",
        row(
            tile(picture, "1. picture", *box),
            tile(palm.piece * np.uint8(255), "2. mask by the network", *box),
            tile(measured, "3. palm, and cut at the wrist", *box),
            tile(template * np.uint8(255), "4. template 60x80", *small),
            tile(signed(features[middle], *views.shape[1:]), "5. signed distance", *small),
        ),
    )
    shown = [
        tile(view * np.uint8(255), f"turn {turn:+.2f}", 84, 112)
        for view, turn in zip(views, settings.match.turns, strict=False)
    ]
    save("recognition-views", row(*shown))


def draw_two_looks() -> None:
    """The first look, the part it chooses, the second look."""
    picture = scene("stop", 74, (112, 150))
    coarse, fine = LearnedMask(), LearnedMask()
    first = coarse._look(picture, (0, 0, *SIZE))
    masked = fine(picture)
    x, y, width, height = masked.bounds
    second = fine._look(picture, masked.bounds)
    framed = picture.copy()
    cv2.rectangle(framed, (x, y), (x + width - 1, y + height - 1), BLUE, 2)
    box = (210, 160)
    save(
        "recognition-two-looks",
        row(
            tile(picture, "a hand far away", *box),
            tile(np.asarray(first * 255, np.uint8), "first look: the whole picture", *box),
            tile(framed, "the part round the palm", *box),
            tile(np.asarray(second * 255, np.uint8), "second look: this part", *box),
            tile(shaded(picture, masked.mask), "the mask", *box),
        ),
    )


def draw_plane() -> None:
    """Views of five enrolled gestures on the first two principal components, and a query."""
    settings = PipelineSettings.model_validate(
        {"match": {"features": "distance"}, "binarise": {"mode": "threshold"}}
    )
    names = ("stop", "forward", "up", "close", "open")
    rng = np.random.default_rng(2)
    features = Features(settings.match)
    groups = []
    for name in names:
        hands = []
        for number in range(4):
            pose = POSES[name] if number == 0 else jitter(POSES[name], 0.08, rng)
            picture = render_hand(pose, (320, 240), HandView(160), seed=number)
            data = cv2.imencode(".png", picture)[1].tobytes()
            views = extract_template(data, settings).views
            hands.append(features(views))
        groups.append(hands)
    rows = np.concatenate([one for hands in groups for one in hands[:3]])
    mean = rows.mean(axis=0)
    _, _, basis = np.linalg.svd(rows - mean, full_matrices=False)
    width, height = 760, 460
    canvas = np.full((height, width, 3), PAPER, np.uint8)
    points = (rows - mean) @ basis[:2].T
    low, high = points.min(0), points.max(0)

    def at(point: NDArray[np.float32]) -> tuple[int, int]:
        share = (point - low) / (high - low)
        return round(50 + share[0] * (width - 240)), round(height - 40 - share[1] * (height - 80))

    for index, (name, hands) in enumerate(zip(names, groups, strict=True)):
        colour = COLOURS[index]
        for one in hands[:3]:
            for point in (one - mean) @ basis[:2].T:
                cv2.circle(canvas, at(point), 4, colour, -1, cv2.LINE_AA)
        y = 60 + 30 * index
        cv2.circle(canvas, (width - 165, y - 5), 6, colour, -1, cv2.LINE_AA)
        cv2.putText(
            canvas, name, (width - 150, y), cv2.FONT_HERSHEY_SIMPLEX, 0.5, INK, 1, cv2.LINE_AA
        )
    asked = 1
    query = (groups[asked][3] - mean) @ basis[:2].T
    for point in query:
        x, y = at(point)
        cv2.drawMarker(canvas, (x, y), INK, cv2.MARKER_TILTED_CROSS, 11, 2, cv2.LINE_AA)
    y = 60 + 30 * len(names)
    cv2.drawMarker(canvas, (width - 165, y - 5), INK, cv2.MARKER_TILTED_CROSS, 11, 2, cv2.LINE_AA)
    text = f"asked: a {names[asked]}"
    cv2.putText(canvas, text, (width - 150, y), cv2.FONT_HERSHEY_SIMPLEX, 0.5, INK, 1, cv2.LINE_AA)
    for text, where in (("first component", (270, height - 12)), ("second component", (8, 20))):
        cv2.putText(canvas, text, where, cv2.FONT_HERSHEY_SIMPLEX, 0.45, INK, 1, cv2.LINE_AA)
    save("recognition-plane", canvas)


def main() -> None:
    PICTURES.mkdir(exist_ok=True)
    draw_steps()
    draw_two_looks()
    draw_plane()


if __name__ == "__main__":
    main()
