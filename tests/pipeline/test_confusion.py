import numpy as np
import pytest

from app.config import PipelineSettings
from app.pipeline import extract_template
from app.pipeline.confusion import SAMPLES, compare, fingers_shown
from tests.pipeline.shots import hand, jpeg

SETTINGS = PipelineSettings()
REACH = SETTINGS.match.max_distance


def template(gesture: str, **kw):
    return extract_template(jpeg(hand(gesture, **kw)), SETTINGS).template


STOP = np.stack([template("stop", turn=turn) for turn in (-0.1, 0.0, 0.1)])
CLOSE = np.stack([template("close", turn=turn) for turn in (-0.1, 0.0, 0.1)])


def test_two_gestures_that_look_alike_are_named_with_advice():
    found = compare([("a", STOP[:1]), ("b", STOP[1:2])], SETTINGS.match, REACH)
    assert [(one.gesture, one.other) for one in found.confusions] in (
        [(0, 1), (1, 0)],
        [(1, 0), (0, 1)],
    )
    worst = found.confusions[0]
    assert worst.level == "likely"
    assert worst.strength > 0.95
    assert worst.own is None
    codes = [advice.code for advice in worst.advice]
    assert "add_photos" in codes and "another_sign" in codes
    assert all(advice.message for advice in worst.advice)


def test_two_gestures_that_differ_are_not():
    found = compare([("stop", STOP), ("close", CLOSE)], SETTINGS.match, REACH)
    assert found.confusions == ()
    assert found.distance.shape == (2, 2)
    assert np.isnan(found.distance.diagonal()).all()
    assert (found.own < 0.7 * found.distance[[0, 1], [1, 0]]).all()


def test_a_sample_of_the_wrong_gesture_shows():
    """Leaving each sample out: the stray one has its like with the other gesture."""
    mixed = np.concatenate([STOP, CLOSE[:1]])
    found = compare([("stop", mixed), ("close", CLOSE[1:])], SETTINGS.match, REACH)
    assert {(one.gesture, one.other) for one in found.confusions} == {(0, 1), (1, 0)}
    assert found.confusions[0].level == "likely"


def test_only_what_is_asked_about_is_compared():
    found = compare([("a", STOP), ("b", STOP), ("c", CLOSE)], SETTINGS.match, REACH, asked=[1])
    assert {one.gesture for one in found.confusions} == {1}
    assert np.isnan(found.distance[[0, 2]]).all()


def test_nothing_and_one_gesture_are_confused_with_nothing():
    assert compare([], SETTINGS.match, REACH).confusions == ()
    alone = compare([("a", STOP)], SETTINGS.match, REACH)
    assert alone.confusions == ()
    assert alone.own[0] < REACH


def test_many_samples_are_thinned():
    many = np.concatenate([STOP] * 20)
    found = compare([("many", many), ("close", CLOSE)], SETTINGS.match, REACH)
    assert len(many) > SAMPLES
    assert found.confusions == ()


@pytest.mark.parametrize(("gesture", "expected"), [("stop", 5), ("close", 0)])
def test_stretched_fingers_are_counted(gesture, expected):
    count, _ = fingers_shown(template(gesture))
    assert abs(count - expected) <= 1
