"""A way round things from one place to another.

RRT-Connect (J. J. Kuffner and S. M. LaValle, "RRT-Connect: an efficient approach to single-query
path planning", ICRA 2000): two trees, from start and goal, grow towards random places and towards
one another. The path found is then shortened: a random part of it is replaced by the straight line,
where that is clear. Random numbers come from a fixed seed, so that the same question has the same
answer.

Joint space is measured in metres: a joint's radian counts as the largest distance that a point of
the arm can have from its axis. A line is clear when conservative advancement along it finds room
everywhere (see :mod:`app.robot.motion.guard`).

Searching is a generator that yields after every look, so that a 240 Hz loop can do a few looks in a
cycle; nothing here knows of time.
"""

from collections.abc import Callable, Generator

import numpy as np

from app.robot.arm import Vector

Search = Generator[None, None, list[Vector] | None]
"""Returns the places (rad, shape (n,)) to go to one after another, in straight lines, the last of
which is the goal; None when there is no way."""

_STEP = 0.35
"""m; how far a tree grows at once. About the size of what it must find its way round."""
_STRIDE = 0.015
"""m; looks along a line are no closer."""
_SHORTCUTS = 40
_NEAR = 1e-6


class Planner:
    """Finds ways between places at which the arm keeps clear.

    Args:
        lower: rad, shape (n,); limits of the joints.
        upper: rad, shape (n,).
        reach: m, shape (n,); what a radian of each joint counts.
        room: Asked for joints (rad, shape (n,)): how far (m) any point of the arm may travel from
            there before something is too near; negative when something is.
        seed: Of the random numbers.
    """

    def __init__(
        self,
        lower: Vector,
        upper: Vector,
        reach: Vector,
        room: Callable[[Vector], float],
        seed: int = 0,
    ) -> None:
        self._lower, self._upper, self._reach = lower, upper, reach
        self._room = room
        self._seed = seed

    def search(self, start: Vector, goal: Vector) -> Search:
        """Look for a way from ``start`` to ``goal`` (rad, shape (n,)), for as long as it is run.

        Returns None at once only where ``goal`` itself is too near to something.
        """
        yield
        if self._room(goal) < 0:
            return None
        if (yield from self._clear(start, goal)):
            return [goal]
        rng = np.random.default_rng(self._seed)
        path = yield from self._connect(start, goal, rng)
        path = yield from self._shorten(path, rng)
        return path[1:]

    def _connect(
        self, start: Vector, goal: Vector, rng: np.random.Generator
    ) -> Generator[None, None, list[Vector]]:
        trees = (_Tree(start, self._reach), _Tree(goal, self._reach))
        turn = 0
        while True:
            yield
            growing, other = trees[turn], trees[1 - turn]
            aim = rng.uniform(self._lower, self._upper)
            new = yield from self._grow(growing, aim)
            if new is not None:
                target = growing.places[new]
                while True:  # the other tree comes as near as it can
                    reached = yield from self._grow(other, target)
                    if reached is None:
                        break
                    if other.away(target, reached) < _NEAR:
                        ways = growing.way(new), other.way(reached)
                        first, second = ways if turn == 0 else ways[::-1]
                        return first + second[::-1][1:]
            turn = 1 - turn

    def _grow(self, tree: "_Tree", aim: Vector) -> Generator[None, None, int | None]:
        """Let ``tree`` grow by one step towards ``aim``; the number of the new place, or None."""
        nearest = tree.nearest(aim)
        base = tree.places[nearest]
        away = tree.away(aim, nearest)
        place = aim if away <= _STEP else base + (aim - base) * (_STEP / away)
        if away > _NEAR and (yield from self._clear(base, place)):
            return tree.add(place, nearest)
        return None

    def _clear(self, start: Vector, end: Vector) -> Generator[None, None, bool]:
        """Whether the straight line between two places is clear."""
        length = float(np.abs(end - start) @ self._reach)
        done, room = 0.0, 0.0
        while done < length:
            done = min(length, done + max(room, _STRIDE))
            yield
            room = self._room(start + (end - start) * (done / length))
            if room < 0:
                return False
        return True

    def _shorten(
        self, path: list[Vector], rng: np.random.Generator
    ) -> Generator[None, None, list[Vector]]:
        path = list(path)
        for _ in range(_SHORTCUTS):
            if len(path) < 3:
                break
            # Two points anywhere on the path, not only its corners.
            a, b = np.sort(rng.uniform(0, len(path) - 1, 2))
            i, j = int(a), int(b)
            if i == j:
                continue
            start = path[i] + (path[i + 1] - path[i]) * (a - i)
            end = path[j] + (path[j + 1] - path[j]) * (b - j)
            if (yield from self._clear(start, end)):
                path = [*path[: i + 1], start, end, *path[j + 1 :]]
        return (yield from self._skip(path))

    def _skip(self, path: list[Vector]) -> Generator[None, None, list[Vector]]:
        """Leave out every corner that the arm need not go to."""
        kept, at = [path[0]], 0
        while at < len(path) - 1:
            to = len(path) - 1
            while to > at + 1:
                if (yield from self._clear(path[at], path[to])):
                    break
                to -= 1
            kept.append(path[to])
            at = to
        return kept


class _Tree:
    """Places, and from which each was reached."""

    def __init__(self, root: Vector, reach: Vector) -> None:
        self.places = [root]
        self._scaled = np.empty((64, len(root)))
        self._scaled[0] = root * reach
        self._from = [-1]
        self._reach = reach

    def add(self, place: Vector, parent: int) -> int:
        count = len(self.places)
        if count == len(self._scaled):
            self._scaled = np.concatenate([self._scaled, np.empty_like(self._scaled)])
        self._scaled[count] = place * self._reach
        self.places.append(place)
        self._from.append(parent)
        return count

    def nearest(self, place: Vector) -> int:
        away = np.abs(self._scaled[: len(self.places)] - place * self._reach).sum(axis=1)
        return int(away.argmin())

    def away(self, place: Vector, number: int) -> float:
        return float(np.abs(self.places[number] - place) @ self._reach)

    def way(self, number: int) -> list[Vector]:
        """From the root to a place."""
        way = []
        while number >= 0:
            way.append(self.places[number])
            number = self._from[number]
        return way[::-1]
