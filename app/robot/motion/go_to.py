"""Going to given joint angles, and standing there."""

from collections.abc import Callable

from app.robot.arm import Reading, Vector
from app.robot.motion.at_work import AtWork
from app.robot.motion.line import JointLine
from app.robot.motion.planner import Search
from app.robot.motion.task import Refused
from app.robot.motion.trajectory import JointTrajectory

_LOOKS = 6
"""Looks of a search in one cycle: half a millisecond with the PUMA 560 and its scene."""


class GoTo:
    """Ends exactly at ``target`` (rad, shape (n,)), which lies inside the limits.

    The joints' path is a straight line.
    """

    def __init__(self, target: Vector, limits: tuple[str, ...] = ()) -> None:
        self._target = target
        self._line: JointLine | None = None
        self.limits = limits

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """One step nearer; all joints arrive together."""
        if self._line is None:
            self._line = JointLine(trajectory, self._target)
        return self._line.step(trajectory)

    def release(self) -> bool:
        """The caller brakes."""
        return False


class GoClear:
    """Goes to ``target`` (rad, shape (n,)) by a way that keeps clear of things.

    The arm stands while the way is looked for, and at each of its corners.

    Args:
        target: Inside the limits.
        name: What the target is called.
        search: Begins a search from the given joints.
        nearest: Says in plain words what is too near with the joints at a target.
        patience: s; the longest search.
    """

    def __init__(
        self,
        target: Vector,
        name: str,
        search: Callable[[Vector, Vector], Search],
        nearest: Callable[[Vector], str | None],
        patience: float,
    ) -> None:
        self._target = target
        self._name = name
        self._begin = search
        self._nearest = nearest
        self._search: Search | None = None
        self._left = patience
        self._way: list[Vector] = []
        self._line: JointLine | None = None
        self.limits: tuple[str, ...] = ()

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """Look for the way, then go it."""
        if self._line is None and not self._way:
            self._look(trajectory)
            return False
        if self._line is None:
            self._line = JointLine(trajectory, self._way.pop(0))
        if not self._line.step(trajectory):
            return False
        self._line = None
        return not self._way

    def release(self) -> bool:
        """The caller brakes."""
        return False

    def _look(self, trajectory: JointTrajectory) -> None:
        """Go on with the search for as long as one cycle has time for."""
        trajectory.brake()
        if self._search is None:
            self._search = self._begin(trajectory.position.copy(), self._target)
        self._left -= trajectory.dt
        if self._left <= 0:
            text = f"found no way to {self._name} that keeps clear of things"
            raise Refused(AtWork(text, "unreachable"))
        try:
            for _ in range(_LOOKS):
                next(self._search)
        except StopIteration as ended:
            if ended.value is None:
                what = self._nearest(self._target)
                text = f"{self._name} is too near to something now: {what}"
                raise Refused(AtWork(text, "collision")) from None
            self._way = ended.value
            self.limits = (AtWork("goes round things", "note"),) if len(self._way) > 1 else ()
        else:
            self.limits = (AtWork("looking for a way that keeps clear of things", "note"),)
