"""What happens before the camera. Every act is a generator of frames with their labels."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from app.gestures.hand.pose import HandPose, blend
from app.gestures.hand.poses import POSES, RELAXED
from benchmarks.streams.hands import OTHERS, Drawn, thing_cutout
from benchmarks.streams.scene import (
    HEIGHT,
    NOTHING,
    U8,
    WIDTH,
    Cutout,
    Frame,
    Studio,
    bell,
    ease,
    moving,
    push,
    rest,
    tremor,
)

Act = Callable[[Studio], Iterator[Frame]]
LOWERED = (0.0, float(HEIGHT))
MORPHS = (0.25, 0.4, 0.6, 1.0, 1.6, 2.4)
"""Seconds from one gesture to another: from hasty to hesitating."""
HASTY = 3
"""So many of them lead over a fist, too: slower, and the fist, which is itself a gesture, would be
shown for longer than one may take to start."""
STOPS = (0.0, 0.0, 0.08, 0.15)
"""Seconds that a hand stops on the way. Longer is a rest, and what it shows is then shown."""


def empty(studio: Studio) -> Iterator[Frame]:
    """The room alone, for three seconds."""
    for _ in range(studio.count(3)):
        yield Frame(studio.shoot(), NOTHING)


def turning(studio: Studio) -> Iterator[Frame]:
    """Somebody moves: a part of the room sways and stretches as a turning head does; it pauses."""
    g = studio.generator
    centre = (float(g.uniform(0.25, 0.75)) * WIDTH, float(g.uniform(0.2, 0.7)) * HEIGHT)
    whole = bell(centre, (110.0, 150.0))
    face = bell(centre, (45.0, 80.0))
    amount, slow = float(g.uniform(8, 30)), float(g.uniform(0.15, 0.5))
    for number in range(studio.count(6)):
        at = number / studio.fps
        wave = np.clip(1.6 * np.sin(2 * np.pi * slow * at), -1, 1)  # rests at both ends
        room = push(studio.room, whole, (amount * wave, amount * 0.2 * wave))
        room = push(room, face, (amount * 0.5 * wave, 0.0))
        yield Frame(studio.shoot(room=room), NOTHING)


def objects(studio: Studio, sources: Sequence[U8]) -> Iterator[Frame]:
    """Things are held into the picture, stay for a while, and go."""
    g = studio.generator
    for _ in range(2):
        thing = thing_cutout(sources[int(g.integers(len(sources)))], g)
        aside = np.array([g.choice([-1.0, 1.0]) * WIDTH * 0.9, g.uniform(-80, 80)])
        place = np.array([g.uniform(-180, 180), g.uniform(-120, 120)])
        yield from _visit(studio, thing, aside, place, float(g.uniform(0.3, 1.2)), None)


def hand_passes(studio: Studio, hand: Cutout, gesture: str | None) -> Iterator[Frame]:
    """A hand is raised, shows what it shows, and is lowered."""
    g = studio.generator
    stay = float(g.uniform(0.7, 1.6))
    yield from _visit(studio, hand, np.array(LOWERED), np.zeros(2), stay, gesture)
    for _ in range(studio.count(0.4)):
        yield Frame(studio.shoot(), NOTHING)


def _visit(
    studio: Studio,
    thing: Cutout,
    outside: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
    place: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
    stay: float,
    gesture: str | None,
) -> Iterator[Frame]:
    g = studio.generator
    seconds = float(g.uniform(0.35, 0.9))
    for share in ease(studio.count(seconds)):
        shift = outside + share * (place - outside)
        yield Frame(studio.shoot((thing, shift)), moving(None, gesture))
    for shake in tremor(studio.count(stay), studio.fps, float(g.uniform(0.2, 0.8)), g):
        yield Frame(studio.shoot((thing, place + shake)), rest(gesture))
    for share in ease(studio.count(seconds)):
        shift = place + share * (outside - place)
        yield Frame(studio.shoot((thing, shift)), moving(gesture, None))


def hand_waves(studio: Studio, hand: Cutout) -> Iterator[Frame]:
    """A hand in view that never rests: it goes round and tilts, three to nine times in six seconds.

    What it shows does not matter: a gesture counts only at rest.
    """
    g = studio.generator
    radius, rate = float(g.uniform(50, 110)), float(g.uniform(0.5, 1.5))
    for share in ease(studio.count(0.5)):
        yield Frame(studio.shoot((hand, (radius * share, HEIGHT * (1 - share)))), NOTHING)
    for number in range(studio.count(6)):
        angle = 2 * np.pi * rate * number / studio.fps
        shift = (radius * np.cos(angle), 0.6 * radius * np.sin(angle))
        yield Frame(studio.shoot((hand, shift)), NOTHING)


def fingers_play(studio: Studio, person: Drawn) -> Iterator[Frame]:
    """The drawn hand never rests: from any pose to the next, none of them enrolled, none held."""
    g = studio.generator
    start = person.pose("relaxed")
    for _ in range(8):
        end = person.pose(str(g.choice(list(OTHERS))))
        count = studio.count(float(g.uniform(0.4, 1.0)))
        aside = tremor(count, studio.fps, 3.0, g)
        for share, shift in zip(ease(count), aside, strict=True):
            yield Frame(studio.shoot((person.between(start, end, share), shift)), NOTHING)
        start = end


def drawn_passes(studio: Studio, person: Drawn, name: str, gesture: str | None) -> Iterator[Frame]:
    """The drawn hand is raised in a pose, and lowered."""
    return hand_passes(studio, person.cut(person.pose(name)), gesture)


def drawn_changes(studio: Studio, person: Drawn, names: Sequence[str]) -> Iterator[Frame]:
    """The drawn hand goes from gesture to gesture in view, at any speed, with stops on the way.

    A third of the ways lead over a fist, or over the relaxed hand, which is passed at full speed
    or with a short stop (:data:`STOPS`). Meanwhile the hand drifts to another place.
    """
    g = studio.generator
    pose = person.pose(names[0])
    for share in ease(studio.count(0.5)):
        cutout = person.between(RELAXED, pose, min(2 * share, 1.0))
        yield Frame(studio.shoot((cutout, (0.0, HEIGHT * (1 - share)))), moving(None, names[0]))
    place = np.zeros(2)
    for here, there in zip(names, [*names[1:], None], strict=True):
        shakes = tremor(studio.count(float(g.uniform(0.6, 1.1))), studio.fps, 0.35, g)
        for shake in shakes:
            yield Frame(studio.shoot((person.cut(pose), place + shake)), rest(here))
        if there is None:
            break
        target, goal = person.pose(there), g.uniform(-25, 25, 2)
        for cutout, share in _way(studio, person, pose, target):
            shift = place + share * (goal - place)
            yield Frame(studio.shoot((cutout, shift)), moving(here, there))
        pose, place = target, goal
    for share in ease(studio.count(0.5)):
        shift = place + np.array([0.0, HEIGHT * share])
        yield Frame(studio.shoot((person.cut(pose), shift)), moving(names[-1], None))


def _way(
    studio: Studio, person: Drawn, start: HandPose, end: HandPose
) -> Iterator[tuple[Cutout, float]]:
    """Cutouts, and shares of the way, from one pose to another."""
    g = studio.generator
    stop = round(float(g.choice(STOPS)) * studio.fps)
    over: HandPose | None = None
    if g.random() < 1 / 3:
        over = POSES["close"] if g.random() < 0.7 else RELAXED
    count = studio.count(float(g.choice(MORPHS if over is not POSES["close"] else MORPHS[:HASTY])))
    halt = float(g.uniform(0.25, 0.75)) if over is None else 0.5
    stopped = False
    for share in ease(count):
        if over is None:
            pose = blend(start, end, share)
        else:
            half = min(share, 0.5) * 2, max(share - 0.5, 0.0) * 2
            pose = blend(start, over, half[0]) if share < 0.5 else blend(over, end, half[1])
        cutout = person.cut(pose)
        yield cutout, float(share)
        if not stopped and share >= halt:
            stopped = True
            for _ in range(stop):
                yield cutout, float(share)


def photo_changes(studio: Studio, hands: Sequence[tuple[Cutout, str | None]]) -> Iterator[Frame]:
    """Photographed hands, one after the other: each goes down as the next comes up beside it.

    The change is hidden where the lower one leaves the picture by half, as when a hand is dropped
    to the desk and raised with another sign.
    """
    g = studio.generator
    before: str | None = None
    for number, (cutout, gesture) in enumerate(hands):
        after = hands[number + 1][1] if number + 1 < len(hands) else None
        down = float(g.uniform(0.55, 1.0)) * HEIGHT
        count = studio.count(float(g.uniform(0.25, 0.7)))
        for share in ease(count):
            yield Frame(studio.shoot((cutout, (0.0, down * (1 - share)))), moving(before, gesture))
        stay = studio.count(float(g.uniform(0.6, 1.1)))
        for shake in tremor(stay, studio.fps, float(g.uniform(0.2, 0.7)), g):
            yield Frame(studio.shoot((cutout, shake)), rest(gesture))
        for share in ease(count):
            yield Frame(studio.shoot((cutout, (0.0, down * share))), moving(gesture, after))
        before = gesture


Held = tuple[U8, tuple[int, int, int, int], str | None]
"""A whole frame of a webcam, the box round its hand, and the gesture if it is enrolled."""


def frame_changes(studio: Studio, frames: Sequence[Held]) -> Iterator[Frame]:
    """Whole frames of a webcam with a hand in them: swung into view one by one, and held.

    The hand trembles within its box; the room and the person behind it stand still.
    """
    g = studio.generator
    here, before = studio.room, None
    for picture, (x, y, width, height), gesture in frames:
        weights = bell((x + width / 2, y + height / 2), (width * 0.6, height * 0.6))
        for share in ease(studio.count(float(g.uniform(0.3, 0.7)))):
            yield Frame(studio.shoot(room=_slide(here, picture, share)), moving(before, gesture))
        stay = studio.count(float(g.uniform(0.7, 1.4)))
        for shake in tremor(stay, studio.fps, float(g.uniform(0.3, 0.9)), g):
            yield Frame(studio.shoot(room=push(picture, weights, shake)), rest(gesture))
        here, before = picture, gesture
    for share in ease(studio.count(0.5)):
        yield Frame(studio.shoot(room=_slide(here, studio.room, share)), moving(before, None))


def frame_sways(studio: Studio, picture: U8, box: tuple[int, int, int, int]) -> Iterator[Frame]:
    """A whole frame of a webcam whose hand goes round without a rest, whatever it shows."""
    x, y, width, height = box
    weights = bell((x + width / 2, y + height / 2), (width * 0.8, height * 0.8))
    radius, rate = 0.2 * width, float(studio.generator.uniform(0.7, 1.5))
    for number in range(studio.count(6)):
        angle = 2 * np.pi * rate * number / studio.fps
        room = push(picture, weights, (radius * np.cos(angle), radius * np.sin(angle)))
        yield Frame(studio.shoot(room=room), NOTHING)


def _slide(start: U8, end: U8, share: float) -> U8:
    """From one picture to another by a swing of the camera."""
    column = round(WIDTH * share)
    return np.ascontiguousarray(np.hstack([start[:, column:], end[:, :column]]))
