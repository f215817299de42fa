"""Curve: false accepts against misses, over every threshold of strangeness."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

POINTS = 50
"""Thresholds of a curve, at equal steps of rank; the product's own, 1, comes on top."""
NO_HAND = math.inf
"""Strangeness of a picture in which no hand was found: accepted at no threshold."""


def accept_curve(
    known: Sequence[float], right: Sequence[bool], unknown: Sequence[float]
) -> dict[str, Any]:
    """What is accepted at which threshold.

    Args:
        known: :attr:`~app.pipeline.types.Match.strangeness` of pictures of enrolled labels;
            :data:`NO_HAND` without a hand. At least one.
        right: Of the same pictures, whether the nearest label is the true one.
        unknown: Strangeness of pictures of other labels. At least one.

    Returns:
        JSON-compatible: ``curve``, a list of points with the ``threshold`` and, each as a part of
        its pictures, ``known_passed`` (accepted, as whatever label), ``known_wrong`` (accepted as
        another label than the true one) and ``unknown_accepted``;
        ``missed_at_5_percent_accepted``, the part of the known that is not accepted at the largest
        threshold that accepts at most 5% of the unknown; ``accepted_at_90_percent_passed``, the
        part of the unknown accepted at the smallest threshold at which 90% of the known pass, None
        when hands were found in fewer.
    """
    strange, answered, others = np.asarray(known), np.asarray(right), np.asarray(unknown)
    finite = np.concatenate([strange, others])
    finite = finite[np.isfinite(finite)]
    steps = np.quantile(finite, np.linspace(0, 1, POINTS)) if finite.size else []
    points = []
    for threshold in sorted({1.0, *(round(float(step), 4) for step in steps)}):
        passed = strange <= threshold
        points.append(
            {
                "threshold": threshold,
                "known_passed": round(float(passed.mean()), 4),
                "known_wrong": round(float((passed & ~answered).mean()), 4),
                "unknown_accepted": round(float((others <= threshold).mean()), 4),
            }
        )
    nearest = np.sort(others)
    # Everything below this one is accepted: 5% of the unknown at most.
    limit = nearest[math.floor(0.05 * len(nearest))]
    reach = np.sort(strange)[math.ceil(0.9 * len(strange)) - 1]
    return {
        "curve": points,
        "missed_at_5_percent_accepted": round(float((strange >= limit).mean()), 4),
        "accepted_at_90_percent_passed": (
            round(float((others <= reach).mean()), 4) if math.isfinite(reach) else None
        ),
    }


def no_curve() -> dict[str, None]:
    """The same keys when nothing unknown was asked."""
    return dict.fromkeys(("curve", "missed_at_5_percent_accepted", "accepted_at_90_percent_passed"))
