"""Mix-ups: how often each gesture is taken for each other one, by the gallery's own samples.

Every sample is shown to the real matcher with itself left out, and the same rules decide: taken for
a gesture, or refused. Samples of one burst resemble each other more than what will be shown later,
so the counts flatter; which two gestures are near one another they tell all the same.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from app.pipeline.confusion import LIKELY
from app.pipeline.match import PcaMatcher

MOST_ASKED = 2000
"""Samples that are shown; more are thinned evenly."""

Level = Literal["mistaken", "undecided", "near"]


class Answer(NamedTuple):
    """What one sample was taken for.

    Attributes:
        gesture: Whose sample it is.
        taken_for: The gesture; None: refused.
        torn: The other gesture, where it was refused because two were almost equally close.
        own: Distance to its own gesture.
        distances: To each of the others.
    """

    gesture: str
    taken_for: str | None
    torn: str | None
    own: float
    distances: dict[str, float]


class Worst(NamedTuple):
    """The two gestures that are nearest to being one.

    Attributes:
        shown: The one that is taken for the other.
        other: The other one.
        level: ``mistaken``: it was taken for it; ``undecided``: it was refused because both were
            almost equally close; ``near``: neither happened, but it is nearly as near as its own.
        times: How often, of ``asked``.
        asked: Samples of ``shown`` that were tried.
        teach: The one of both that is worth teaching again: fewer of its samples were known.
    """

    shown: str
    other: str
    level: Level
    times: int
    asked: int
    teach: str


@dataclass(frozen=True)
class MixUps:
    """The table.

    Attributes:
        labels: The gestures; rows and columns.
        counts: (n, n); ``counts[i][j]`` samples of ``i`` were taken for ``j``.
        rejected: (n,); samples of ``i`` that were taken for nothing.
        untested: Gestures with a single sample: nothing of them is left to be compared with.
        worst: None when all are told apart clearly.
    """

    labels: tuple[str, ...]
    counts: list[list[int]]
    rejected: list[int]
    untested: tuple[str, ...]
    worst: Worst | None


def asked_of(matcher: PcaMatcher) -> list[int]:
    """The templates to be shown: all whose gesture has another one, thinned where there are many.

    Returns:
        Indices into ``matcher.templates``.
    """
    sizes = {label: number + 1 for label, number in matcher.templates}
    asked = [i for i, (label, _) in enumerate(matcher.templates) if sizes[label] > 1]
    at = np.unique(np.linspace(0, len(asked) - 1, min(len(asked), MOST_ASKED)).astype(np.intp))
    return [asked[number] for number in at] if asked else []


def answer(matcher: PcaMatcher, index: int) -> Answer:
    """Show one template to the matcher, itself left out."""
    label = matcher.templates[index][0]
    match, distances, look = matcher.without(index)
    assert match is not None and look is not None  # its gesture has another template
    others = {name: distance for name, distance in distances.items() if name != label}
    torn = None
    if match.cause == "low_margin":
        torn = look.second if match.gesture == label else match.gesture
    return Answer(label, match.gesture if match.accepted else None, torn, distances[label], others)


def try_all(
    matcher: PcaMatcher,
    labels: Sequence[str],
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> MixUps:
    """Show all that is to be shown, and count the answers.

    Args:
        matcher: Of the gallery.
        labels: All gestures that are matched, in the order of the table.
        progress: Told how many samples were shown, of how many; what it raises ends the work.
    """
    asked = asked_of(matcher)
    answers = []
    for done, index in enumerate(asked):
        progress(done, len(asked))
        answers.append(answer(matcher, index))
    progress(len(asked), len(asked))
    return tally(labels, answers)


def tally(labels: Sequence[str], answers: Sequence[Answer]) -> MixUps:
    """Count the answers.

    Args:
        labels: All gestures that are matched, in the order of the table.
        answers: Of the samples that were shown.
    """
    place = {label: number for number, label in enumerate(labels)}
    counts = [[0] * len(labels) for _ in labels]
    rejected = [0] * len(labels)
    for one in answers:
        row = place[one.gesture]
        if one.taken_for is None:
            rejected[row] += 1
        else:
            counts[row][place[one.taken_for]] += 1
    tested = {one.gesture for one in answers}
    untested = tuple(label for label in labels if label not in tested)
    return MixUps(tuple(labels), counts, rejected, untested, _worst(answers))


def _worst(answers: Sequence[Answer]) -> Worst | None:
    of: dict[str, list[Answer]] = {}
    for one in answers:
        of.setdefault(one.gesture, []).append(one)
    known = {
        label: sum(one.taken_for == label for one in mine) / len(mine) for label, mine in of.items()
    }
    found: list[tuple[tuple[float, float, float], Worst]] = []
    for shown, mine in of.items():
        for other in mine[0].distances:
            mistaken = sum(one.taken_for == other for one in mine)
            torn = sum(one.torn == other for one in mine)
            nearness = float(np.median([one.own / max(one.distances[other], 1e-9) for one in mine]))
            if not mistaken and not torn and nearness < LIKELY:
                continue
            level: Level = "mistaken" if mistaken else "undecided" if torn else "near"
            teach = min(shown, other, key=lambda label: known.get(label, 0.0))
            rank = (mistaken / len(mine), torn / len(mine), nearness)
            found.append((rank, Worst(shown, other, level, mistaken or torn, len(mine), teach)))
    return max(found, key=lambda pair: pair[0])[1] if found else None
