"""Moving the fingers."""

from collections.abc import Callable

from app.robot.arm import Reading
from app.robot.motion.trajectory import JointTrajectory

_REACHED = 0.001
"""m"""
_STALLED_S = 0.3
"""Fingers that have not moved for this long hold something, or cannot go on."""
_STILL_SPEED = 0.002
"""m/s"""
_LONGEST_S = 5.0


class Grip:
    """Ends when the fingers are at ``width``, or have met something.

    Args:
        width: m between the fingers.
        force: N of each finger; None: the gripper's own.
        grip: The arm's own ``grip``.
        limits: What was clipped, in plain words.
    """

    def __init__(
        self,
        width: float,
        force: float | None,
        grip: Callable[[float, float | None], None],
        limits: tuple[str, ...] = (),
    ) -> None:
        self._width = width
        self._force = force
        self._grip = grip
        self._time = 0.0
        self._still = 0.0
        self._last: float | None = None
        self.limits = limits

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """Keep the fingers going."""
        if self._last is None:
            self._grip(self._width, self._force)
            self._last = reading.gripper
        moved = abs(reading.gripper - self._last)
        self._still = self._still + trajectory.dt if moved < _STILL_SPEED * trajectory.dt else 0.0
        self._last = reading.gripper
        self._time += trajectory.dt
        trajectory.brake()
        reached = abs(reading.gripper - self._width) < _REACHED
        return reached or self._still >= _STALLED_S or self._time >= _LONGEST_S

    def release(self) -> bool:
        """The caller brakes."""
        return False
