"""Which way to the mask suits a picture: the threshold on plain ground, the network in a room."""

import cv2
import numpy as np
import pytest

from app.config import BinariseSettings
from app.pipeline.choose import (
    DOUBT,
    PATIENCE,
    PLAIN,
    PROVE_EVERY,
    ROOM,
    Choose,
    plain_part,
)
from app.pipeline.types import Way
from tests.pipeline.drawing import TURNS, WALL, draw, draw_mask

PLAIN_WAY = Way("threshold", "the background is plain")
ROOM_WAY = Way("learned", "the background is not plain")
MOMENT_WAY = Way("learned", "the background has been plain for a moment only")


def room(seed: int = 3) -> np.ndarray:
    """A drawn room: patches of many colours, up to every side."""
    rng = np.random.default_rng(seed)
    return np.kron(rng.integers(0, 255, (6, 8, 3)), np.ones((40, 40, 1))).astype(np.uint8)


def partly(share: float) -> np.ndarray:
    """A wall of which so much of every side is another thing."""
    picture = np.full((240, 320, 3), WALL, np.uint8)
    # The thing is a wedge of two bars, so that each side holds the same share of it.
    for side in range(4):
        turned = np.rot90(picture, side)
        turned[:, : round(share * turned.shape[1])][:12] = (30, 90, 40)
    return picture


@pytest.mark.parametrize("side", TURNS)
def test_a_plain_wall_is_thresholded_wherever_the_arm_comes_from(side):
    assert Choose(BinariseSettings())(draw("five", side=side)) == PLAIN_WAY


def test_a_wall_with_uneven_light_is_plain():
    light = np.linspace(0.93, 1.07, 640)[None, :, None]
    assert Choose(BinariseSettings())((draw("two") * light).clip(0, 255).astype(np.uint8)) == (
        PLAIN_WAY
    )


def test_a_room_takes_the_network():
    assert Choose(BinariseSettings())(room()) == ROOM_WAY


def test_grey_pictures_are_judged_too():
    grey = cv2.cvtColor(draw("two"), cv2.COLOR_BGR2GRAY)[:, :, None]
    assert Choose(BinariseSettings())(grey) == PLAIN_WAY
    assert Choose(BinariseSettings())(np.ascontiguousarray(room()[:, :, :1])) == ROOM_WAY


@pytest.mark.parametrize("mode", ["threshold", "learned"])
def test_a_fixed_mode_is_kept_whatever_the_picture(mode):
    choose = Choose(BinariseSettings(mode=mode))
    for picture in (draw("two"), room()):
        assert choose(picture) == Way(mode, "the settings say so")


@pytest.mark.parametrize("back", [False, True])
def test_the_way_changes_only_after_so_many_frames_in_a_row(back):
    pictures = [draw("two"), room()]
    ways = [PLAIN_WAY, ROOM_WAY]
    if back:
        pictures.reverse()
        ways.reverse()
    choose = Choose(BinariseSettings())
    assert choose(pictures[0]) == ways[0]
    waiting = MOMENT_WAY if back else PLAIN_WAY
    assert [choose(pictures[1]) for _ in range(PATIENCE - 1)] == [waiting] * (PATIENCE - 1)
    # One frame of the old kind, and the count begins anew.
    assert choose(pictures[0]) == ways[0]
    answers = [choose(pictures[1]) for _ in range(PATIENCE)]
    assert answers == [waiting] * (PATIENCE - 1) + [ways[1]]


def test_a_background_between_the_two_bounds_keeps_the_way_it_began_with():
    between = next(
        picture
        for share in np.linspace(0.1, 0.4, 61)
        if ROOM < plain_part(picture := partly(float(share))) < PLAIN
    )
    began_plain, began_room = Choose(BinariseSettings()), Choose(BinariseSettings())
    began_plain(draw("two"))
    began_room(room())
    assert {began_plain(between) for _ in range(3 * PATIENCE)} == {PLAIN_WAY}
    assert {began_room(between) for _ in range(3 * PATIENCE)} == {ROOM_WAY}


def test_a_threshold_that_the_network_agrees_with_is_proved_now_and_then():
    choose, hand = Choose(BinariseSettings()), draw_mask("five")
    choose(draw("five"))
    assert choose.unproved
    assert choose.prove(hand, hand) is None
    asked = []
    for _ in range(2 * PROVE_EVERY + 2):
        choose(draw("five"))
        asked.append(choose.unproved)
        if choose.unproved:
            choose.prove(hand, hand)
    assert asked.count(True) == 2
    assert asked.index(True) == PROVE_EVERY


def test_a_piece_unlike_the_proved_one_needs_a_proof_of_its_own():
    choose, hand = Choose(BinariseSettings()), draw_mask("five")
    choose(draw("five"))
    choose.found(1000)
    assert choose.prove(hand, hand) is None
    for area, unproved in [(1000, False), (1400, False), (700, False), (1600, True)]:
        choose.found(area)
        assert choose.unproved is unproved, area
    choose.prove(hand, hand)
    choose.found(1600)
    assert not choose.unproved
    choose.found(0)  # no hand: whatever comes next is new
    choose.found(1600)
    assert choose.unproved


def test_a_threshold_that_finds_other_things_is_not_tried_for_a_while():
    choose, hand = Choose(BinariseSettings()), draw_mask("five")
    choose(draw("five"))
    doubted = Way("learned", "the background is plain, but the threshold finds other things")
    assert choose.prove(1 - hand, hand) == doubted
    assert [choose(draw("five")) for _ in range(DOUBT)] == [doubted] * DOUBT
    later = [choose(draw("five")).mode for _ in range(PATIENCE)]
    assert later[-1] == "threshold"
    assert choose.unproved


def test_a_held_gesture_keeps_the_networks_way_and_no_longer():
    choose, hand = Choose(BinariseSettings()), draw_mask("five")
    choose(draw("five"))
    doubted = choose.prove(1 - hand, hand)
    held = {choose(draw("five"), held=True) for _ in range(DOUBT + 2 * PATIENCE)}
    assert held == {doubted}
    later = [choose(draw("five")).mode for _ in range(DOUBT + PATIENCE)]
    assert later[-1] == "threshold"


def test_a_held_gesture_does_not_keep_the_threshold_against_a_proof():
    choose, hand = Choose(BinariseSettings()), draw_mask("five")
    choose(draw("five"))
    assert choose(draw("five"), held=True).mode == "threshold"
    choose.prove(1 - hand, hand)
    assert choose(draw("five"), held=True).mode == "learned"


def test_an_empty_mask_proves_nothing():
    choose, none = Choose(BinariseSettings()), np.zeros((480, 640), np.uint8)
    choose(draw("five"))
    way = choose.prove(none, none)
    assert way is not None
    assert way.mode == "learned"


def test_a_fixed_mode_needs_no_proof():
    choose = Choose(BinariseSettings(mode="threshold"))
    choose(draw("five"))
    assert not choose.unproved


def test_the_part_that_is_plain_is_a_share():
    assert plain_part(np.full((480, 640, 3), 120, np.uint8)) == 1.0
    assert 0.0 <= plain_part(room()) < 0.5
