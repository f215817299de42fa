import math

import cv2
import numpy as np
import pytest

from app.pipeline.hand_landmarks.region import as_seen, region_of_hand, region_of_palm, to_picture
from app.pipeline.hand_landmarks.types import PalmDetection, Region


def palm(turn: float) -> PalmDetection:
    """A palm 40 wide at (100, 100), its fingers pointing up and then turned."""
    points = np.zeros((7, 2), np.float32) + 100
    points[0] = 100 - 20 * math.sin(turn), 100 + 20 * math.cos(turn)
    points[2] = 100 + 20 * math.sin(turn), 100 - 20 * math.cos(turn)
    return PalmDetection(np.array([80, 80, 120, 120], np.float32), points, 1.0)


@pytest.mark.parametrize("turn", [0.0, 0.5, math.pi / 2, -2.0])
def test_the_square_round_a_palm_points_where_the_fingers_do(turn: float) -> None:
    region = region_of_palm(palm(turn))
    assert region.side == pytest.approx(2.6 * 40)
    assert region.turn == pytest.approx(turn, abs=1e-5)
    # Half a palm's height towards the fingers.
    assert (region.x, region.y) == pytest.approx(
        (100 + 20 * math.sin(turn), 100 - 20 * math.cos(turn)), abs=1e-3
    )


def test_the_square_round_landmarks_turns_and_grows_with_them() -> None:
    points = np.zeros((21, 3), np.float32)
    points[:, 0] = np.linspace(-30, 30, 21)
    points[:, 1] = np.linspace(0, -80, 21)
    points[9, :2], points[5, :2], points[13, :2] = (0, -40), (-10, -40), (10, -40)
    points[0, :2] = 0, 0
    plain = region_of_hand(points)
    assert plain.turn == pytest.approx(0)
    turned = points.copy()
    turned[:, 0], turned[:, 1] = -points[:, 1] * 2, points[:, 0] * 2  # a quarter turn clockwise
    region = region_of_hand(turned)
    assert region.turn == pytest.approx(math.pi / 2)
    assert region.side == pytest.approx(2 * plain.side)
    assert (region.x, region.y) == pytest.approx((-2 * plain.y, 2 * plain.x), abs=1e-3)


def test_what_is_seen_of_a_region_is_upright() -> None:
    picture = np.zeros((200, 300, 3), np.uint8)
    # A mark in the direction that the region calls up: to the right.
    cv2.circle(picture, (200, 100), 5, (255, 0, 0), -1)
    region = Region(150, 100, 120, math.pi / 2)
    seen = np.zeros((60, 60, 3), np.uint8)
    as_seen(picture, region, seen)
    rows, columns = np.nonzero(seen[:, :, 2])  # blue is last: RGB
    assert (columns.mean(), rows.mean()) == pytest.approx((30, 5), abs=1.5)
    back = to_picture(region, 60) @ np.array([columns.mean(), rows.mean(), 1])
    assert back == pytest.approx((200, 100), abs=3)
    grey = np.ascontiguousarray(picture[:, :, :1])
    as_seen(grey, region, seen)
    assert (seen[..., 0] == seen[..., 2]).all()
