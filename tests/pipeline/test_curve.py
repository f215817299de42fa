import json

import pytest

from app.pipeline.curve import NO_HAND, accept_curve, no_curve

KNOWN = [i / 10 for i in range(1, 11)]
UNKNOWN = [0.55 + i / 10 for i in range(20)]


def test_curve_counts_what_is_at_most_the_threshold():
    result = accept_curve([0.5, 0.8, 1.5, NO_HAND], [True, False, True, False], [0.9, 3.0])
    points = {point.pop("threshold"): point for point in result["curve"]}
    assert points[1.0] == {"known_passed": 0.5, "known_wrong": 0.25, "unknown_accepted": 0.5}
    assert points[3.0] == {"known_passed": 0.75, "known_wrong": 0.25, "unknown_accepted": 1.0}
    assert list(points) == sorted(points)
    json.dumps(result, allow_nan=False)


def test_curve_rises():
    points = accept_curve(KNOWN, [True] * 10, UNKNOWN)["curve"]
    for key in ("known_passed", "unknown_accepted"):
        values = [point[key] for point in points]
        assert values == sorted(values)


def test_misses_where_five_percent_are_accepted():
    # One of the twenty unknown, 0.55, is 5%; the next is 0.65: 0.7 to 1.0 are missed.
    assert accept_curve(KNOWN, [True] * 10, UNKNOWN)["missed_at_5_percent_accepted"] == 0.4


def test_false_accepts_where_ninety_percent_pass():
    # 0.9 is the ninth of ten known; 0.55 to 0.85 are nearer.
    result = accept_curve(KNOWN, [True] * 10, UNKNOWN)
    assert result["accepted_at_90_percent_passed"] == pytest.approx(4 / 20)


def test_too_few_hands_for_ninety_percent():
    result = accept_curve([0.1, NO_HAND], [True, False], [NO_HAND])
    assert result["accepted_at_90_percent_passed"] is None
    assert result["missed_at_5_percent_accepted"] == 0.5
    assert [point["threshold"] for point in result["curve"]] == [0.1, 1.0]


def test_no_curve_has_the_same_keys():
    assert set(no_curve()) == set(accept_curve([1.0], [True], [1.0]))
