"""What all motions have in common."""

from typing import Protocol

from app.robot.arm import Reading
from app.robot.motion.at_work import AtWork
from app.robot.motion.trajectory import JointTrajectory


class Task(Protocol):
    """One action being done. Begins with the arm at rest; ``step`` is called once a cycle.

    A task that ends leaves the arm at rest. In a stop, it just stops being called.
    """

    limits: tuple[str, ...]
    """Limits at work, in plain words."""

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """Move ``trajectory`` on by one step.

        Returns:
            Whether the task has ended.
        """
        ...

    def release(self) -> bool:
        """The gesture was let go.

        Returns:
            True: the task brings the arm to rest itself and then ends; go on calling ``step``.
            False: do not call ``step`` any more; the caller brakes.
        """
        ...


def why_given_up(task: Task) -> AtWork | None:
    """Why a task ended although it was not done; None when it was, or has not ended.

    A task that can give up says so in an attribute ``gave_up``.
    """
    why: AtWork | None = getattr(task, "gave_up", None)
    return why
