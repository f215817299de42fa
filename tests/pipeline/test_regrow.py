"""Fingers that a look had lost, won back by colour."""

import cv2
import numpy as np
import pytest

from app.pipeline.mask import THRESHOLD
from app.pipeline.regrow import MOST, colour_axis, regrow

WALL, SKIN = (200, 205, 198), (172, 193, 233)
"""BGR; wall and skin are about as light."""
FIST = ((40, 50), 14)
FINGER = (44, 14), (48, 40)
"""Corners, at the share's resolution."""


def scene(*fingers, wall=WALL, spread=2.0):
    """Share (80, 80) of a fist, and the picture (160, 160, 3) of it with fingers."""
    share = np.zeros((80, 80), np.float32)
    cv2.circle(share, *FIST, 1.0, cv2.FILLED)
    seen = np.full((80, 80, 3), wall, np.uint8)
    cv2.circle(seen, *FIST, SKIN, cv2.FILLED)
    for first, last in fingers:
        cv2.rectangle(seen, first, last, SKIN, cv2.FILLED)
    large = cv2.resize(seen, (160, 160), interpolation=cv2.INTER_NEAREST).astype(float)
    noise = np.random.default_rng(1).normal(0, spread, large.shape)
    return share, np.clip(large + noise, 0, 255).astype(np.uint8)


def test_a_lost_finger_comes_back():
    share, seen = scene(FINGER)
    grown = regrow(share, seen, THRESHOLD)
    (left, top), (right, bottom) = FINGER
    assert (grown[top + 1 : bottom, left + 1 : right] == 1).all()
    assert (grown[share == 1] == 1).all()
    assert grown[:10].max() == 0 and grown[:, :20].max() == 0


def test_a_finger_whose_root_alone_was_lost_comes_back():
    share, seen = scene(FINGER)
    (left, top), (right, _) = FINGER
    share[top:33, left : right + 1] = 1
    pieces, _ = cv2.connectedComponents((share > THRESHOLD).astype(np.uint8))
    assert pieces == 3  # the rest, the fist and the finger
    grown = regrow(share, seen, THRESHOLD)
    pieces, _ = cv2.connectedComponents((grown > THRESHOLD).astype(np.uint8))
    assert pieces == 2  # the rest, and one hand


def test_the_share_itself_is_given_when_nothing_is_lost():
    share, seen = scene()
    assert regrow(share, seen, THRESHOLD) is share


@pytest.mark.parametrize(
    "other",
    [((2, 2), (8, 30)), ((55, 5), (78, 75)), ((0, 62), (79, 66))],
    ids=["a strip elsewhere", "a face", "more than fingers are"],
)
def test_what_is_no_finger_stays_out(other):
    share, seen = scene(other)
    grown = regrow(share, seen, THRESHOLD)
    area = (other[1][0] - other[0][0]) * (other[1][1] - other[0][1])
    assert np.count_nonzero(grown[share == 0]) < max(0.1 * area, 60)


def test_no_more_comes_back_than_fingers_can_be():
    strips = [((30 + 8 * n, 0), (33 + 8 * n, 45)) for n in range(3)]
    share, seen = scene(*strips, ((0, 48), (79, 51)), ((0, 42), (79, 45)))
    grown = regrow(share, seen, THRESHOLD)
    assert np.count_nonzero(grown) <= (1 + MOST) * np.count_nonzero(share)


def test_the_rim_of_a_hand_is_no_finger():
    share, seen = scene()
    share[:] = 0
    cv2.circle(share, FIST[0], FIST[1] - 2, 1.0, cv2.FILLED)
    assert regrow(share, seen, THRESHOLD) is share


def test_a_finger_brings_no_rim_along():
    share, seen = scene(FINGER)
    cv2.circle(share, *FIST, 0.0, 2)
    grown = regrow(share, seen, THRESHOLD)
    assert (grown[16:30, 45:48] == 1).all()
    assert np.array_equal(grown[45:, :], share[45:, :])


def test_colours_that_are_not_far_apart_change_nothing():
    share, seen = scene(FINGER, wall=(165, 188, 224), spread=12)
    assert regrow(share, seen, THRESHOLD) is share


@pytest.mark.parametrize("level", [0.0, 1.0])
def test_a_share_of_nothing_or_all_is_left_alone(level):
    share = np.full((80, 80), level, np.float32)
    assert regrow(share, np.zeros((160, 160, 3), np.uint8), THRESHOLD) is share


def test_the_axis_goes_from_the_rest_to_the_hand():
    share, seen = scene()
    colours = cv2.resize(seen, (80, 80), interpolation=cv2.INTER_AREA).astype(np.float32)
    along = colour_axis(colours, share > 0.9, share < 0.1)
    assert along is not None
    assert along[share > 0.9].mean() == pytest.approx(1, abs=0.02)
    assert along[share < 0.1].mean() == pytest.approx(0, abs=0.02)
