import numpy as np

from app.config import MotionSettings
from app.pipeline.hand_landmarks.stillness import Rest, Stillness
from app.pipeline.hand_landmarks.types import HandLandmarks, Region

RNG = np.random.default_rng(5)
HAND = RNG.normal(0, 40, (21, 3)).astype(np.float32)
HAND[0], HAND[9] = 0, (0, -100, 0)
FEATURES = RNG.normal(0, 0.05, (1, 218)).astype(np.float32)


def play(ways: list[tuple[float, float]], change: float = 0.0, rate: float = 30.0) -> list[Rest]:
    """Rest after each frame, for a hand of palm length 100 at these places."""
    look = Stillness(MotionSettings())
    seen = []
    for number, (x, y) in enumerate(ways):
        points = HAND + np.array([x + 300, y + 200, 0], np.float32)
        hand = HandLandmarks(points, HAND, 1.0, 1.0, Region(0, 0, 1, 0))
        features = FEATURES + np.float32(change * number)
        seen.append(look(hand, features, number / rate))
    return seen


def test_nothing_is_said_before_three_frames_and_nothing_starts_before_it_has_settled() -> None:
    seen = play([(0, 0)] * 12)
    assert [rest.speed is None for rest in seen[:4]] == [True, True, True, False]
    assert seen[4].still and not seen[4].settled
    assert seen[-1].settled


def test_a_hand_that_trembles_rests() -> None:
    tremor = [(float(x), float(y)) for x, y in RNG.normal(0, 3, (30, 2))]
    assert all(rest.still and rest.settled for rest in play(tremor)[9:])


def test_a_hand_on_its_way_does_not_rest() -> None:
    seen = play([(12.0 * number, 0.0) for number in range(15)])  # 3.6 palm lengths a second
    assert not any(rest.still or rest.settled for rest in seen)
    assert seen[-1].nearly_still


def test_a_hand_that_changes_its_shape_in_place_has_not_settled() -> None:
    seen = play([(0.0, 0.0)] * 15, change=0.004)
    assert seen[-1].still and not seen[-1].settled
    assert seen[-1].change is not None and seen[-1].change > 0.3


def test_it_goes_by_the_clock_not_by_frames() -> None:
    slow = play([(0.0, 0.0)] * 6, rate=10)
    assert [rest.settled for rest in slow] == [False, False, False, True, True, True]
