"""Hands drawn by the project's renderer: poses and skins that the photographs lack."""

import numpy as np

from app.gestures.hand import TONES, Finger, HandLook, HandPose, HandView, Thumb, render_sprite
from training.photos import HAND_SIDE as SIZE
from training.photos import Hand


def random_pose(rng: np.random.Generator) -> HandPose:
    """Each finger straight, bent or between; the thumb anywhere; fists are frequent."""
    fist = rng.random() < 0.15
    fingers = []
    spread = rng.normal(0.12, 0.08)
    for place in (1.5, 0.4, -0.6, -1.6):
        bend = 1.0 if fist else float(rng.choice([0.0, 1.0, rng.random()], p=(0.45, 0.3, 0.25)))
        bend = float(np.clip(bend + rng.normal(0, 0.06), 0, 1.1))
        fingers.append(
            Finger(1.4 * bend, 1.75 * bend, 0.6 * bend, place * spread * (1 - 0.8 * bend))
        )
    thumb = Thumb(
        rng.uniform(0.35, 1.05),
        rng.uniform(0.05, 0.65),
        rng.uniform(-0.3, 0.95),
        rng.uniform(-0.2, 0.8),
    )
    return HandPose(*fingers, thumb)


def drawn_hands(count: int, rng: np.random.Generator) -> list[Hand]:
    """So many hands in random poses, skins and lights; the arm leaves below."""
    tones = list(TONES.values())
    hands = []
    for _ in range(count):
        a, b = (np.array(tones[i], float) for i in rng.integers(len(tones), size=2))
        skin = np.clip((a + rng.random() * (b - a)) * rng.normal(1, 0.06, 3), 3, 255)
        direction = (rng.normal(0, 0.6), rng.normal(-0.3, 0.6), rng.uniform(0.5, 1.1))
        look = HandLook(skin=(int(skin[0]), int(skin[1]), int(skin[2])), light=direction)
        view = HandView(
            length=0.75 * SIZE, centre=(SIZE / 2, SIZE / 2 - 6), turn=rng.normal(0, 0.1)
        )
        sprite = render_sprite(random_pose(rng), (SIZE, SIZE), view, look, fine=1)
        cover = np.clip(sprite.cover, 0, 1)
        colour = np.clip(sprite.colour / np.maximum(cover, 0.02)[:, :, None], 0, 255)
        hands.append(Hand(colour.astype(np.uint8), cover, "", "drawn", wrist=True))
    return hands
