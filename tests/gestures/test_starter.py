from itertools import combinations, pairwise, product
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from app.config import PipelineSettings
from app.errors import Invalid
from app.gestures import read_set
from app.gestures.hand import POSES
from app.gestures.hand.poses import ALSO
from app.gestures.starter import ACTIONS, VARIANTS, draw_starter_set, starter_pictures
from app.link.actions import Gripper, Home, JogCartesian, Stop
from app.pipeline import Gallery, PcaMatcher, extract_template
from app.pipeline.hand_landmarks.shape import HandShape
from tests.gestures.conftest import STARTER

PHOTOS = Path(__file__).parents[2].parent / "shared" / "data" / "digits"
SET = {gesture.name: gesture for gesture in read_set(STARTER)}


def pixels(template: bytes) -> NDArray[np.uint8]:
    return np.unpackbits(np.frombuffer(template, np.uint8))


def test_there_are_ten_gestures_with_several_samples_each() -> None:
    expected = ["forward", "back", "left", "right", "up", "down", "open", "close", "home", "stop"]
    assert list(SET) == list(ACTIONS) == list(POSES) == expected
    for name, gesture in SET.items():
        assert len(gesture.templates) == len(VARIANTS) + 3 * len(ALSO.get(name, ()))


@pytest.mark.parametrize(
    ("name", "linear"),
    [
        ("forward", (0.1, 0.0, 0.0)),
        ("back", (-0.1, 0.0, 0.0)),
        ("left", (0.0, 0.1, 0.0)),
        ("right", (0.0, -0.1, 0.0)),
        ("up", (0.0, 0.0, 0.1)),
        ("down", (0.0, 0.0, -0.1)),
    ],
)
def test_six_are_moves_in_an_exact_direction(name: str, linear: tuple[float, ...]) -> None:
    assert SET[name].action == JogCartesian(frame="base", linear=linear, angular=(0, 0, 0))


def test_four_are_gripper_home_and_stop() -> None:
    assert [SET[name].action for name in ("open", "close", "home", "stop")] == [
        Gripper(width=0.08),
        Gripper(width=0.0),
        Home(),
        Stop(),
    ]


@pytest.mark.parametrize(("a", "b"), list(combinations(SET, 2)))
def test_templates_of_two_gestures_are_far_apart(a: str, b: str) -> None:
    """The nearest pair of any two gestures differs in more pixels than 7 of 100."""
    nearest = min(
        np.mean(pixels(one) != pixels(other))
        for one, other in product(SET[a].templates, SET[b].templates)
    )
    assert nearest > 0.07


def test_nothing_comes_near_stop_or_is_taken_for_it() -> None:
    others = [t for name, gesture in SET.items() if name != "stop" for t in gesture.templates]
    nearest = min(
        np.mean(pixels(one) != pixels(other)) for one in SET["stop"].templates for other in others
    )
    assert nearest > 0.15


def test_samples_of_one_gesture_differ() -> None:
    for gesture in SET.values():
        assert len(set(gesture.templates)) == len(gesture.templates)


def extract(data: bytes) -> NDArray[np.uint8]:
    return extract_template(data, PipelineSettings()).template


def test_the_shipped_templates_are_what_the_pipeline_makes_of_the_drawings() -> None:
    for name in ACTIONS:
        picture = starter_pictures(name)[0]
        drawn = extract(cv2.imencode(".png", picture)[1].tobytes())
        # Other versions of OpenCV round other pixels of the outline.
        assert np.mean(drawn.ravel() != pixels(SET[name].templates[0])) < 0.01


def test_every_sample_left_out_is_nearest_to_one_of_its_own() -> None:
    samples = [(name, pixels(t)) for name, gesture in SET.items() for t in gesture.templates]
    for name, sample in samples:
        others = [(np.mean(sample != o), label) for label, o in samples if o is not sample]
        assert min(others)[1] == name


@pytest.mark.skipif(not PHOTOS.is_dir(), reason="needs the photographs in ../shared/data/digits")
def test_hands_of_strangers_are_read_by_the_drawn_set() -> None:
    """Real hands, none of them enrolled: most are read, and hardly one is taken for another."""
    labels = tuple(name for name, gesture in SET.items() for _ in gesture.templates)
    templates = [pixels(t).reshape(80, 60) for g in SET.values() for t in g.templates]
    known = [hand for g in SET.values() for hand in g.landmarks]
    hands = tuple(None if hand is None else HandShape.unpack(hand) for hand in known)
    settings = PipelineSettings()
    matcher = PcaMatcher.fit(Gallery(labels, np.array(templates), hands), settings.match)
    assert matcher.by_landmarks is not None
    right = wrong = count = 0
    for digit, name in (("1", "up"), ("2", "forward"), ("4", "back"), ("5", "stop")):
        for photo in sorted((PHOTOS / digit).glob("*.jpg"))[:20]:
            match = matcher.match_photo(extract_template(photo.read_bytes(), settings)).match
            assert match is not None
            count += 1
            right += match.accepted and match.gesture == name
            wrong += match.accepted and match.gesture != name
    assert count == 80
    assert right >= 0.7 * count
    assert wrong <= 0.05 * count


def test_the_same_pictures_are_drawn_each_time() -> None:
    one, other = (starter_pictures("up")[-1] for _ in range(2))
    np.testing.assert_array_equal(one, other)


def test_drawing_writes_a_set(tmp_path: Path) -> None:
    count = 0

    def fake(data: bytes) -> tuple[NDArray[np.uint8], bytes | None]:
        nonlocal count
        count += 1
        picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        assert picture.shape == (480, 640, 3)
        template = np.zeros((80, 60), np.uint8)
        template.flat[:count] = 1
        return template, bytes((1, *bytes(253)))

    drawn = draw_starter_set(tmp_path / "set", fake)
    assert read_set(tmp_path / "set") == drawn
    assert count == sum(len(gesture.templates) for gesture in SET.values())
    sizes = [int(pixels(t).sum()) for gesture in drawn for t in gesture.templates]
    assert all(b == a + 1 for a, b in pairwise(sizes))


def test_what_is_no_template_is_refused(tmp_path: Path) -> None:
    with pytest.raises(Invalid, match=r"the shape \(80, 60\).*got \(60, 80\)"):
        draw_starter_set(tmp_path / "set", lambda data: (np.zeros((60, 80), np.uint8), None))
    assert list(tmp_path.iterdir()) == []
