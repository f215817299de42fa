"""The search for a way, in a plane with walls: quick to check by hand."""

from itertools import pairwise

import numpy as np
import pytest

from app.robot.motion.planner import Planner

LOWER, UPPER = np.array([-1.0, -1.0]), np.array([1.0, 1.0])
START, GOAL = np.array([-0.8, 0.0]), np.array([0.8, 0.0])


def wall(point: np.ndarray) -> float:
    """Room before a wall, 0.2 thick, from the lower edge up to 0.5."""
    x = max(0.0, abs(point[0]) - 0.1)
    y = max(0.0, point[1] - 0.5)
    return float(np.hypot(x, y)) - 0.05


def search(planner: Planner, start: np.ndarray, goal: np.ndarray, most: int = 20_000):
    steps = planner.search(start, goal)
    for count in range(most):
        try:
            next(steps)
        except StopIteration as ended:
            return ended.value, count
    return "never", most


def planner(room=wall, seed: int = 0) -> Planner:
    return Planner(LOWER, UPPER, np.ones(2), room, seed)


@pytest.mark.parametrize("seed", range(5))
def test_a_way_round_a_wall_is_clear_all_along(seed: int) -> None:
    way, _ = search(planner(seed=seed), START, GOAL)
    assert (way[-1] == GOAL).all()
    corners = [START, *way]
    length = 0.0
    for a, b in pairwise(corners):
        length += float(np.abs(b - a).sum())
        for part in np.linspace(0, 1, 200):
            point = a + (b - a) * part
            assert wall(point) > -0.008  # looks are 15 mm apart
            assert (point >= LOWER).all()
            assert (point <= UPPER).all()
    assert length < 4.0  # over the wall it is 2.7 at least
    assert len(way) <= 6


def test_where_the_straight_line_is_clear_it_is_the_way() -> None:
    way, looks = search(planner(lambda _: 0.3), START, GOAL)
    assert len(way) == 1
    assert looks < 10


def test_the_same_question_has_the_same_answer() -> None:
    first, _ = search(planner(), START, GOAL)
    second, _ = search(planner(), START, GOAL)
    assert np.array_equal(first, second)


def test_a_goal_in_the_wall_has_no_way() -> None:
    way, looks = search(planner(), START, np.array([0.0, 0.0]))
    assert way is None
    assert looks <= 1


def test_a_search_without_a_way_goes_on_and_on_in_small_steps() -> None:
    way, looks = search(planner(lambda p: abs(p[0]) - 0.1), START, GOAL, most=3000)
    assert (way, looks) == ("never", 3000)
