"""What is refused: too far, unlike all, undecided."""

import numpy as np
import pytest

from app.config import MatchSettings
from app.pipeline.rejection import judge, reach

SETTINGS = MatchSettings()


def test_one_limit_follows_the_gesture_s_own_distances_within_its_bounds():
    none = np.full(3, np.inf)
    own = np.array([0.3, 0.3, 0.3])
    assert reach(own, none, SETTINGS) == pytest.approx(1.3 * 0.3)
    assert reach(none, np.array([0.45, 0.45, 9]), SETTINGS) == pytest.approx(0.9 * 0.45)
    assert reach(own * 9, none, SETTINGS) == SETTINGS.max_distance
    assert reach(own / 9, none, SETTINGS) == SETTINGS.min_reach
    middle = (SETTINGS.min_reach + SETTINGS.max_distance) / 2
    assert reach(none, none, SETTINGS) == pytest.approx(middle)


@pytest.mark.parametrize(
    ("distance", "margin", "error", "cause", "words"),
    [
        (0.1, 0.2, 0.0, None, None),
        (0.5, 0.2, 0.0, "unknown_hand", "too far (0.50, at most 0.40)"),
        (0.1, 0.2, 9.0, "unknown_hand", "unlike any enrolled one"),
        (0.1, 0.001, 0.0, "low_margin", "one and two are almost equally close"),
        (0.1, None, 0.0, None, None),
    ],
)
def test_what_is_refused_says_why(distance, margin, error, cause, words):
    verdict = judge(("one", "two"), distance, 0.4, margin, error, SETTINGS)
    assert verdict.cause == cause
    assert (verdict.strangeness <= 1) == (cause is None)
    assert (verdict.reason is None) if words is None else (words in verdict.reason)
