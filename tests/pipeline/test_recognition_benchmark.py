"""The benchmark beside MediaPipe has to be fair and honest; this holds what makes it so."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.recognition.methods import BONES, Answer, Seen, bone_directions
from benchmarks.recognition.modes import compared
from benchmarks.recognition.score import accuracy, across, rejection
from benchmarks.recognition.sets import PhotoSet, people, read_set
from benchmarks.recognition.table import markdown
from tests.pipeline.drawing import draw, jpeg


class Numbers:
    """A method whose hands are numbers; keeps what it was taught."""

    def __init__(self):
        self.enrolled = []

    def learn(self, labels, hands):
        self.enrolled.append(list(hands))
        names = np.array(labels)

        def ask(hand):
            gaps = np.abs(np.array(hands) - hand)
            return Answer(str(names[gaps.argmin()]), float(gaps.min()))

        return ask


LABELS = [label for label in "abc" for _ in range(8)]
HANDS = [10.0 * "abc".index(label) + i % 8 / 10 for i, label in enumerate(LABELS)]
PATHS = [Path(f"{i}.jpg") for i in range(24)]


def photos(groups=None, name="set"):
    return PhotoSet(name, PATHS, LABELS, groups)


def seen(missing=()):
    return [Seen(None if i in missing else hand, 1.0, 1.0) for i, hand in enumerate(HANDS)]


def test_methods_are_given_the_same_draws():
    one, other = Numbers(), Numbers()
    methods = {"one": one, "other": other}
    figures = accuracy(photos(), {name: seen() for name in methods}, methods, 3, 0)
    assert one.enrolled == other.enrolled
    assert figures["one"]["1"]["mean"] == figures["other"]["5"]["mean"] == 1.0
    assert figures["one"]["20"] is None


def test_missed_hand_is_wrong_and_not_enrolled_while_others_are_left():
    method = Numbers()
    figures = accuracy(photos(), {"x": seen(missing=range(4))}, {"x": method}, 20, 0)
    assert all(len(hands) == 3 for hands in method.enrolled[:20])
    # Of 8 + 8 + 8 photographs less one each, four are missed: never the enrolled ones.
    assert figures["x"]["1"]["mean"] == pytest.approx(17 / 21)


def test_groups_are_never_on_both_sides():
    groups = [f"room {i % 4}" for i in range(24)]
    method = Numbers()
    figures = accuracy(photos(groups), {"x": seen()}, {"x": method}, 5, 0)
    assert set(figures["x"]["1"]["per_group"]) <= set(groups)
    assert figures["x"]["1"]["mean"] == 1.0


def test_labels_left_out_are_rejected_where_hands_differ():
    curve = rejection(photos(), {"x": seen()}, {"x": Numbers()}, 3, 0)["x"]
    assert curve["labels_left_out"] == 1
    assert curve["missed_at_5_percent_accepted"] == 0.0


def test_one_set_enrolled_and_another_asked():
    other = PhotoSet("other", PATHS[:3], ["a", "b", "x"], None)
    looks = {"set": {"x": seen()}, "other": {"x": [Seen(h, 1, 1) for h in (0.0, 10.0, 20.0)]}}
    assert across(photos(), other, looks, {"x": Numbers()}, 2, 0) == {
        "x": {"1": 1.0, "5": 1.0, "20": None}
    }


def test_people_begin_where_the_digit_does_not_rise():
    paths = [Path(f"IMG_{n}.jpg") for n in (7, 1, 2, 3, 8)]
    groups = people(paths, ["4", "0", "1", "0", "9"])
    assert groups == ["person 1", "person 0", "person 0", "person 1", "person 1"]


def test_rooms_of_webcam_photographs(tmp_path):
    for name in ("2-1-0.jpg", "26-4-0.jpg"):
        path = tmp_path / "webcam-box" / "0" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(jpeg(draw("one", size=(64, 48))))
    assert read_set(tmp_path / "webcam-box", None).groups == ["2", "26"]


def test_bones_are_directions():
    points = np.random.default_rng(0).normal(size=(21, 3))
    directions = bone_directions(points)
    assert directions.shape == (60,)
    assert np.linalg.norm(directions.reshape(20, 3), axis=1) == pytest.approx(1, abs=1e-5)
    assert bone_directions(points * 7 + 3) == pytest.approx(directions, abs=1e-5)
    assert len(set(end for _, end in BONES)) == 20


def test_modes_are_the_paper_and_the_products():
    assert list(compared())[:2] == ["paper", "threshold"]
    paper = compared()["paper"]
    assert (paper.binarise.channel, paper.match.features) == ("luminance", "binary")


def test_table_shows_what_is_missing_as_a_dash():
    marks = {"1": {"mean": 0.5, "per_group": {"2": 0.25}}, "20": None}
    marks["5"] = marks["1"]
    row = {"accuracy": marks, "no_hand": 0.1, "photo": None, "video": None, "rejection": None}
    figures = {"photos": 3, "labels": 2, "groups": 2, "kind": "rooms", "rooms": {"2": 1, "3": 2}}
    text = markdown({"sets": {"box": {**figures, "methods": {"x": row}}}, "across": {}})
    assert "| x | 0.50 | 0.50 | - | 0.10 | - | - |" in text
    assert "| x | - | - | - | - | - | - |" in text
    assert "| 2 | 1 | 0.25 |" in text
    assert "| 3 | 2 | - |" in text
