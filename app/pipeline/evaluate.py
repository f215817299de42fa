"""Evaluate: how well the product's own pipeline tells labelled photographs apart.

In each trial some photographs a label are enrolled at random and the rest are recognised. Every
photograph takes the way of an enrolment: :func:`~app.pipeline.still.extract_template`.
"""

from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from app.config import PipelineSettings
from app.errors import ImageRefused, Invalid, NotFound, TooLarge
from app.pipeline.match import Gallery, Matched, PcaMatcher
from app.pipeline.still import extract_template
from app.pipeline.types import Extraction

SUFFIXES = frozenset((".jpg", ".jpeg", ".png", ".webp"))
UNKNOWN = "unknown"
"""Column of the confusion table for pictures that were rejected, or without a hand."""


class Photo(NamedTuple):
    """One photograph; ``hand`` is None when none was found, ``ms`` is the time that took."""

    path: Path
    label: str
    hand: Extraction | None
    ms: float


def find_images(directory: Path) -> dict[str, list[Path]]:
    """Pictures in ``directory/LABEL/``, sorted, by label.

    Raises:
        NotFound: no such folder.
        Invalid: no folder with pictures in it.
    """
    if not directory.is_dir():
        raise NotFound(f"no folder {directory}: a folder with LABEL/*.jpg is needed")
    labels = {
        folder.name: sorted(
            path
            for path in folder.iterdir()
            if path.suffix.lower() in SUFFIXES and path.is_file() and path.name[0] != "."
        )
        for folder in sorted(directory.iterdir())
        if folder.is_dir() and not folder.name.startswith(".")
    }
    labels = {label: paths for label, paths in labels.items() if paths}
    if not labels:
        raise Invalid(
            f"no pictures in {directory}: folders named by label with "
            f"{', '.join(sorted(SUFFIXES))} files are needed, such as {directory}/fist/1.jpg"
        )
    return labels


def load_photos(images: dict[str, list[Path]], settings: PipelineSettings) -> list[Photo]:
    """Find the hand in every picture; a picture without one stays, with ``hand`` None."""
    photos = []
    for label, paths in images.items():
        for path in paths:
            data = path.read_bytes()
            start = perf_counter()
            try:
                hand = extract_template(data, settings, whole=False)
            except (ImageRefused, TooLarge):
                hand = None
            photos.append(Photo(path, label, hand, (perf_counter() - start) * 1000))
    return photos


def evaluate(
    directory: Path,
    shots: int = 1,
    trials: int = 10,
    seed: int = 0,
    reject: bool = False,
    unknown: Path | None = None,
    settings: PipelineSettings | None = None,
) -> dict[str, Any]:
    """Measure the recognition on ``directory/LABEL/*.jpg``.

    Args:
        directory: The photographs.
        shots: Enrolled photographs a label and trial.
        trials: Random choices of them.
        seed: Of the choice; the same seed gives the same figures.
        reject: Let the matcher call a hand unknown. Off: forced choice.
        unknown: Folder of photographs, ``LABEL/*.jpg``, of labels that are not enrolled. With
            ``reject`` off all of them are accepted by definition.
        settings: Of the pipeline; None for the product's defaults.

    Returns:
        JSON-compatible, as in docs/protocol.md. A picture without a hand counts as wrong when it
        is asked about and is not enrolled when it is drawn for that, as long as its label has
        others.

    Raises:
        NotFound: no such folder.
        Invalid: no pictures, too few a label, or arguments out of bounds.
    """
    settings = settings or PipelineSettings()
    if shots < 1 or trials < 1:
        raise Invalid(f"{shots} shots and {trials} trials: at least 1 of each is needed")
    images = find_images(directory)
    few = {label: len(paths) for label, paths in images.items() if len(paths) <= shots}
    if few:
        listed = ", ".join(f"{label} ({count})" for label, count in few.items())
        raise Invalid(
            f"too few pictures for {shots} shots: {listed}; at least {shots + 1} a label are needed"
        )
    photos = load_photos(images, settings)
    strangers = []
    if unknown is not None:
        others = {k: v for k, v in find_images(unknown).items() if k not in images}
        if not others:
            raise Invalid(f"every label in {unknown} is enrolled: others are needed")
        strangers = load_photos(others, settings)

    rng = np.random.default_rng(seed)
    accuracies: list[float] = []
    confusion: dict[str, Counter[str]] = {label: Counter() for label in images}
    rejected = accepted_strangers = asked = 0
    times: list[float] = []
    for _ in range(trials):
        enrolled = _draw(photos, images, shots, rng)
        gallery = _gallery(photos[i] for i in sorted(enrolled))
        matcher = PcaMatcher.fit(gallery, settings.match)
        right = count = 0
        for index, photo in enumerate(photos):
            if index in enrolled:
                continue
            matched, ms = _ask(matcher, photo)
            times.append(ms)
            answer = _answer(matched, reject)
            confusion[photo.label][answer] += 1
            rejected += answer == UNKNOWN
            right += answer == photo.label
            count += 1
        asked += count
        accuracies.append(right / count)
        accepted_strangers += sum(
            _answer(_ask(matcher, photo)[0], reject) != UNKNOWN for photo in strangers
        )
    p50, p99 = np.percentile(times, (50, 99))
    return {
        "directory": str(directory),
        "labels": list(images),
        "images": len(photos),
        "no_hand": sum(photo.hand is None for photo in photos),
        "shots": shots,
        "trials": trials,
        "seed": seed,
        "reject": reject,
        "accuracy": {
            "mean": round(float(np.mean(accuracies)), 4),
            "std": round(float(np.std(accuracies)), 4),
        },
        "per_label": {
            label: round(row[label] / row.total(), 4) if row.total() else None
            for label, row in confusion.items()
        },
        "confusion": {label: dict(row) for label, row in confusion.items()},
        "rejected": round(rejected / asked, 4),
        "unknown_images": len(strangers),
        "unknown_accepted": (
            round(accepted_strangers / (len(strangers) * trials), 4) if strangers else None
        ),
        "ms_per_image": {"p50": round(float(p50), 3), "p99": round(float(p99), 3)},
    }


def _draw(
    photos: list[Photo], images: dict[str, list[Path]], shots: int, rng: np.random.Generator
) -> set[int]:
    """Indices of the enrolled photographs; those with a hand are preferred."""
    enrolled: set[int] = set()
    for label in images:
        mine = [i for i, photo in enumerate(photos) if photo.label == label]
        shuffled = [mine[k] for k in rng.permutation(len(mine))]
        shuffled.sort(key=lambda i: photos[i].hand is None)
        enrolled.update(shuffled[:shots])
    return enrolled


def _gallery(photos: Iterable[Photo]) -> Gallery:
    found = [(photo.label, photo.hand.template) for photo in photos if photo.hand is not None]
    if not found:
        raise Invalid("no hand was found in any of the pictures")
    return Gallery(tuple(label for label, _ in found), np.stack([t for _, t in found]))


def _ask(matcher: PcaMatcher, photo: Photo) -> tuple[Matched, float]:
    if photo.hand is None:
        return Matched(None, {}), photo.ms
    start = perf_counter()
    matched = matcher(photo.hand.views)
    return matched, photo.ms + (perf_counter() - start) * 1000


def _answer(matched: Matched, reject: bool) -> str:
    match = matched.match
    if match is None or (reject and not match.accepted):
        return UNKNOWN
    return match.gesture
