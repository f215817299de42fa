"""Standing still for a while."""

from app.link.actions import Wait
from app.robot.arm import Reading
from app.robot.motion.trajectory import JointTrajectory


class Pause:
    """Ends when the action's duration is over."""

    def __init__(self, action: Wait) -> None:
        self._left = action.duration
        self.limits: tuple[str, ...] = ()

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """Let time pass."""
        trajectory.brake()
        self._left -= trajectory.dt
        return self._left <= 1e-9 and trajectory.at_rest

    def release(self) -> bool:
        """The caller brakes: there is nothing to wait for."""
        return False
