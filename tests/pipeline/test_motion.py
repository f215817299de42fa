import numpy as np
import pytest

from app.config import MotionSettings
from app.pipeline.motion import MotionGate
from tests.pipeline.drawing import draw_mask

TWO = draw_mask("two", size=(320, 240))
ONE = draw_mask("one", size=(320, 240))


def play(masks, fps=30, **settings):
    gate = MotionGate(MotionSettings(**settings))
    return [gate(mask, n / fps) for n, mask in enumerate(masks)]


@pytest.mark.parametrize("fps", [10, 15, 30, 60])
def test_a_hand_has_settled_when_it_looks_as_it_did_a_while_ago(fps):
    settled = [motion.settled for motion in play([TWO] * fps, fps, settle_s=0.2)]
    first = settled.index(True)
    assert 0.19 <= first / fps <= 0.2 + 1 / fps
    assert all(settled[first:])


def test_another_gesture_settles_anew():
    motions = play([TWO] * 10 + [ONE] * 10, settle_s=0.2)
    assert [motion.settled for motion in motions[6:]] == [True] * 4 + [False] * 6 + [True] * 4


def test_a_finger_that_bends_slowly_is_still_to_the_paper_and_yet_not_settled():
    assert (TWO ^ ONE).mean() > 0.01
    rows = np.flatnonzero((TWO ^ ONE).any(axis=1))
    masks = []
    for end in np.linspace(rows[0], rows[-1], 30).astype(int):  # one second
        mask = TWO.copy()
        mask[:end] = ONE[:end]
        masks.append(mask)
    motions = play(masks)[10:-8]
    assert all(motion.still for motion in motions)
    assert not any(motion.settled for motion in motions)


def test_a_hand_that_sways_a_little_has_settled_and_one_that_travels_has_not():
    swaying = [np.roll(TWO, n % 3, axis=1) for n in range(20)]
    assert all(motion.settled for motion in play(swaying)[8:])
    travelling = [np.roll(TWO, n, axis=1) for n in range(20)]
    assert not any(motion.settled for motion in play(travelling))


def test_a_large_hand_that_trembles_is_at_rest_but_not_to_the_paper():
    shakes = [(0, 0), (1, 1), (-1, 1), (1, -1), (0, -1)] * 4
    large = draw_mask("five", size=(320, 240), scale=1.2)
    masks = [np.roll(large, shake, axis=(0, 1)) for shake in shakes]
    assert any(motion.trembling and not motion.still for motion in play(masks)[8:])
    assert not any(motion.trembling for motion in play(masks, settle_s=0))


def test_a_far_hand_is_measured_by_itself():
    """A hand of 1% of the picture: all of it may move, and the paper's gate stays open."""
    small = np.zeros((240, 320), np.uint8)
    small[100:120, 100:118] = 1
    aside = np.roll(small, 10, axis=1)
    gate = MotionGate(MotionSettings(settle_s=0.1))
    motions = [gate(small if n % 10 < 5 else aside, n / 30) for n in range(20)]
    assert all(motion.still for motion in motions[2:])
    assert not motions[6].settled


def test_an_empty_picture_never_settles():
    assert not any(motion.settled for motion in play([np.zeros((240, 320), np.uint8)] * 20))


def test_the_paper_does_not_ask_for_it():
    assert [motion.settled for motion in play([TWO, ONE, TWO], settle_s=0)][-1]


def test_a_reset_forgets_the_past():
    gate = MotionGate(MotionSettings(settle_s=0.2))
    for n in range(10):
        gate(TWO, n / 30)
    gate.reset()
    assert not any(gate(TWO, 1 + n / 30).settled for n in range(5))
