from pathlib import Path

import numpy as np
import pytest

from app.errors import Invalid
from app.pipeline.trials import draw_trial, groups_of

LABELS = ["a"] * 6 + ["b"] * 6 + ["c"] * 6
ROOMS = [f"room{i % 3}" for i in range(18)]


def trials(count=20, labels=LABELS, groups=None, shots=1, left_out=0):
    rng = np.random.default_rng(3)
    return [draw_trial(labels, groups, shots, left_out, rng) for _ in range(count)]


def test_without_groups_anything_may_be_enrolled_and_asked():
    for trial in trials():
        assert {label: sorted(order) for label, order in trial.order.items()} == {
            "a": list(range(6)),
            "b": list(range(6, 12)),
            "c": list(range(12, 18)),
        }
        assert trial.asked == list(range(18))
        assert (trial.strangers, trial.closed) == ([], frozenset())


def test_no_asked_photograph_shares_its_group_with_an_enrolled_one():
    seen = set()
    for trial in trials(groups=ROOMS, shots=2):
        enrolled = [i for mine in trial.enrol(2, [True] * 18).values() for i in mine]
        assert len(enrolled) == 6
        assert {ROOMS[i] for i in enrolled} <= trial.closed
        assert not trial.closed & {ROOMS[i] for i in trial.asked}
        assert {LABELS[i] for i in trial.asked} == {"a", "b", "c"}
        seen.add(trial.closed)
    assert len(seen) > 2


def test_labels_left_out_are_strangers_of_the_asked_groups():
    away = set()
    for trial in trials(groups=ROOMS, left_out=1):
        (name,) = {LABELS[i] for i in trial.strangers}
        assert name not in trial.order
        assert name not in {LABELS[i] for i in trial.asked}
        assert not trial.closed & {ROOMS[i] for i in trial.strangers}
        away.add(name)
    assert away == {"a", "b", "c"}


def test_usable_photographs_are_enrolled_first():
    usable = [i % 2 == 1 for i in range(18)]
    for trial in trials():
        chosen = trial.enrol(4, usable)["a"]
        assert len(chosen) == 4
        assert set(chosen) >= {1, 3, 5}


def test_same_seed_same_trials():
    assert trials(groups=ROOMS, left_out=1) == trials(groups=ROOMS, left_out=1)


@pytest.mark.parametrize("groups", [["one"] * 18, LABELS], ids=["one group", "a label each"])
def test_groups_that_cannot_be_split(groups):
    with pytest.raises(Invalid, match=r"^\d groups: no half of them has 1 pictures of every label"):
        trials(groups=groups)


def test_group_of_a_file_name():
    paths = [Path("x/2-0001-3.jpg"), Path("x/26-7-1.png")]
    assert groups_of(paths, "^[^-]+") == ["2", "26"]
    assert groups_of(paths, r"-(\d+)-") == ["0001", "7"]
    with pytest.raises(Invalid, match=r"^group 'z' finds nothing in the file name 2-0001-3\.jpg$"):
        groups_of(paths, "z")
    with pytest.raises(Invalid, match=r"^group '\(' is not a regular expression: missing \)"):
        groups_of(paths, "(")
