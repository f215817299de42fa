"""What all motions have in common."""

from typing import Protocol

from app.robot.arm import Reading
from app.robot.motion.at_work import AtWork, with_kind
from app.robot.motion.trajectory import JointTrajectory


class Refused(Exception):
    """A task cannot be done as things are; ``why`` says so in plain words.

    Not an error of anybody: the arm comes to rest, and a sequence goes no further.
    """

    def __init__(self, why: str) -> None:
        super().__init__(why)
        self.why: AtWork = with_kind(why)


class Task(Protocol):
    """One action being done. Begins with the arm at rest; ``step`` is called once a cycle.

    ``trajectory.scale`` times ``trajectory.slowed`` is the part of its speed that it may use now. A
    task that ends leaves the arm at rest. In a stop it is let go, and not called any more.
    """

    limits: tuple[str, ...]
    """Limits at work, in plain words."""

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """Move ``trajectory`` on by one step.

        Returns:
            Whether the task has ended.

        Raises:
            Refused: it cannot go on.
        """
        ...

    def release(self) -> bool:
        """The gesture was let go.

        Returns:
            True: the task brings the arm to rest itself and then ends; go on calling ``step``.
            False: do not call ``step`` any more; the caller brakes.
        """
        ...
