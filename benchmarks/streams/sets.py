"""Three operators: which gestures are enrolled, what is shown, and in which rooms.

``drawn`` needs no photographs. ``digits`` and ``webcam`` need the folder that
``shared/data/README.md`` describes, and show only people and rooms that training kept aside
(``training/photos.py``), enrolled from the others.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from app.config import PipelineSettings
from app.errors import ImageRefused
from app.gestures.hand.poses import POSES
from app.pipeline import Gallery, extract_template
from benchmarks.pipeline_speed import starter_gallery
from benchmarks.streams import acts
from benchmarks.streams.hands import OTHERS, Drawn, photo_cutout
from benchmarks.streams.scene import (
    U8,
    Cutout,
    Frame,
    Studio,
    fill,
    flicker,
    plain_room,
    steady,
    steps,
)

SHOTS = 5
"""Photographs enrolled a sign."""
ORDER = (
    *("other", "turning", "wave", "objects", "other"),
    *("empty", "turning", "other", "wave", "objects"),
)
"""Acts of a stream without any gesture."""


class Operator(ABC):
    """Gestures that are enrolled, and streams that show them or do not."""

    def __init__(self, rooms: list[U8]) -> None:
        self.rooms = rooms

    @abstractmethod
    def gallery(self, settings: PipelineSettings) -> Gallery:
        """The enrolled templates."""

    @abstractmethod
    def other(self, studio: Studio) -> Iterator[Frame]:
        """Something that is held still and is not enrolled."""

    @abstractmethod
    def wave(self, studio: Studio) -> Iterator[Frame]:
        """A hand that never rests."""

    @abstractmethod
    def changes(self, studio: Studio) -> Iterator[Frame]:
        """Some enrolled gestures one after the other."""

    def studio(self, seed: int, number: int, fps: float) -> Studio:
        """The room for act ``number``; every second one is a plain wall if there are no others."""
        generator = np.random.default_rng([seed, number])
        plain = not self.rooms or generator.random() < 0.4
        room = (
            plain_room(generator) if plain else self.rooms[int(generator.integers(len(self.rooms)))]
        )
        draw = generator.random()
        light = steady if draw < 0.6 else flicker(generator) if draw < 0.8 else steps(generator)
        return Studio(generator, room, fps, light, noise=float(generator.uniform(0.5, 3.0)))

    def nothing(self, seconds: float, seed: int, fps: float = 30.0) -> Iterator[Frame]:
        """A stream of that length without any enrolled gesture.

        Of every ten acts three are other hands at rest, two moving hands, two objects, two moving
        people, and one the empty room.
        """
        left, number = round(seconds * fps), 0
        while left > 0:
            studio = self.studio(seed, number, fps)
            for frame in self._act(ORDER[number % len(ORDER)], studio):
                yield frame
                left -= 1
                if left == 0:
                    return
            number += 1

    def _act(self, name: str, studio: Studio) -> Iterator[Frame]:
        if name == "objects":
            return acts.objects(studio, self.rooms or [studio.room])
        act = {"other": self.other, "wave": self.wave, "turning": acts.turning, "empty": acts.empty}
        return act[name](studio)

    def transitions(self, count: int, seed: int, fps: float = 30.0) -> Iterator[Frame]:
        """A stream with at least so many changes from one enrolled gesture to another."""
        done, number = 0, 0
        while done < count:
            last = None
            for frame in self.changes(self.studio(seed + 1, number, fps)):
                label = frame.label
                if label.kind == "moving" and label != last and label.before and label.after:
                    done += 1
                last = label
                yield frame
            number += 1


class DrawnOperator(Operator):
    """The ten starter gestures, shown by the drawn hand."""

    def gallery(self, settings: PipelineSettings) -> Gallery:
        """The starter set."""
        return starter_gallery(99)

    def other(self, studio: Studio) -> Iterator[Frame]:
        """A pose of no gesture."""
        name = str(studio.generator.choice(list(OTHERS)))
        return acts.drawn_passes(studio, Drawn.of(studio.generator), name, None)

    def wave(self, studio: Studio) -> Iterator[Frame]:
        """Playing fingers, or a gesture that goes round."""
        person = Drawn.of(studio.generator)
        if studio.generator.random() < 0.5:
            return acts.fingers_play(studio, person)
        return acts.hand_waves(
            studio, person.cut(person.pose(str(studio.generator.choice(list(POSES)))))
        )

    def changes(self, studio: Studio) -> Iterator[Frame]:
        """Six of the ten."""
        names = studio.generator.permutation(list(POSES))[:6]
        return acts.drawn_changes(studio, Drawn.of(studio.generator), [str(n) for n in names])


def _enrol(paths: dict[str, list[Path]], settings: PipelineSettings, seed: int) -> Gallery:
    """The first :data:`SHOTS` photographs a label, in an order drawn by lot, that show a hand."""
    labels: list[str] = []
    templates: list[U8] = []
    generator = np.random.default_rng(seed)
    for label, files in paths.items():
        for number in generator.permutation(len(files)):
            if labels.count(label) == SHOTS:
                break
            try:
                made = extract_template(files[number].read_bytes(), settings, whole=False)
            except ImageRefused:
                continue
            labels.append(label)
            templates.append(made.template)
    return Gallery(tuple(labels), np.stack(templates))


class DigitsOperator(Operator):
    """The digit signs 0 to 5 of many people; 6 to 9 are not enrolled."""

    def __init__(self, photos: Path, rooms: list[U8]) -> None:
        super().__init__(rooms)
        from training.photos import choose, digit_hands

        self._files: dict[str, list[Path]] = {}
        for path in choose(photos / "digits", held=False):
            if path.parent.name <= "5":
                self._files.setdefault(path.parent.name, []).append(path)
        hands = digit_hands(photos, held=True)
        self._known = [hand for hand in hands if hand.label <= "5"]
        self._other = [hand for hand in hands if hand.label > "5"]

    def gallery(self, settings: PipelineSettings) -> Gallery:
        """Five photographs a sign, 0 to 5."""
        return _enrol(self._files, settings, 0)

    def _cut(self, studio: Studio, known: bool) -> tuple[Cutout, str]:
        hands = self._known if known else self._other
        hand = hands[int(studio.generator.integers(len(hands)))]
        return photo_cutout(hand.colour, hand.cover, studio.generator), hand.label

    def other(self, studio: Studio) -> Iterator[Frame]:
        """A sign from 6 to 9."""
        return acts.hand_passes(studio, self._cut(studio, False)[0], None)

    def wave(self, studio: Studio) -> Iterator[Frame]:
        """Any sign that goes round."""
        return acts.hand_waves(studio, self._cut(studio, bool(studio.generator.random() < 0.5))[0])

    def changes(self, studio: Studio) -> Iterator[Frame]:
        """Six signs, of six people."""
        hands: list[tuple[Cutout, str | None]] = []
        while len(hands) < 6:
            hand = self._cut(studio, True)
            if not hands or hands[-1][1] != hand[1]:
                hands.append(hand)
        return acts.photo_changes(studio, hands)


class WebcamOperator(Operator):
    """One, two and five fingers of the man with the laptop; fist, three and four are not enrolled.

    Enrolled in some rooms, shown in others, face and room in view.
    """

    KNOWN = ("1", "2", "5")

    def __init__(self, photos: Path, rooms: list[U8], boxes: Path) -> None:
        super().__init__(rooms)
        from training.photos import choose, hand_boxes

        self._files: dict[str, list[Path]] = {}
        for path in choose(photos / "webcam-box", held=False):
            if path.parent.name in self.KNOWN:
                self._files.setdefault(path.parent.name, []).append(path)
        places = hand_boxes(photos, boxes)
        self._shown: list[tuple[Path, tuple[int, int, int, int], str]] = []
        for path in choose(photos / "webcam-full", held=True):
            box = places.get(f"{path.parent.name}/{path.stem}")
            if box is not None:
                self._shown.append((path, box, path.parent.name))

    def gallery(self, settings: PipelineSettings) -> Gallery:
        """Five photographs a sign."""
        return _enrol(self._files, settings, 0)

    def _frame(self, studio: Studio, known: bool) -> acts.Held:
        some = [one for one in self._shown if (one[2] in self.KNOWN) == known]
        path, (x, y, width, height), label = some[int(studio.generator.integers(len(some)))]
        picture = np.asarray(cv2.imread(str(path)), np.uint8)
        scale = 640 / picture.shape[1]
        box = (round(x * scale), round(y * scale), round(width * scale), round(height * scale))
        return fill(picture), box, label if known else None

    def other(self, studio: Studio) -> Iterator[Frame]:
        """A fist, three or four fingers."""
        return acts.frame_changes(studio, [self._frame(studio, False)])

    def wave(self, studio: Studio) -> Iterator[Frame]:
        """Any sign that goes round."""
        picture, box, _ = self._frame(studio, bool(studio.generator.random() < 0.5))
        return acts.frame_sways(studio, picture, box)

    def changes(self, studio: Studio) -> Iterator[Frame]:
        """Six frames."""
        frames: list[acts.Held] = []
        while len(frames) < 6:
            frame = self._frame(studio, True)
            if not frames or frames[-1][2] != frame[2]:
                frames.append(frame)
        return acts.frame_changes(studio, frames)


def make(name: str, photos: Path, boxes: Path) -> Operator:
    """The operator of that name: ``drawn``, ``digits`` or ``webcam``.

    Without the photographs ``drawn`` has plain walls only.
    """
    rooms: list[U8] = []
    if photos.is_dir():
        from training.photos import backgrounds

        rooms = [fill(part) for part in backgrounds(photos, boxes, held=True)]
    match name:
        case "drawn":
            return DrawnOperator(rooms)
        case "digits":
            return DigitsOperator(photos, rooms)
        case "webcam":
            return WebcamOperator(photos, rooms, boxes)
    raise ValueError(f"there is no operator {name!r}; there are drawn, digits and webcam")
