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
_MET_S = 0.05
"""Fingers of an arm that does not feel are taken for holding something when they have stood for
this long. They start within a cycle or two."""


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
        self._closing = self._held = False
        self.limits = limits

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """Keep the fingers going."""
        if self._last is None:
            self._grip(self._width, self._force)
            self._last = reading.gripper
            self._closing = self._width < reading.gripper
        moved = abs(reading.gripper - self._last)
        self._still = self._still + trajectory.dt if moved < _STILL_SPEED * trajectory.dt else 0.0
        self._last, self._held = reading.gripper, reading.held is not None
        self._time += trajectory.dt
        trajectory.brake()
        reached = abs(reading.gripper - self._width) < _REACHED
        return reached or self._still >= _STALLED_S or self._time >= _LONGEST_S

    def release(self) -> bool:
        """Fingers on their way stop where they are; fingers that hold something go on holding.

        What is held may still turn into its place between them, and they move with it: stopped
        there, they would lose it.
        """
        met = self._held or self._still >= _MET_S
        if self._last is not None and not (self._closing and met):
            self._grip(self._last, self._force)
        return False
