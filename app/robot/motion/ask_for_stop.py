"""The step ``stop`` of a sequence."""

from collections.abc import Callable

from app.robot.arm import Reading
from app.robot.motion.trajectory import JointTrajectory


class AskForStop:
    """Tells ``ask`` once, and ends. The stop itself is the safety supervisor's."""

    def __init__(self, ask: Callable[[], None]) -> None:
        self._ask = ask
        self.limits: tuple[str, ...] = ()

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """Ask."""
        trajectory.brake()
        self._ask()
        return True

    def release(self) -> bool:
        """The caller brakes."""
        return False
