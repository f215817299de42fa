"""Straight lines between joint angles, at the pace that the slowest joint allows."""

import numpy as np
from ruckig import InputParameter, Result, Ruckig, Trajectory

from app.robot.arm import Vector
from app.robot.motion.trajectory import JointTrajectory, Moment

_NOTHING = 1e-9
"""rad"""


class JointLine:
    """From rest at one place to rest at another: the joints' path is straight, whatever the pace.

    The arm is at ``start + s(t) u``, with ``u`` the direction in which the joint that turns most
    turns by 1, and ``s`` moved by ruckig within the limits of the joint that is worst off::

        |s'| <= min_i v_i / |u_i|, and so with acceleration and jerk

    Args:
        trajectory: At rest; its limits count.
        target: rad, shape (n,), inside the limits.

    Raises:
        ValueError: the target is not finite, or outside the limits.
    """

    def __init__(self, trajectory: JointTrajectory, target: Vector) -> None:
        limits = trajectory.limits
        if not np.isfinite(target).all():
            raise ValueError(f"joint targets must be finite, not {target}")
        if (target < limits.lower).any() or (target > limits.upper).any():
            raise ValueError(f"joint targets {target} are outside the limits")
        self._start, self._target = trajectory.position.copy(), target.copy()
        way = target - self._start
        self._length = float(np.abs(way).max())
        if self._length < _NOTHING:
            return
        self._direction = way / self._length
        part = np.maximum(np.abs(self._direction), 1e-12)
        pace = limits.ordinary
        self._speed = float((pace.velocity / part).min())
        self._ruckig = Ruckig(1, trajectory.dt)
        self._profile = Trajectory(1)
        self._input = InputParameter(1)
        self._input.target_position = [self._length]
        self._input.max_acceleration = [float((pace.acceleration / part).min())]
        self._input.max_jerk = [float((pace.jerk / part).min())]
        self._now = (0.0, 0.0, 0.0)

    def step(self, trajectory: JointTrajectory) -> bool:
        """One step nearer.

        Returns:
            Whether the target is reached, at rest.
        """
        nothing = np.zeros_like(self._target)
        if self._length >= _NOTHING:
            given = self._input
            (given.current_position, given.current_velocity, given.current_acceleration) = (
                [value] for value in self._now
            )
            given.max_velocity = [self._speed * trajectory.scale * trajectory.slowed]
            result = self._ruckig.calculate(given, self._profile)
            if result not in (Result.Working, Result.Finished):
                raise ArithmeticError(f"ruckig found no profile: {result}")
            if self._profile.duration > trajectory.dt:
                (place,), (speed,), (change,) = self._profile.at_time(trajectory.dt)
                self._now = place, speed, change
                u = self._direction
                trajectory.become(Moment(self._start + place * u, speed * u, change * u))
                return False
        trajectory.become(Moment(self._target.copy(), nothing, nothing.copy()))
        return True
