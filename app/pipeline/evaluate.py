"""Evaluate: how well the product's own pipeline tells labelled photographs apart.

In each trial some photographs a label are enrolled at random and others are recognised. Every
photograph takes the way of an enrolment: :func:`~app.pipeline.still.extract_template`. Who is drawn
is up to :mod:`app.pipeline.trials`.
"""

from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from app.config import PipelineSettings
from app.errors import ImageRefused, Invalid, NotFound, TooLarge
from app.pipeline.curve import NO_HAND, accept_curve, no_curve
from app.pipeline.match import Gallery, Matched, PcaMatcher
from app.pipeline.still import extract_template
from app.pipeline.trials import draw_trial, groups_of
from app.pipeline.types import Extraction

SUFFIXES = frozenset((".jpg", ".jpeg", ".png", ".webp", ".heic", ".heif", ".avif"))
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
    group: str | None = None,
    holdout_labels: int = 0,
) -> dict[str, Any]:
    """Measure the recognition on ``directory/LABEL/*.jpg``.

    Args:
        directory: The photographs.
        shots: Enrolled photographs a label and trial.
        trials: Random choices of them.
        seed: Of the choice; the same seed gives the same figures.
        reject: Let the matcher call a hand unknown. Off: forced choice.
        unknown: Folder of photographs, ``LABEL/*.jpg``; those of labels that ``directory`` has,
            too, are left out. With ``reject`` off all in which a hand is found are accepted by
            definition.
        settings: Of the pipeline; None for the product's defaults.
        group: Regular expression that finds a photograph's room or person in its file name, see
            :func:`~app.pipeline.trials.groups_of`. In each trial one half of the groups is
            enrolled from and the other half asked about, the unknown too.
        holdout_labels: So many labels, drawn anew in each trial, are not enrolled; their
            photographs count as unknown.

    Returns:
        JSON-compatible, as in docs/protocol.md. A picture without a hand counts as wrong when it
        is asked about and is not enrolled when it is drawn for that, as long as its label has
        others.

    Raises:
        NotFound: no such folder.
        Invalid: no pictures, too few a label, or arguments out of bounds.
    """
    settings = settings or PipelineSettings()
    images = find_images(directory)
    _check(images, shots, trials, holdout_labels)
    others = _others(unknown, images)
    paths = [path for listed in images.values() for path in listed]
    groups = None if group is None else groups_of(paths, group)
    photos = load_photos(images, settings)
    strangers = load_photos(others, settings)
    apart = None if group is None else groups_of((photo.path for photo in strangers), group)

    rng = np.random.default_rng(seed)
    labels, usable = [p.label for p in photos], [p.hand is not None for p in photos]
    tally = Tally(list(images))
    for _ in range(trials):
        trial = draw_trial(labels, groups, shots, holdout_labels, rng)
        enrolled = {i for mine in trial.enrol(shots, usable).values() for i in mine}
        matcher = PcaMatcher.fit(_gallery(photos[i] for i in sorted(enrolled)), settings.match)
        tally.next_trial()
        for i in trial.asked:
            if i not in enrolled:
                matched, ms = _ask(matcher, photos[i])
                tally.known(photos[i], matched, ms, reject, None if groups is None else groups[i])
        asked = [photos[i] for i in trial.strangers]
        asked += [p for k, p in enumerate(strangers) if not apart or apart[k] not in trial.closed]
        for photo in asked:
            tally.unknown(_ask(matcher, photo)[0], reject)
    return {
        "directory": str(directory),
        "labels": list(images),
        "images": len(photos),
        "no_hand": usable.count(False),
        "shots": shots,
        "trials": trials,
        "seed": seed,
        "reject": reject,
        "group": group,
        "groups": None if groups is None else len(set(groups)),
        "holdout_labels": holdout_labels,
        "unknown_images": len(strangers),
        **tally.figures(),
    }


def _check(images: dict[str, list[Path]], shots: int, trials: int, holdout_labels: int) -> None:
    if shots < 1 or trials < 1:
        raise Invalid(f"{shots} shots and {trials} trials: at least 1 of each is needed")
    few = {label: len(paths) for label, paths in images.items() if len(paths) <= shots}
    if few:
        listed = ", ".join(f"{label} ({count})" for label, count in few.items())
        raise Invalid(
            f"too few pictures for {shots} shots: {listed}; at least {shots + 1} a label are needed"
        )
    if not 0 <= holdout_labels < len(images):
        raise Invalid(
            f"{holdout_labels} of {len(images)} labels cannot be left out: "
            f"0 to {len(images) - 1} are possible"
        )


