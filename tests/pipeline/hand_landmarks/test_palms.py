import numpy as np
import pytest

from app.pipeline.hand_landmarks.files import path_of
from app.pipeline.hand_landmarks.palms import PalmDetector, anchors, merge, whole
from tests.pipeline.hand_landmarks.drawn import in_room, plain, room


def test_there_are_2016_anchors_in_two_layers() -> None:
    centres = anchors()
    assert centres.shape == (2016, 2)
    assert centres[:2] == pytest.approx(np.full((2, 2), 0.5 / 24))
    assert centres[1151] == pytest.approx((23.5 / 24, 23.5 / 24))
    assert centres[1152:1158] == pytest.approx(np.full((6, 2), 0.5 / 12))


def test_boxes_that_overlap_become_their_weighted_mean() -> None:
    boxes = np.array([[0, 0, 10, 10], [1, 0, 11, 10], [50, 50, 60, 60]], np.float32)
    points = np.array([[[0, 0]], [[4, 0]], [[55, 55]]], np.float32)
    merged, seven = merge(boxes, points, np.array([0.6, 0.9, 0.7], np.float32), 0.3)
    assert len(merged) == 2
    assert merged[0] == pytest.approx([0.6, 0, 10.6, 10, 0.9])
    assert seven[0, 0] == pytest.approx([2.4, 0])
    assert merged[1] == pytest.approx([50, 50, 60, 60, 0.7])


@pytest.mark.parametrize("size", ["lite", "full"])
def test_a_hand_in_a_room_is_found_and_a_room_alone_holds_none(size: str) -> None:
    find = PalmDetector(path_of("palm", size))  # type: ignore[arg-type]
    (palm,) = find(in_room(at=(300, 260)), 0.5)
    left, top, right, _ = palm.box
    assert 200 < left < 300 < right < 420
    assert top < palm.points[0, 1] and palm.points[2, 1] < palm.points[0, 1]
    assert find(room(), 0.5) == []


def test_looking_with_a_margin_gives_the_same_place() -> None:
    find = PalmDetector(path_of("palm", "full"))
    picture = plain()
    ((one, _, _), *_), ((other, _, _), *_) = (
        find(picture, 0.3),
        find(picture, 0.3, whole(picture, 1.5)),
    )
    assert one == pytest.approx(other, abs=15)
    grey = np.ascontiguousarray(picture[:, :, 1:2])
    assert find(grey, 0.3)
