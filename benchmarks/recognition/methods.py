"""One face for the product in some mode and for its peer: see a photograph, learn, answer."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np

from app.config import PipelineSettings
from app.errors import FrameRefused, ImageRefused, TooLarge
from app.pipeline import Gallery, PcaMatcher, Pipeline, extract_template
from benchmarks.recognition.peer import Peer

BONES = tuple((0 if i % 4 == 1 else i - 1, i) for i in range(1, 21))
"""From joint to joint: each finger's first bone begins at the wrist, 0."""


class Seen(NamedTuple):
    """A photograph as a method sees it; ``hand`` is None when it finds none."""

    hand: Any
    wall_ms: float
    cpu_ms: float


class Answer(NamedTuple):
    """The nearest label, and how far away it is: a rising measure for the curve."""

    label: str
    strangeness: float


Ask = Callable[[Any], Answer]


class Method(Protocol):
    """What is compared."""

    def see(self, path: Path) -> Seen:
        """Find the hand in a file; the time counts from its bytes."""
        ...

    def follow(self, before: Path, path: Path) -> Seen:
        """Find the hand in ``path``, a video's frame right after ``before``."""
        ...

    def learn(self, labels: Sequence[str], hands: Sequence[Any]) -> Ask:
        """Enrol hands and get what names others."""
        ...


class Product:
    """Farhand with the given settings."""

    def __init__(self, settings: PipelineSettings) -> None:
        self._settings = settings

    def see(self, path: Path) -> Seen:
        """As an enrolment does, cut-off hands included."""
        data = path.read_bytes()
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            hand = extract_template(data, self._settings, whole=False)
        except (ImageRefused, TooLarge):
            hand = None
        return Seen(hand, *_since(wall, cpu))

    def follow(self, before: Path, path: Path) -> Seen:
        """Through a new pipeline, up to the box round the hand."""
        pipeline = Pipeline(self._settings, PcaMatcher.fit(Gallery.empty(), self._settings.match))
        try:
            for number in range(2):
                pipeline(before.read_bytes(), seq=number, now=number / 30)
            data = path.read_bytes()
            wall, cpu = time.perf_counter(), time.process_time()
            hand = pipeline(data, seq=2, now=2 / 30).roi
            return Seen(hand, *_since(wall, cpu))
        except FrameRefused:
            return Seen(None, 0.0, 0.0)

    def learn(self, labels: Sequence[str], hands: Sequence[Any]) -> Ask:
        """Fit the product's matcher."""
        gallery = Gallery.of(list(zip(labels, hands, strict=True)))
        matcher = PcaMatcher.fit(gallery, self._settings.match)

        def ask(hand: Any) -> Answer:
            match = matcher.match_photo(hand).match
            assert match is not None
            return Answer(match.gesture, match.strangeness)

        return ask


class Landmarks:
    """MediaPipe Hands; the directions of the bones, and the nearest neighbour."""

    def __init__(self, peer: Peer) -> None:
        self._peer = peer

    def see(self, path: Path) -> Seen:
        """Ask the other process; the time is taken there."""
        return _landmarks(self._peer.look(path))

    def follow(self, before: Path, path: Path) -> Seen:
        """The same with the hand followed from the picture before."""
        return _landmarks(self._peer.look(path, before))

    def learn(self, labels: Sequence[str], hands: Sequence[Any]) -> Ask:
        """Keep them all."""
        rows, names = np.stack(hands), list(labels)

        def ask(hand: Any) -> Answer:
            squares = ((rows - hand) ** 2).sum(axis=1)
            nearest = int(squares.argmin())
            return Answer(names[nearest], float(np.sqrt(squares[nearest] / len(BONES))))

        return ask


def bone_directions(landmarks: Sequence[Sequence[float]]) -> np.ndarray[Any, np.dtype[np.float32]]:
    """21 points to (60,): the unit vectors of the 20 bones."""
    points = np.asarray(landmarks, np.float32)
    bones = points[[end for _, end in BONES]] - points[[start for start, _ in BONES]]
    bones /= np.maximum(np.linalg.norm(bones, axis=1, keepdims=True), 1e-6)
    directions: np.ndarray[Any, np.dtype[np.float32]] = bones.ravel()
    return directions


def _landmarks(found: dict[str, Any]) -> Seen:
    hand = None if found["landmarks"] is None else bone_directions(found["landmarks"])
    return Seen(hand, found["wall_ms"], found["cpu_ms"])


def _since(wall: float, cpu: float) -> tuple[float, float]:
    return (time.perf_counter() - wall) * 1000, (time.process_time() - cpu) * 1000
