"""Burst: the frames of a few seconds, and the few of them that are worth enrolling."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from app.config import PipelineSettings
from app.errors import ImageRefused, TooLarge
from app.pipeline.hand_landmarks.shape import HandShape
from app.pipeline.match import Gallery, PcaMatcher
from app.pipeline.quality import Finding
from app.pipeline.still import take_shot
from app.pipeline.types import U8

MAX_FRAMES = 120
"""Images of one burst: four seconds at 30 a second."""
KEPT = 8
"""Frames kept at most: what a gesture needs, without slowing the match for all others."""
RESTING = 0.2
"""Part of the hand's pixels that may change from one frame to the next."""
SAME_PIXELS = 0.01
"""Templates that differ in fewer of their pixels are one."""
NEAR = 0.25
"""Largest accepted distances. A frame as near to one that is kept adds nothing."""
_MASK = (160, 120)


class Look(NamedTuple):
    """One image of an upload, judged.

    Attributes:
        template: (80, 60), or None when the image is refused.
        hand: Its landmarks; None where they were not found.
        mask: (120, 160) of the hand with its arm, for seeing it move.
        problem: Why it is refused.
        advice: What would have been better.
    """

    template: U8 | None
    mask: U8 | None
    problem: Finding | None
    advice: tuple[Finding, ...] = ()
    hand: HandShape | None = None


def look_at(image: bytes, settings: PipelineSettings) -> Look:
    """Judge one image; what is no picture is a problem like any other."""
    try:
        return see(image, settings)
    except (ImageRefused, TooLarge) as error:
        code = error.detail.get("problem", "unreadable")
        return Look(None, None, Finding(str(code), error.message))


def see(image: bytes, settings: PipelineSettings) -> Look:
    """Judge one image.

    Raises:
        ImageRefused, TooLarge: as :func:`~app.pipeline.still.take_shot`.
    """
    shot = take_shot(image, settings)
    mask = cv2.resize(shot.extraction.mask, _MASK, interpolation=cv2.INTER_NEAREST)
    found = shot.extraction
    shown = np.asarray(mask, np.uint8)
    return Look(found.template, shown, None, shot.quality.advice, found.hand)


@dataclass(frozen=True)
class Chosen:
    """What a burst came to.

    Attributes:
        looks: As given; those left out now have a problem.
        kept: Indices of those to enrol, the most typical one first.
    """

    looks: tuple[Look, ...]
    kept: tuple[int, ...]

    @property
    def left_out(self) -> dict[str, int]:
        """How many were left out for each reason, most first."""
        counts = Counter(look.problem.code for look in self.looks if look.problem)
        return dict(counts.most_common())


def choose(looks: Sequence[Look], settings: PipelineSettings) -> Chosen:
    """Keep the most different good frames of one gesture.

    Left out are, in this order: frames that are refused by themselves; frames in which the hand
    moves; frames that show another gesture than most; frames that hardly differ from one that is
    kept; and what is left when enough are kept. Photographs that were not taken one after another
    do not resemble their neighbours at all; nothing counts as moving then.
    """
    all_looks = list(looks)
    good = [number for number, look in enumerate(looks) if look.template is not None]
    moving = _moving([_mask(looks[number]) for number in good])
    for number, moves in zip(good, moving, strict=True):
        if moves:
            _leave(all_looks, number, "moving", "the hand moves")
    good = [number for number, moves in zip(good, moving, strict=True) if not moves]
    if not good:
        return Chosen(tuple(all_looks), ())

    unlike, stands_for = _unlike([_template(looks[number]) for number in good])
    table = _distances([looks[good[at]] for at in unlike], settings)
    weights = np.bincount(stands_for, minlength=len(unlike))
    # The frame that most frames are near to.
    reach = settings.match.max_distance
    near = (table <= reach) @ weights
    typical = int(np.lexsort((table @ weights, -near))[0])
    alike = table[typical] <= reach
    if 2 * weights[alike].sum() < weights.sum():
        alike[:] = False
    kept: list[int] = []
    if alike.any():
        kept = _most_different(table, typical, alike, NEAR * reach)
    for at, number in enumerate(good):
        one = stands_for[at]
        if not alike[one]:
            text = "it shows another sign than most of the frames"
            _leave(all_looks, number, "another_gesture", text)
        elif one not in kept and table[one, kept].min() > NEAR * reach:
            _leave(all_looks, number, "enough", f"{KEPT} frames are enough")
        elif one not in kept or unlike[one] != at:
            _leave(all_looks, number, "near_duplicate", "it hardly differs from a frame kept")
    return Chosen(tuple(all_looks), tuple(good[unlike[one]] for one in kept))


def _mask(look: Look) -> U8:
    assert look.mask is not None
    return look.mask


def _template(look: Look) -> U8:
    assert look.template is not None
    return look.template


def _leave(looks: list[Look], number: int, code: str, message: str) -> None:
    looks[number] = looks[number]._replace(problem=Finding(code, message))


def _moving(masks: list[U8]) -> list[bool]:
    """Whether the hand moves in each frame: it is unlike the one before and the one after."""
    if len(masks) < 3:
        return [False] * len(masks)
    change = [
        cv2.countNonZero(cv2.bitwise_xor(one, other))
        / max(cv2.countNonZero(one), cv2.countNonZero(other), 1)
        for one, other in pairwise(masks)
    ]
    least = [
        min(before, after) for before, after in zip([9.0, *change], [*change, 9.0], strict=True)
    ]
    if float(np.median(least)) > RESTING:
        return [False] * len(masks)
    return [part > RESTING for part in least]


def _unlike(templates: list[U8]) -> tuple[list[int], NDArray[np.intp]]:
    """Indices of templates that differ, and for each template which of them stands for it."""
    unlike: list[int] = []
    stands_for = np.zeros(len(templates), np.intp)
    for number, template in enumerate(templates):
        for place, one in enumerate(unlike):
            if np.count_nonzero(template ^ templates[one]) < SAME_PIXELS * template.size:
                stands_for[number] = place
                break
        else:
            stands_for[number] = len(unlike)
            unlike.append(number)
    return unlike, stands_for


def _distances(looks: list[Look], settings: PipelineSettings) -> NDArray[np.float64]:
    """(n, n) distances between samples, the smaller one of both directions."""
    labels = tuple(f"{number:04}" for number in range(len(looks)))
    plain = settings.match.model_copy(update={"calibrate": False})
    templates = [_template(look) for look in looks]
    hands = tuple(look.hand for look in looks)
    matcher = PcaMatcher.fit(Gallery(labels, np.stack(templates), hands), plain)
    rows = [
        (matcher.match_hand(hand) if hand is not None else None) or matcher.match_template(template)
        for template, hand in zip(templates, hands, strict=True)
    ]
    table = np.array([[row.distances[label] for label in labels] for row in rows])
    np.fill_diagonal(table, 0.0)
    return np.asarray(np.minimum(table, table.T), np.float64)


def _most_different(
    table: NDArray[np.float64], first: int, allowed: NDArray[np.bool_], least: float
) -> list[int]:
    """Farthest-point sampling (T. Gonzalez, Theor. Comput. Sci. 38, 1985) from ``first``."""
    kept = [first]
    while len(kept) < KEPT:
        away = np.where(allowed, table[kept].min(axis=0), -1.0)
        farthest = int(away.argmax())
        if away[farthest] <= least:
            break
        kept.append(farthest)
    return kept
