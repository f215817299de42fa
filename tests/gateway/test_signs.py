"""Is it the sign that was asked for, and what is different if not?"""

from itertools import product

import pytest

from app.errors import Invalid
from app.gateway.signs import compare, difference, known_sign
from app.gestures import read_set
from app.gestures.hand.poses import POSES, stretched
from app.pipeline.hand_landmarks.shape import HandShape
from tests.gestures.conftest import STARTER

HANDS = {
    gesture.name: [HandShape.unpack(hand) for hand in gesture.landmarks if hand is not None]
    for gesture in read_set(STARTER)
}
NONE = (False,) * 5


def test_every_starter_sign_has_fingers_of_its_own() -> None:
    assert len({stretched(pose) for pose in POSES.values()}) == len(POSES)


@pytest.mark.parametrize(("shown", "asked"), list(product(POSES, POSES)))
def test_every_sign_is_told_from_every_other(shown: str, asked: str) -> None:
    found = [difference(hand, asked) for hand in HANDS[shown]]
    if shown == asked:
        # Of one sample the index finger is hardly stretched.
        assert sum(one is not None for one in found) <= (1 if shown == "down" else 0)
    else:
        # Of some the networks take it for half bent, which counts for neither.
        assert sum(one is None for one in found) <= (4 if shown == "down" else 0)


def test_what_is_different_is_said_with_its_numbers() -> None:
    one = stretched(POSES["up"])
    nothing = compare(NONE, one)
    assert nothing is not None
    assert nothing.as_json() == {
        "code": "palm_only",
        "seen": 0,
        "asked": 1,
        "stretch": ["index"],
        "bend": [],
    }
    assert nothing.finding == ("not_the_sign", "only the palm is seen: one finger is asked")
    two = compare(stretched(POSES["forward"]), one)
    assert two is not None
    assert (two.code, two.seen, two.asked, two.bend) == ("count", 2, 1, ("middle",))
    assert two.finding.message == "that is two fingers: one finger is asked"
    other = compare(stretched(POSES["right"]), one)
    assert other is not None and other.code == "fingers"
    assert other.finding.message == (
        "other fingers are asked: stretch the index finger, and bend the little finger"
    )
    fist = compare(one, NONE)
    assert fist is not None
    assert fist.finding.message == "that is one finger: no finger is asked"


def test_a_finger_in_doubt_counts_for_neither() -> None:
    one = stretched(POSES["up"])
    assert compare((None, True, False, None, False), one) is None
    # How many there are is not known then.
    doubtful = compare((None, True, True, False, False), one)
    assert doubtful is not None and doubtful.code == "fingers"
    assert doubtful.finding.message == "other fingers are asked: bend the middle finger"
    assert compare((None,) * 5, one) is None


def test_an_unknown_sign_is_refused() -> None:
    assert known_sign("stop") == "stop"
    with pytest.raises(Invalid, match="no sign is called 'wave'; there are forward, back"):
        known_sign("wave")
