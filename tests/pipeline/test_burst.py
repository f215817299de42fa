import cv2
import numpy as np

from app.config import PipelineSettings
from app.pipeline.burst import KEPT, choose, look_at
from tests.pipeline.shots import hand, jpeg

SETTINGS = PipelineSettings()


def looks(*pictures):
    return [look_at(jpeg(picture), SETTINGS) for picture in pictures]


STILL = hand("stop")
TURNED = [hand("stop", turn=turn) for turn in (-0.3, -0.15, 0.0, 0.15, 0.3)]


def test_what_is_no_picture_is_left_out_like_any_other():
    found = choose([look_at(b"nothing", SETTINGS), *looks(STILL, STILL)], SETTINGS)
    assert found.left_out == {"unreadable": 1, "near_duplicate": 1}
    assert len(found.kept) == 1


def test_equal_frames_are_thinned_to_one():
    (one,) = looks(STILL)
    found = choose([one] * 60, SETTINGS)
    assert len(found.kept) == 1
    assert found.left_out == {"near_duplicate": 59}


def test_blurred_frames_are_left_out_and_a_turning_hand_is_kept_several_times():
    frames = [picture for turned in TURNED for picture in (turned, turned)]
    frames[4:4] = [cv2.GaussianBlur(STILL, (0, 0), 10)] * 3
    found = choose(looks(*frames), SETTINGS)
    assert found.left_out["blurred"] == 3
    assert 1 <= len(found.kept) <= KEPT
    assert not set(found.kept) & {4, 5, 6}
    assert len(found.kept) + sum(found.left_out.values()) == len(frames)


def test_frames_that_show_another_gesture_are_left_out():
    other = hand("close")
    found = choose(looks(*TURNED, other, other, *TURNED[::-1]), SETTINGS)
    assert found.left_out["another_gesture"] == 2
    assert not set(found.kept) & {5, 6}


def test_frames_in_which_the_hand_moves_are_left_out():
    across = [hand("stop", 200.0, (x, 240.0)) for x in (200.0, 290.0, 390.0)]
    frames = [across[0]] * 4 + [across[1]] + [across[2]] * 4
    found = choose(looks(*frames), SETTINGS)
    assert found.left_out["moving"] == 1
    problem = found.looks[4].problem
    assert problem is not None and problem.code == "moving"


def test_photographs_from_here_and_there_do_not_count_as_moving():
    frames = [
        hand("stop", 200.0, (x, 240.0), turn=t) for x, t in ((150, 0), (400, 0.2), (260, -0.2))
    ]
    found = choose(looks(*frames), SETTINGS)
    assert "moving" not in found.left_out
    assert found.kept


def test_nothing_good_keeps_nothing():
    blurred = cv2.GaussianBlur(STILL, (0, 0), 10)
    found = choose(looks(blurred, np.full_like(STILL, 200)), SETTINGS)
    assert found.kept == ()
    assert found.left_out == {"blurred": 1, "no_hand": 1}
    assert choose([], SETTINGS).kept == ()
