import json

import numpy as np
import pytest

from app.errors import Invalid, NotFound
from app.pipeline.evaluate import UNKNOWN, evaluate
from tests.pipeline.drawing import PHOTOS, SETTINGS, draw, encoded, jpeg

MEASURED = ("ms_per_image",)


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    root = tmp_path_factory.mktemp("photos")
    for shape in ("fist", "one", "five"):
        (root / shape).mkdir()
        for n, scale in enumerate((0.8, 0.9, 1.0, 1.1)):
            (root / shape / f"{n}.jpg").write_bytes(jpeg(draw(shape, size=(160, 120), scale=scale)))
    (root / "notes.txt").write_text("not a label")
    return root


@pytest.fixture(scope="module")
def others(tmp_path_factory):
    root = tmp_path_factory.mktemp("others")
    (root / "two").mkdir()
    (root / "two" / "a.png").write_bytes(encoded(draw("two")))
    (root / "fist").mkdir()
    (root / "fist" / "a.png").write_bytes(encoded(draw("fist")))
    return root


def test_drawn_hands_are_told_apart(tree):
    result = evaluate(tree, settings=SETTINGS, shots=1, trials=3, seed=1)
    assert result["accuracy"] == {"mean": 1.0, "std": 0.0}
    assert result["labels"] == ["fist", "five", "one"]
    assert result["per_label"] == {"five": 1.0, "fist": 1.0, "one": 1.0}
    assert result["confusion"]["one"] == {"one": 9}
    assert (result["rejected"], result["unknown_accepted"]) == (0.0, None)
    assert set(result["ms_per_image"]) == {"p50", "p99"}
    json.dumps(result, allow_nan=False)


def test_same_seed_gives_the_same_figures(tree):
    def run(seed):
        result = evaluate(tree, settings=SETTINGS, shots=2, trials=2, seed=seed, reject=True)
        return {key: value for key, value in result.items() if key not in MEASURED}

    assert run(5) == run(5)


def test_unknown_labels_are_accepted_without_rejection(tree, others):
    result = evaluate(tree, settings=SETTINGS, trials=1, unknown=others)
    assert result["unknown_images"] == 1
    assert result["unknown_accepted"] == 1.0
    assert evaluate(tree, settings=SETTINGS, trials=1, unknown=others, reject=True)[
        "unknown_accepted"
    ] in (0.0, 1.0)


def test_labels_known_and_unknown_are_asked_once(tree, others):
    result = evaluate(tree, settings=SETTINGS, trials=2, unknown=others)
    assert (result["asked"], result["unknown_asked"]) == (2 * 3 * 3, 2)
    assert (result["unknown_images"], result["holdout_labels"]) == (1, 0)


def test_curve_only_with_something_unknown(tree, others):
    keys = ("curve", "missed_at_5_percent_accepted", "accepted_at_90_percent_passed")
    assert [evaluate(tree, settings=SETTINGS, trials=1)[key] for key in keys] == [None] * 3
    result = evaluate(tree, settings=SETTINGS, trials=1, unknown=others, reject=True)
    own = next(point for point in result["curve"] if point["threshold"] == 1.0)
    assert own["known_passed"] == pytest.approx(1 - result["rejected"])
    assert own["unknown_accepted"] == result["unknown_accepted"]
    json.dumps(result, allow_nan=False)


def test_labels_left_out_play_the_unknown(tree):
    result = evaluate(tree, settings=SETTINGS, shots=2, trials=4, holdout_labels=1, reject=True)
    assert (result["asked"], result["unknown_asked"]) == (4 * 2 * 2, 4 * 4)
    assert result["curve"]
    assert evaluate(tree, settings=SETTINGS, trials=1, holdout_labels=2)["accuracy"]["mean"] == 1.0
    for number in (-1, 3):
        message = f"^{number} of 3 labels cannot be left out: 0 to 2 are possible$"
        with pytest.raises(Invalid, match=message):
            evaluate(tree, settings=SETTINGS, holdout_labels=number)


