"""Trials: the same random draws for every method, and what each makes of them."""

import math
import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from app.errors import Invalid
from app.pipeline.curve import accept_curve
from app.pipeline.trials import Trial, draw_trial
from benchmarks.recognition.methods import Ask, Method, Seen
from benchmarks.recognition.sets import PhotoSet

SHOTS = (1, 5, 20)
REJECTION_SHOTS = 5
Look = Mapping[str, Sequence[Seen]]
"""Method to what it saw in each photograph of a set."""


def accuracy(
    photos: PhotoSet, looks: Look, methods: Mapping[str, Method], trials: int, seed: int
) -> dict[str, dict[str, Any]]:
    """Forced choice; a missed hand is wrong.

    Returns:
        Method to number of shots to ``mean``, ``std`` and the accuracies ``per_group``; None for
        shots of which the set has too few. Further ``match_ms``, the median processor time of an
        answer once the hand is found, at the largest number of shots that the set allows.
    """
    figures: dict[str, dict[str, Any]] = {name: {} for name in methods}
    for shots in SHOTS:
        try:
            drawn = _draw(photos, shots, 0, trials, seed)
        except Invalid:
            for name in methods:
                figures[name][str(shots)] = None
            continue
        rights: dict[str, list[float]] = {name: [] for name in methods}
        groups: dict[str, dict[str, list[bool]]] = {name: {} for name in methods}
        for trial in drawn:
            enrolled = {name: _enrol(trial, shots, looks[name]) for name in methods}
            # Without groups, nobody is asked what somebody else has enrolled.
            taken = set().union(*(set(mine) for mine in enrolled.values()))
            asked = [i for i in trial.asked if i not in taken]
            for name, method in methods.items():
                ask = _learn(method, photos, looks[name], enrolled[name])
                right, spent = [], []
                for i in asked:
                    start = time.process_time()
                    answer = None if looks[name][i].hand is None else ask(looks[name][i].hand)
                    if answer is not None:
                        spent.append(time.process_time() - start)
                    right.append(answer is not None and answer.label == photos.labels[i])
                    if photos.groups is not None:
                        groups[name].setdefault(photos.groups[i], []).append(right[-1])
                rights[name].append(float(np.mean(right)))
                if spent:
                    figures[name]["match_ms"] = float(np.median(spent)) * 1000
        for name in methods:
            figures[name][str(shots)] = {
                "mean": float(np.mean(rights[name])),
                "std": float(np.std(rights[name])),
                "per_group": {g: float(np.mean(r)) for g, r in sorted(groups[name].items())},
            }
    return figures


def rejection(
    photos: PhotoSet, looks: Look, methods: Mapping[str, Method], trials: int, seed: int
) -> dict[str, dict[str, Any] | None]:
    """A third of the labels is left out: false accepts against misses, 5 shots."""
    left_out = max(1, len(set(photos.labels)) // 3)
    try:
        drawn = _draw(photos, REJECTION_SHOTS, left_out, trials, seed)
    except Invalid:
        return dict.fromkeys(methods)
    figures: dict[str, dict[str, Any] | None] = {}
    for name, method in methods.items():
        known: list[float] = []
        right: list[bool] = []
        unknown: list[float] = []
        for trial in drawn:
            enrolled = _enrol(trial, REJECTION_SHOTS, looks[name])
            ask = _learn(method, photos, looks[name], enrolled)
            for i in trial.asked:
                if i not in enrolled:
                    label, strangeness = _answer(ask, looks[name][i])
                    known.append(strangeness)
                    right.append(label == photos.labels[i])
            unknown += [_answer(ask, looks[name][i])[1] for i in trial.strangers]
        figures[name] = {"labels_left_out": left_out, **accept_curve(known, right, unknown)}
    return figures


def across(
    enrol: PhotoSet,
    ask: PhotoSet,
    looks: Mapping[str, Look],
    methods: Mapping[str, Method],
    trials: int,
    seed: int,
) -> dict[str, dict[str, float | None]]:
    """Enrol from one set, ask about another: person, room and camera are all unseen.

    Only labels of both sets. Returns method to number of shots to accuracy; None where a label has
    too few.
    """
    common = set(enrol.labels) & set(ask.labels)
    keep = [i for i, label in enumerate(enrol.labels) if label in common]
    asked = [i for i, label in enumerate(ask.labels) if label in common]
    least = min(enrol.labels.count(label) for label in common)
    figures: dict[str, dict[str, float | None]] = {
        name: {str(shots): None for shots in SHOTS} for name in methods
    }
    for shots in SHOTS:
        if shots > least:
            continue
        rng = np.random.default_rng((seed, shots))
        rights: dict[str, list[float]] = {name: [] for name in methods}
        for _ in range(trials):
            trial = draw_trial([enrol.labels[i] for i in keep], None, shots, 0, rng)
            for name, method in methods.items():
                seen = [looks[enrol.name][name][i] for i in keep]
                enrolled = _enrol(trial, shots, seen)
                answer = _learn(method, enrol, looks[enrol.name][name], [keep[i] for i in enrolled])
                right = [
                    _answer(answer, looks[ask.name][name][i])[0] == ask.labels[i] for i in asked
                ]
                rights[name].append(float(np.mean(right)))
        for name in methods:
            figures[name][str(shots)] = float(np.mean(rights[name]))
    return figures


def _draw(photos: PhotoSet, shots: int, left_out: int, trials: int, seed: int) -> list[Trial]:
    least = min(photos.labels.count(label) for label in set(photos.labels))
    if least <= shots:
        raise Invalid(f"a label has {least} photographs: more than {shots} are needed")
    rng = np.random.default_rng((seed, shots, left_out))
    return [draw_trial(photos.labels, photos.groups, shots, left_out, rng) for _ in range(trials)]


def _enrol(trial: Trial, shots: int, seen: Sequence[Seen]) -> list[int]:
    usable = [photo.hand is not None for photo in seen]
    return sorted(i for mine in trial.enrol(shots, usable).values() for i in mine)


def _learn(method: Method, photos: PhotoSet, seen: Sequence[Seen], enrolled: list[int]) -> Ask:
    found = [i for i in enrolled if seen[i].hand is not None]
    return method.learn([photos.labels[i] for i in found], [seen[i].hand for i in found])


def _answer(ask: Ask, seen: Seen) -> tuple[str | None, float]:
    if seen.hand is None:
        return None, math.inf
    return ask(seen.hand)
