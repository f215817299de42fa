"""Rejection: whether the nearest gesture is near enough to be the one that is shown."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.config import MatchSettings
from app.pipeline.types import Cause

F64 = NDArray[np.float64]

OWN_REACH = 1.3
OTHER_REACH = 0.9
"""Factors of the calibration, measured on the digit signs: photographs, and other people's hands
shown to five photographs a sign (benchmarks/streams)."""
TINY = 1e-6
"""In the unit of the distance; less is nothing."""


class Verdict(NamedTuple):
    """Whether a match is accepted: ``cause`` and ``reason`` are None when it is.

    ``strangeness`` is the largest of distance, error and lack of margin, each in parts of what is
    allowed.
    """

    strangeness: float
    cause: Cause | None
    reason: str | None


def reach(own: F64, other: F64, settings: MatchSettings) -> float:
    """The largest distance accepted, from how the enrolled templates lie to one another.

    With several templates a gesture: a little more than the distance at which nine out of ten
    find another of their own. With one each: a little less than the median distance to the
    nearest other gesture. Within the bounds of the settings, and in their middle when a single
    template says nothing.

    Args:
        own: (n,) from each template to the others of its gesture; inf where there are none.
        other: (n,) to the nearest other gesture; inf where there is none.
        settings: Of the matcher.
    """
    low, high = settings.min_reach, settings.max_distance
    own, other = own[np.isfinite(own)], other[np.isfinite(other)]
    if len(own) >= 2:
        found = OWN_REACH * float(np.quantile(own, 0.9))
    elif len(other):
        found = OTHER_REACH * float(np.median(other))
    else:
        found = (low + high) / 2
    return min(max(found, min(low, high)), high)


def judge(
    names: tuple[str, str | None],
    distance: float,
    limit: float,
    margin: float | None,
    error: float,
    settings: MatchSettings,
) -> Verdict:
    """Accept or refuse the nearest gesture.

    Args:
        names: Of the nearest gesture and the second.
        distance: To the nearest.
        limit: The largest distance allowed.
        margin: The second's distance minus this one; None when only one is enrolled.
        error: Reconstruction error.
        settings: Of the matcher.
    """
    name, second = names
    parts = [distance / max(limit, TINY), error / max(settings.max_error, TINY)]
    if margin is not None:
        parts.append(settings.min_margin / max(margin, TINY))
    cause: Cause | None = None
    reason: str | None = None
    if distance > limit:
        cause = "unknown_hand"
        reason = (
            f"unknown hand: closest is {name}, but too far ({distance:.2f}, at most {limit:.2f})"
        )
    elif error > settings.max_error:
        cause = "unknown_hand"
        reason = (
            f"unknown hand: closest is {name}, but the shape is unlike any enrolled one "
            f"({error:.2f}, at most {settings.max_error:.2f})"
        )
    elif margin is not None and margin < settings.min_margin:
        cause, reason = "low_margin", f"undecided: {name} and {second} are almost equally close"
    return Verdict(max(parts), cause, reason)
