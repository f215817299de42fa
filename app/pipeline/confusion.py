"""Confusion: which gestures are likely to be taken for one another, and what would help.

Every sample is held against all the others as if it had just been shown: how far is the nearest
sample of each other gesture, and, leaving the sample itself out, of its own?
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from app.config import MatchSettings
from app.pipeline.match import Gallery, PcaMatcher
from app.pipeline.palm import Palm, PalmFinder, arm_side
from app.pipeline.quality import Finding
from app.pipeline.types import U8, Side

F64 = NDArray[np.float64]
Level = Literal["likely", "possible"]

SAMPLES = 8
"""Of one gesture that are compared; more are thinned evenly."""
MOST = 1200
"""Samples that are compared in all; with many gestures fewer of each."""
OWN = 0.9
"""Distance between two samples of one gesture, in parts of the largest accepted distance, where a
gesture has only one. The nearest of five samples of a digit sign is at 0.64 in the median, and
nearer than any single one."""
LEAST_OWN = 0.45
"""The same when the samples are more alike than what will be shown later: frames of one burst."""
LIKELY, POSSIBLE = 0.9, 0.7
"""Strengths. On the digit signs a likely pair is mixed up ten times as often as the others, with
one enrolled photo in 40% of the cases, and a possible one five times as often."""
FEW = 4
"""Samples; with fewer more would help."""
RINGS = 1.75, 2.1, 2.45
"""Palm radii from the palm's centre, where only stretched fingers are; the palm's circle may lie
near the wrist."""
BUNDLE = 0.95
"""Palm radii along a ring; wider than one finger."""


class Confusion(NamedTuple):
    """One gesture that may be taken for another.

    Attributes:
        gesture: Index of the one shown.
        other: Index of the one that it may be taken for.
        distance: From the nearest sample of the one to the nearest of the other.
        own: From a sample to the nearest other one of the same gesture, in the median; None with a
            single sample.
        strength: ``own / distance``, at most 1: with 1 the other gesture is as near as its own.
        level: In a word.
        advice: What would help.
    """

    gesture: int
    other: int
    distance: float
    own: float | None
    strength: float
    level: Level
    advice: tuple[Finding, ...]


@dataclass(frozen=True)
class Comparison:
    """All gestures held against one another.

    Attributes:
        threshold: Largest distance at which a match is accepted.
        distance: (n, n); row: the gesture shown; nan on the diagonal and where nothing was asked.
        own: (n,); nan with a single sample and where nothing was asked.
        confusions: Strongest first.
    """

    threshold: float
    distance: F64
    own: F64
    confusions: tuple[Confusion, ...]


def compare(
    gestures: Sequence[tuple[str, U8]],
    settings: MatchSettings,
    threshold: float,
    asked: Sequence[int] | None = None,
) -> Comparison:
    """Hold gestures against one another.

    Args:
        gestures: Name and (n, 80, 60) templates of each; at least one template.
        settings: Of the matcher.
        threshold: Largest distance at which a match is accepted.
        asked: Indices of the gestures to be compared with all others; None for all.

    Takes about 2 ms for every sample that is asked about, and as long as fitting the matcher.
    """
    count = len(gestures)
    most = max(1, min(SAMPLES, MOST // max(count, 1)))
    thinned = [_thinned(templates, most) for _, templates in gestures]
    distance = np.full((count, count), np.nan)
    own = np.full(count, np.nan)
    rows = range(count) if asked is None else asked
    if count:
        # Each sample is a gesture of its own, so that the matcher tells the distance to each.
        labels = tuple(f"{g:04}.{s:04}" for g, part in enumerate(thinned) for s in range(len(part)))
        gallery = Gallery(labels, np.concatenate(thinned))
        matcher = PcaMatcher.fit(gallery, settings.model_copy(update={"calibrate": False}))
        owner = np.repeat(np.arange(count), [len(part) for part in thinned])
        for row in rows:
            distance[row], own[row] = _held_against(matcher, labels, owner, row, thinned[row])
    found = [
        _confusion(gestures, row, other, distance[row, other], own[row], threshold)
        for row in rows
        for other in range(count)
        if other != row
    ]
    kept = sorted((one for one in found if one is not None), key=lambda one: -one.strength)
    return Comparison(threshold, distance, own, tuple(kept))


def _thinned(templates: U8, most: int) -> U8:
    at = np.unique(np.linspace(0, len(templates) - 1, min(len(templates), most)).astype(np.intp))
    return templates[at]


def _held_against(
    matcher: PcaMatcher, labels: tuple[str, ...], owner: NDArray[np.intp], row: int, samples: U8
) -> tuple[F64, float]:
    """Distance to every other gesture, and to its own: (n,) and one number."""
    first = int(np.searchsorted(owner, row))
    nearest, own = [], []
    for number, template in enumerate(samples):
        by_label = matcher.match_template(template).distances
        table = np.array([by_label[label] for label in labels])
        table[first + number] = np.inf
        to_each = np.full(int(owner[-1]) + 1, np.inf)
        np.minimum.at(to_each, owner, table)
        own.append(to_each[row])
        to_each[row] = np.nan
        nearest.append(to_each)
    return np.min(nearest, axis=0), float(np.median(own)) if len(samples) > 1 else np.nan


def _confusion(
    gestures: Sequence[tuple[str, U8]],
    row: int,
    other: int,
    distance: float,
    own: float,
    threshold: float,
) -> Confusion | None:
    expected = OWN * threshold if np.isnan(own) else max(own, LEAST_OWN * threshold)
    strength = min(1.0, expected / max(distance, 1e-9))
    if strength < POSSIBLE:
        return None
    level: Level = "likely" if strength >= LIKELY else "possible"
    return Confusion(
        row,
        other,
        float(distance),
        None if np.isnan(own) else float(own),
        float(strength),
        level,
        _advice(gestures[row], gestures[other], level),
    )


def _advice(one: tuple[str, U8], other: tuple[str, U8], level: Level) -> tuple[Finding, ...]:
    """What would tell two gestures apart better."""
    (name, templates), (other_name, other_templates) = one, other
    fingers, bundled = fingers_shown(templates[len(templates) // 2])
    other_fingers, other_bundled = fingers_shown(other_templates[len(other_templates) // 2])
    found = []
    if len(templates) < FEW:
        found.append(
            Finding(
                "add_photos",
                f"add 3 more photos of {name}, the hand turned a little differently in each",
            )
        )
    if bundled or other_bundled:
        which = name if bundled else other_name
        found.append(Finding("spread_fingers", f"spread the fingers when showing {which}"))
    if fingers == other_fingers and fingers <= 1:
        found.append(
            Finding("show_thumb", f"stretch the thumb away from the hand when showing {name}")
        )
    if level == "likely" or not found:
        shown = ", with another number of fingers stretched" if fingers == other_fingers else ""
        found.append(
            Finding("another_sign", f"choose another sign for {name} or {other_name}{shown}")
        )
    return tuple(found)


def fingers_shown(template: U8) -> tuple[int, bool]:
    """Stretched fingers of an (80, 60) template, and whether several are held together.

    Counted where circles round the palm's centre leave the background for the hand, the side with
    the wrist left out; the circle that crosses most counts. A rough guess, good enough for advice.
    """
    palm = PalmFinder()(np.ascontiguousarray(template))
    if not palm.found:
        return 0, False
    side = arm_side(palm.piece, 0.25 * palm.radius)
    return max((_crossed(palm, side, ring) for ring in RINGS), key=lambda seen: seen[0])


def _crossed(palm: Palm, side: Side | None, ring: float) -> tuple[int, bool]:
    """Fingers that a circle of ``ring`` palm radii crosses, and whether one is as wide as two."""
    angles = np.arange(360) * (np.pi / 180)
    columns = np.rint(palm.x + ring * palm.radius * np.cos(angles)).astype(int)
    rows = np.rint(palm.y + ring * palm.radius * np.sin(angles)).astype(int)
    height, width = palm.piece.shape
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    on = np.zeros(360, np.uint8)
    on[inside] = palm.piece[rows[inside], columns[inside]]
    middle = {"right": 0, "bottom": 90, "left": 180, "top": 270}.get(side or "")
    if middle is not None:
        on[np.arange(middle - 45, middle + 45) % 360] = 0
    if on.all() or not on.any():
        return 0, bool(on.any())
    turned = np.roll(on, -int(np.argmin(on)))
    count, _, stats, _ = cv2.connectedComponentsWithStats(turned[None, :])
    lengths = np.radians(stats[1:count, cv2.CC_STAT_AREA]) * ring
    fingers = lengths[lengths > 0.15]
    return len(fingers), bool((fingers > BUNDLE).any())
