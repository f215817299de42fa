"""Which gestures of a gallery are taken for one another, by its own samples."""

from functools import cache

import numpy as np
import pytest

from app.pipeline import Gallery, PcaMatcher, extract_template
from app.pipeline.mix_ups import Answer, MixUps, answer, asked_of, tally
from tests.pipeline.drawing import SETTINGS, draw, jpeg

PIPELINE = SETTINGS.model_copy(
    update={"match": SETTINGS.match.model_copy(update={"features": "distance"})}
)


@cache
def drawn(shape: str, number: int):
    """One drawn hand, each a little larger and farther to the right than the one before."""
    picture = draw(shape, scale=0.85 + 0.04 * number, shift=(5 * number, 0))
    return extract_template(jpeg(picture), PIPELINE).template


def templates(shape: str, count: int = 4):
    return np.stack([drawn(shape, number) for number in range(count)])


def fit(**gestures) -> PcaMatcher:
    labels = tuple(name for name, made in gestures.items() for _ in made)
    return PcaMatcher.fit(Gallery(labels, np.concatenate(list(gestures.values()))), PIPELINE.match)


def mix_ups(**gestures) -> MixUps:
    matcher = fit(**gestures)
    return tally(list(gestures), [answer(matcher, index) for index in asked_of(matcher)])


def test_gestures_that_differ_are_all_known():
    found = mix_ups(fist=templates("fist"), two=templates("two"), five=templates("five"))
    assert found.labels == ("fist", "two", "five")
    assert found.counts == [[4, 0, 0], [0, 4, 0], [0, 0, 4]]
    assert found.rejected == [0, 0, 0]
    assert found.worst is None
    assert found.untested == ()


def test_two_alike_are_found_and_named():
    hand = templates("two", 8)
    found = mix_ups(fist=templates("fist"), two=hand[::2], twin=hand[1::2])
    mistaken = found.counts[1][2] + found.counts[2][1]
    assert mistaken + found.rejected[1] + found.rejected[2] > 0
    assert found.counts[0] == [4, 0, 0]
    assert found.worst is not None
    assert {found.worst.shown, found.worst.other} == {"two", "twin"}
    assert found.worst.level in ("mistaken", "undecided")
    assert found.worst.teach in ("two", "twin")
    assert 0 < found.worst.times <= found.worst.asked == 4


def test_a_sample_that_strayed_is_taken_for_what_it_shows():
    fist, five = templates("fist"), templates("five", 5)
    found = mix_ups(fist=np.concatenate([fist, five[4:]]), five=five[:4])
    assert found.counts[0] == [4, 1]
    assert found.worst is not None
    assert (found.worst.shown, found.worst.other, found.worst.level) == ("fist", "five", "mistaken")
    assert (found.worst.times, found.worst.asked, found.worst.teach) == (1, 5, "fist")


def test_what_has_one_sample_is_not_tried_but_can_be_taken_for():
    found = mix_ups(fist=templates("fist"), five=templates("five", 1))
    assert found.untested == ("five",)
    assert found.counts == [[4, 0], [0, 0]]
    assert mix_ups(fist=templates("fist", 1)).counts == [[0]]
    assert tally([], []) == MixUps((), [], [], (), None)


def test_left_out_is_left_out():
    hands = {"fist": templates("fist"), "five": templates("five")}
    matcher = fit(**hands)
    for index, (label, number) in enumerate(matcher.templates):
        without = matcher.without(index)
        shown = matcher.match_template(hands[label][number])
        assert shown.distances[label] < without.distances[label]
        other = "five" if label == "fist" else "fist"
        assert without.distances[other] == pytest.approx(shown.distances[other], rel=0.3)
    alone = fit(fist=templates("fist", 1))
    assert alone.without(0).match is None
    other = fit(fist=templates("fist", 1), five=templates("five", 2)).without(0)
    assert other.match is not None
    assert (other.match.gesture, other.match.margin) == ("five", None)


def test_undecided_and_near_are_told_apart():
    def one(taken_for, torn, own, other):
        return Answer("a", taken_for, torn, own, {"b": other})

    torn = tally(["a", "b"], [one(None, "b", 0.3, 0.31), one("a", None, 0.1, 0.5)])
    assert torn.worst is not None
    assert (torn.worst.level, torn.worst.times, torn.worst.teach) == ("undecided", 1, "b")
    near = tally(["a", "b"], [one("a", None, 0.3, 0.32)])
    assert near.worst is not None and near.worst.level == "near"
    assert tally(["a", "b"], [one("a", None, 0.3, 0.5)]).worst is None
