import numpy as np
import pytest

from app.errors import Invalid
from app.gestures.records import LANDMARK_BYTES, LANDMARK_FORMAT
from app.pipeline.hand_landmarks.shape import (
    DIMENSIONS,
    FORMAT,
    PACKED_BYTES,
    HandShape,
    ShapeFeatures,
)


def shape(seed: int = 0, right: float = 1.0) -> HandShape:
    """A hand of no anatomy."""
    rng = np.random.default_rng(seed)
    points = rng.normal(0, 0.5, (21, 3)).astype(np.float32)
    points[0], points[9] = 0, (0, -1, 0)
    return HandShape(points, points * np.float32(0.09), right)


def apart(one: HandShape, other: HandShape, *, either_hand: bool = True) -> float:
    features = ShapeFeatures(either_hand=either_hand)
    difference = features(one)[:, None] - features(other)[None]
    return float(np.linalg.norm(difference, axis=-1).min())


def test_a_packed_hand_comes_back() -> None:
    before = shape()
    packed = before.pack()
    assert (len(packed), packed[0]) == (PACKED_BYTES, FORMAT)
    after = HandShape.unpack(packed)
    assert after.points == pytest.approx(before.points, abs=1e-4)
    assert after.world == pytest.approx(before.world, abs=1e-4)
    assert apart(before, after) < 0.01


def test_the_database_and_the_pipeline_agree_on_the_form() -> None:
    assert (LANDMARK_BYTES, LANDMARK_FORMAT) == (PACKED_BYTES, FORMAT)


@pytest.mark.parametrize("packed", [b"", bytes(254), b"\x01" + bytes(100)])
def test_other_bytes_are_refused(packed: bytes) -> None:
    with pytest.raises(Invalid, match="254 bytes"):
        HandShape.unpack(packed)


def test_size_does_not_matter_and_turn_does() -> None:
    hand = shape()
    larger = HandShape(hand.points * 2, hand.world * 2, hand.right)
    assert apart(hand, larger) < 1e-3
    quarter = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]], np.float32)
    turned = HandShape(hand.points @ quarter, hand.world @ quarter, hand.right)
    assert 0.2 < apart(hand, turned) < apart(hand, shape(1))


def test_either_hand_will_do_unless_the_settings_say_otherwise() -> None:
    hand = shape()
    assert apart(hand, hand.mirrored()) < 1e-3
    assert apart(hand, hand.mirrored(), either_hand=False) > 0.2


def test_a_hand_of_doubtful_side_is_compared_as_both() -> None:
    features = ShapeFeatures(either_hand=True)
    assert features(shape(right=0.97)).shape == (1, DIMENSIONS)
    assert features(shape(right=0.5)).shape == (2, DIMENSIONS)
    assert apart(shape(right=0.97), shape(right=0.5)) < 1e-3
