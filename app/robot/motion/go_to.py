"""Going to given joint angles, and standing there."""

from app.robot.arm import Reading, Vector
from app.robot.motion.trajectory import JointTrajectory


class GoTo:
    """Ends exactly at ``target`` (rad, shape (n,)), which lies inside the limits."""

    def __init__(self, target: Vector, limits: tuple[str, ...] = ()) -> None:
        self._target = target
        self.limits = limits

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """One step nearer; all joints arrive together."""
        return trajectory.follow_target(self._target)

    def release(self) -> bool:
        """The caller brakes."""
        return False