def test_groups_are_kept_apart(tree, others):
    result = evaluate(tree, settings=SETTINGS, trials=3, group=r"^(\d)\.")
    assert (result["groups"], result["asked"]) == (4, 3 * 3 * 2)
    assert set(result["per_group"]) <= set("0123")
    assert set(result["per_group"].values()) == {1.0}
    with pytest.raises(Invalid, match=r"^4 groups: no half of them has 3 pictures of every label"):
        evaluate(tree, settings=SETTINGS, shots=3, group=r"^\d")
    with pytest.raises(Invalid, match=r"^group '\^\\\\d' finds nothing in the file name a\.png$"):
        evaluate(tree, settings=SETTINGS, unknown=others, group=r"^\d")


def test_unknown_of_a_group_enrolled_from_is_not_asked(tree, tmp_path):
    (tmp_path / "two").mkdir()
    for n in range(4):
        (tmp_path / "two" / f"{n}.png").write_bytes(encoded(draw("two")))
    assert (
        evaluate(tree, settings=SETTINGS, trials=3, unknown=tmp_path, group=r"^\d")["unknown_asked"]
        == 3 * 2
    )


def test_picture_without_a_hand_counts_as_wrong(tree, tmp_path):
    for shape in ("one", "five"):
        (tmp_path / shape).mkdir()
        for path in (tree / shape).iterdir():
            (tmp_path / shape / path.name).write_bytes(path.read_bytes())
    (tmp_path / "one" / "wall.png").write_bytes(encoded(np.full((100, 100, 3), 99, np.uint8)))
    (tmp_path / "one" / "broken.jpg").write_bytes(b"nothing")
    result = evaluate(tmp_path, settings=SETTINGS, shots=2, trials=4)
    assert result["no_hand"] == 2
    assert result["per_label"]["one"] == 0.5
    assert result["confusion"]["one"] == {"one": 8, UNKNOWN: 8}


@pytest.mark.parametrize(
    ("shots", "trials", "message"),
    [
        (4, 1, r"^too few pictures for 4 shots: fist \(4\), five \(4\), one \(4\); at least 5"),
        (0, 1, "^0 shots and 1 trials: at least 1 of each is needed$"),
        (1, 0, "^1 shots and 0 trials: at least 1 of each is needed$"),
    ],
)
def test_too_few(tree, shots, trials, message):
    with pytest.raises(Invalid, match=message):
        evaluate(tree, settings=SETTINGS, shots=shots, trials=trials)


def test_missing_and_empty_folders(tree, tmp_path):
    with pytest.raises(NotFound, match=r"^no folder "):
        evaluate(tmp_path / "none", settings=SETTINGS)
    (tmp_path / "label").mkdir()
    with pytest.raises(Invalid, match=r"^no pictures in "):
        evaluate(tmp_path, settings=SETTINGS)
    with pytest.raises(Invalid, match=r"^every label in .* is enrolled: others are needed$"):
        evaluate(tree, settings=SETTINGS, unknown=tree)


def test_no_hand_anywhere(tmp_path):
    (tmp_path / "a").mkdir()
    for n in range(3):
        (tmp_path / "a" / f"{n}.png").write_bytes(encoded(np.zeros((64, 64, 3), np.uint8)))
    with pytest.raises(Invalid, match=r"^no hand was found in any of the pictures$"):
        evaluate(tmp_path, settings=SETTINGS)


@pytest.fixture(scope="module")
def some_digits(tmp_path_factory):
    if not PHOTOS.is_dir():
        pytest.skip("no photographs beside the repository")
    root = tmp_path_factory.mktemp("digits")
    for folder in sorted((PHOTOS / "digits").iterdir()):
        (root / folder.name).mkdir()
        for path in sorted(folder.glob("*.jpg"))[::3]:
            (root / folder.name / path.name).symlink_to(path)
    return root


@pytest.mark.parametrize(("shots", "least"), [(1, 0.6), (5, 0.82), (20, 0.9)])
def test_digit_signs_of_other_people(some_digits, shots, least):
    result = evaluate(some_digits, shots=shots, trials=2, seed=0)
    assert result["accuracy"]["mean"] >= least
