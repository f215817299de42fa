import json

import numpy as np
import pytest

from app.errors import Invalid, NotFound
from app.pipeline.evaluate import UNKNOWN, evaluate
from tests.pipeline.drawing import PHOTOS, draw, encoded, jpeg

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
    result = evaluate(tree, shots=1, trials=3, seed=1)
    assert result["accuracy"] == {"mean": 1.0, "std": 0.0}
    assert result["labels"] == ["fist", "five", "one"]
    assert result["per_label"] == {"five": 1.0, "fist": 1.0, "one": 1.0}
    assert result["confusion"]["one"] == {"one": 9}
    assert (result["rejected"], result["unknown_accepted"]) == (0.0, None)
    assert set(result["ms_per_image"]) == {"p50", "p99"}
    json.dumps(result, allow_nan=False)


def test_same_seed_gives_the_same_figures(tree):
    def run(seed):
        result = evaluate(tree, shots=2, trials=2, seed=seed, reject=True)
        return {key: value for key, value in result.items() if key not in MEASURED}

    assert run(5) == run(5)


def test_unknown_labels_are_accepted_without_rejection(tree, others):
    result = evaluate(tree, trials=1, unknown=others)
    assert result["unknown_images"] == 1
    assert result["unknown_accepted"] == 1.0
    assert evaluate(tree, trials=1, unknown=others, reject=True)["unknown_accepted"] in (0.0, 1.0)


def test_picture_without_a_hand_counts_as_wrong(tree, tmp_path):
    for shape in ("one", "five"):
        (tmp_path / shape).mkdir()
        for path in (tree / shape).iterdir():
            (tmp_path / shape / path.name).write_bytes(path.read_bytes())
    (tmp_path / "one" / "wall.png").write_bytes(encoded(np.full((100, 100, 3), 99, np.uint8)))
    (tmp_path / "one" / "broken.jpg").write_bytes(b"nothing")
    result = evaluate(tmp_path, shots=2, trials=4)
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
        evaluate(tree, shots=shots, trials=trials)


def test_missing_and_empty_folders(tree, tmp_path):
    with pytest.raises(NotFound, match=r"^no folder "):
        evaluate(tmp_path / "none")
    (tmp_path / "label").mkdir()
    with pytest.raises(Invalid, match=r"^no pictures in "):
        evaluate(tmp_path)
    with pytest.raises(Invalid, match=r"^every label in .* is enrolled: others are needed$"):
        evaluate(tree, unknown=tree)


def test_no_hand_anywhere(tmp_path):
    (tmp_path / "a").mkdir()
    for n in range(3):
        (tmp_path / "a" / f"{n}.png").write_bytes(encoded(np.zeros((64, 64, 3), np.uint8)))
    with pytest.raises(Invalid, match=r"^no hand was found in any of the pictures$"):
        evaluate(tmp_path)


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
