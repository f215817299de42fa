"""Tasks one after another."""

from collections.abc import Callable

from app.robot.arm import Reading
from app.robot.motion.task import Task
from app.robot.motion.trajectory import JointTrajectory


class Sequence:
    """Each task begins when the one before has ended, at rest.

    Args:
        steps: Makes each task, when its turn has come.
    """

    def __init__(self, steps: list[Callable[[], Task]]) -> None:
        self._steps = steps
        self._number = 0
        self._task: Task | None = None
        self._released = False
        self.limits: tuple[str, ...] = ()

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """Go on with the task whose turn it is."""
        if self._task is None:
            self._task = self._steps[self._number]()
        ended = self._task.step(trajectory, reading)
        place = f"step {self._number + 1} of {len(self._steps)}"
        self.limits = tuple(f"{place}: {text}" for text in self._task.limits)
        if ended:
            self._task = None
            self._number += 1
        return (ended and self._released) or self._number == len(self._steps)

    def release(self) -> bool:
        """End with the task whose turn it is."""
        self._released = True
        return self._task is not None and self._task.release()
