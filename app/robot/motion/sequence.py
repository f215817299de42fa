"""Tasks one after another."""

from collections.abc import Callable
from collections.abc import Sequence as Several

from app.link.actions import Step
from app.robot.arm import Reading
from app.robot.motion.at_work import with_kind
from app.robot.motion.repeat import Place
from app.robot.motion.task import Refused, Task
from app.robot.motion.trajectory import JointTrajectory


class Sequence:
    """Each task begins when the one before has ended, at rest.

    A task that is refused ends all: what comes after it would begin in the wrong place.

    Args:
        places: What is to be done, repeats counted out.
        make: Makes the task of a step, when its turn has come.
    """

    def __init__(self, places: Several[Place], make: Callable[[Step], Task]) -> None:
        self._places = places
        self._make = make
        self._number = 0
        self._task: Task | None = None
        self._released = False
        self.limits: tuple[str, ...] = ()

    @property
    def place(self) -> Place:
        """The step whose turn it is, or was last."""
        return self._places[min(self._number, len(self._places) - 1)]

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """Go on with the task whose turn it is."""
        if self._task is None:
            self._task = self._make(self.place.action)
        place = str(self.place)
        try:
            ended = self._task.step(trajectory, reading)
        except Refused as refused:
            raise Refused(refused.why.at(place)) from None
        self.limits = tuple(with_kind(text).at(place) for text in self._task.limits)
        if ended:
            self._task = None
            self._number += 1
        return (ended and self._released) or self._number == len(self._places)

    def release(self) -> bool:
        """End with the task whose turn it is."""
        self._released = True
        return self._task is not None and self._task.release()