def _others(unknown: Path | None, images: dict[str, list[Path]]) -> dict[str, list[Path]]:
    """Pictures of ``unknown`` whose labels are never enrolled."""
    if unknown is None:
        return {}
    others = {k: v for k, v in find_images(unknown).items() if k not in images}
    if not others:
        raise Invalid(f"every label in {unknown} is enrolled: others are needed")
    return others


class Tally:
    """What became of the photographs asked about, over all trials."""

    def __init__(self, labels: list[str]) -> None:
        self._confusion: dict[str, Counter[str]] = {label: Counter() for label in labels}
        self._groups: dict[str, list[bool]] = {}
        self._trials: list[list[bool]] = []
        self._times: list[float] = []
        self._strange: list[float] = []
        self._nearest_right: list[bool] = []
        self._strangers: list[float] = []
        self._strangers_accepted = 0

    def next_trial(self) -> None:
        """What follows belongs to a new trial."""
        self._trials.append([])

    def known(
        self, photo: Photo, matched: Matched, ms: float, reject: bool, group: str | None
    ) -> None:
        """A photograph of an enrolled label was asked about."""
        answer = _answer(matched, reject)
        self._confusion[photo.label][answer] += 1
        self._trials[-1].append(answer == photo.label)
        if group is not None:
            self._groups.setdefault(group, []).append(answer == photo.label)
        self._times.append(ms)
        self._strange.append(_strangeness(matched))
        self._nearest_right.append(_answer(matched, reject=False) == photo.label)

    def unknown(self, matched: Matched, reject: bool) -> None:
        """A photograph of a label that is not enrolled was asked about."""
        self._strangers_accepted += _answer(matched, reject) != UNKNOWN
        self._strangers.append(_strangeness(matched))

    def figures(self) -> dict[str, Any]:
        """The measured part of what :func:`evaluate` returns."""
        accuracies = [float(np.mean(trial)) for trial in self._trials]
        rejected = sum(row[UNKNOWN] for row in self._confusion.values())
        p50, p99 = np.percentile(self._times, (50, 99))
        return {
            "asked": len(self._strange),
            "unknown_asked": len(self._strangers),
            "accuracy": {
                "mean": round(float(np.mean(accuracies)), 4),
                "std": round(float(np.std(accuracies)), 4),
            },
            "per_label": {
                label: round(row[label] / row.total(), 4) if row.total() else None
                for label, row in self._confusion.items()
            },
            "per_group": {
                group: round(float(np.mean(right)), 4)
                for group, right in sorted(self._groups.items())
            }
            or None,
            "confusion": {
                label: {answer: n for answer, n in row.items() if n}
                for label, row in self._confusion.items()
            },
            "rejected": round(rejected / len(self._strange), 4),
            "unknown_accepted": (
                round(self._strangers_accepted / len(self._strangers), 4)
                if self._strangers
                else None
            ),
            **(
                accept_curve(self._strange, self._nearest_right, self._strangers)
                if self._strangers
                else no_curve()
            ),
            "ms_per_image": {"p50": round(float(p50), 3), "p99": round(float(p99), 3)},
        }


def _gallery(photos: Iterable[Photo]) -> Gallery:
    found = [(photo.label, photo.hand) for photo in photos if photo.hand is not None]
    if not found:
        raise Invalid("no hand was found in any of the pictures")
    return Gallery.of(found)


def _ask(matcher: PcaMatcher, photo: Photo) -> tuple[Matched, float]:
    if photo.hand is None:
        return Matched(None, {}), photo.ms
    start = perf_counter()
    matched = matcher.match_photo(photo.hand)
    return matched, photo.ms + (perf_counter() - start) * 1000


def _answer(matched: Matched, reject: bool) -> str:
    match = matched.match
    if match is None or (reject and not match.accepted):
        return UNKNOWN
    return match.gesture


def _strangeness(matched: Matched) -> float:
    return NO_HAND if matched.match is None else matched.match.strangeness
