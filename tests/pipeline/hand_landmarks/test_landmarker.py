import math

import cv2
import numpy as np
import pytest

from app.pipeline.hand_landmarks.files import path_of
from app.pipeline.hand_landmarks.finder import HandFinder
from app.pipeline.hand_landmarks.landmarker import Landmarker
from app.pipeline.hand_landmarks.palms import PalmDetector
from app.pipeline.hand_landmarks.types import TIPS, HandLandmarks
from app.pipeline.types import U8
from tests.pipeline.hand_landmarks.drawn import in_room, plain, room


@pytest.fixture(scope="module")
def find() -> HandFinder:
    return HandFinder(PalmDetector(path_of("palm", "full")), Landmarker(path_of("hand", "full")))


def hand_in(find: HandFinder, picture: U8) -> HandLandmarks:
    hand = find(picture, 0.5)
    assert hand is not None
    return hand


def test_the_fingertips_of_an_open_hand_are_above_its_wrist(find: HandFinder) -> None:
    hand = hand_in(find, in_room("stop"))
    assert hand.points.shape == hand.world.shape == (21, 3)
    assert (hand.points[list(TIPS[1:]), 1] < hand.points[0, 1] - hand.palm_length).all()
    # Metres: a palm is about as long as one.
    assert 0.06 < np.linalg.norm(hand.world[9] - hand.world[0]) < 0.14
    assert hand.presence > 0.9


def test_a_room_without_a_hand_has_none(find: HandFinder) -> None:
    assert find(room(), 0.5) is None
    assert find(np.full((240, 320, 3), 128, np.uint8), 0.5) is None


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_landmarks_turn_with_the_picture(find: HandFinder, turns: int) -> None:
    picture = plain("forward")[:, 80:560]
    upright, turned = hand_in(find, picture), hand_in(find, np.rot90(picture, -turns).copy())
    angle = turns * math.pi / 2
    rotation = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    expected = (upright.points[:, :2] - 240) @ rotation + 240
    away = np.linalg.norm(turned.points[:, :2] - expected, axis=1) / upright.palm_length
    assert np.median(away) < 0.12
    across = upright.world[:, :2] @ rotation
    assert np.median(np.linalg.norm(turned.world[:, :2] - across, axis=1)) < 0.012


def test_a_mirrored_picture_holds_the_other_hand(find: HandFinder) -> None:
    picture = plain("stop")
    hand = hand_in(find, picture)
    mirrored = hand_in(find, np.ascontiguousarray(picture[:, ::-1]))
    assert hand.right + mirrored.right == pytest.approx(1, abs=0.2)
    assert abs(hand.right - 0.5) > 0.4


def test_a_hand_that_fills_the_picture_is_found(find: HandFinder) -> None:
    hand = hand_in(find, plain("stop"))
    x, y, side, _ = hand.region
    left, top, half = int(max(x - side / 3, 0)), int(max(y - side / 3, 0)), int(side / 1.5)
    close = np.ascontiguousarray(plain("stop")[top : top + half, left : left + half])
    assert hand_in(find, cv2.resize(close, (100, 100), interpolation=cv2.INTER_AREA))
