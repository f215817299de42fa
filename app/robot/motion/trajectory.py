"""The one place that decides where the joints go next, 1/240 s at a time.

Holds position, velocity and acceleration of every joint and moves them on by ruckig
(L. Berscheid, T. Kroeger, "Jerk-limited Real-time Trajectory Generation with Arbitrary Target
States", RSS 2021), so that nothing ever jumps, whatever is asked.

ruckig knows no position limits in velocity control. They are kept by an invariant: *braking now
would end inside them*. Every step is first tried; a joint whose braking from there would end
outside brakes now instead, along the very profile that was checked one step before.
:mod:`app.robot.motion.guard` keeps the same invariant for distances and the tool's workspace.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from ruckig import ControlInterface, InputParameter, Result, Ruckig, Synchronization, Trajectory

from app.robot.arm import Vector
from app.robot.motion.limits import Limits, Pace

_REST_VELOCITY = 1e-6
"""rad/s"""
_REST_ACCELERATION = 1e-4
"""rad/s^2"""
_EPSILON = 1e-7
"""rad; rounding of ruckig's profiles."""


class Moment(NamedTuple):
    """Where the joints are at one time, and how they move; shape (n,) each."""

    position: Vector
    """rad"""
    velocity: Vector
    """rad/s"""
    acceleration: Vector
    """rad/s^2"""


class JointTrajectory:
    """Where the joints are commanded to be.

    Args:
        limits: What is never exceeded.
        joints: rad, shape (n,); where to begin.
        dt: s; one step.
    """

    def __init__(self, limits: Limits, joints: Vector, dt: float) -> None:
        self.limits = limits
        self.dt = dt
        self.scale = 1.0
        """Part of the ordinary speed at which motion runs. May change at any time: the velocity
        goes over to the new one within the ordinary acceleration and jerk."""
        self.slowed = 1.0
        """Part of that which is left near things; may change in the same way."""
        count = len(joints)
        self.position: Vector = np.zeros(count)
        self.velocity: Vector = np.zeros(count)
        self.acceleration: Vector = np.zeros(count)
        self._ruckig = Ruckig(count, dt)
        self._profile = Trajectory(count)
        self._braking = Trajectory(count)
        self._input = InputParameter(count)
        self._held_back = np.zeros(count)
        """Per joint: direction in which it brakes before its position limit, or 0."""
        self.reset(joints)

    def reset(self, joints: Vector) -> None:
        """Be at rest at ``joints`` (rad, shape (n,)): where the arm really is.

        An arm that is a little outside its limits may be commanded back inside.
        """
        self.position = np.asarray(joints, dtype=float).copy()
        self._rest()

    @property
    def at_rest(self) -> bool:
        """No joint moves or is about to."""
        return bool(
            np.abs(self.velocity).max() < _REST_VELOCITY
            and np.abs(self.acceleration).max() < _REST_ACCELERATION
        )

    @property
    def now(self) -> Moment:
        """The present moment."""
        return Moment(self.position, self.velocity, self.acceleration)

    @property
    def held_back(self) -> Vector:
        """Per joint: 1 or -1 while it stops short of its upper or lower limit, else 0."""
        return self._held_back

    def follow_velocity(self, wanted: Vector) -> None:
        """One step towards the joint velocities ``wanted`` (rad/s, shape (n,)), each on its own.

        Velocities above the ordinary pace are clipped, then scaled; a joint near its limit brakes.

        Raises:
            ValueError: ``wanted`` is not finite.
        """
        if not np.isfinite(wanted).all():
            raise ValueError(f"joint velocities must be finite, not {wanted}")
        pace = self.limits.ordinary
        wanted = self.scale * self.slowed * np.clip(wanted, -pace.velocity, pace.velocity)
        # Once a joint brakes for its limit it does so to the end, lest it should dither there.
        self._held_back[np.sign(wanted) != self._held_back] = 0.0
        wanted = np.where(self._held_back != 0.0, 0.0, wanted)
        self._solve(self._profile, wanted, pace)
        position, velocity, acceleration = map(np.array, self._profile.at_time(self.dt))
        refused = self._leaves(position, velocity, acceleration)
        if refused.any():
            self._held_back[refused] = np.sign(wanted[refused])
            self._solve(self._profile, np.where(refused, 0.0, wanted), pace)
            position, velocity, acceleration = map(np.array, self._profile.at_time(self.dt))
        self._become(position, velocity, acceleration)

    def brake(self, *, hard: bool = False) -> None:
        """One step towards standstill, at the ordinary pace or, ``hard``, at the stop's."""
        if self.at_rest:
            self._rest()
            return
        pace = self.limits.stop if hard else self.limits.ordinary
        self._solve(self._profile, np.zeros_like(self.position), pace)
        self._become(*map(np.array, self._profile.at_time(self.dt)))

    def become(self, moment: Moment) -> None:
        """Be at ``moment`` after this step: the caller answers for every limit.

        Raises:
            ValueError: it is not finite.
        """
        if not all(np.isfinite(part).all() for part in moment):
            raise ValueError(f"a moment must be finite, not {moment}")
        self._held_back = np.zeros_like(self.position)
        self._become(*moment)

    def braking(self, *, hard: bool = False) -> Trajectory:
        """The profile that :meth:`brake` would follow from now on.

        ``position_extrema``, ``duration`` and ``at_time`` tell of it. Valid until the next call of
        any method of this trajectory.
        """
        self._solve(
            self._braking,
            np.zeros_like(self.position),
            self.limits.stop if hard else self.limits.ordinary,
        )
        return self._braking

    def accept(self, position: Vector, velocity: Vector) -> bool:
        """Take ``position`` (rad) and ``velocity`` (rad/s) as the next step, if no limit forbids.

        Returns:
            False, and nothing has changed, when the step would break a limit or would make it
            impossible to brake before one.
        """
        acceleration = (velocity - self.velocity) / self.dt
        moved = position - self.position
        ordinary, stop = self.limits.ordinary, self.limits.stop
        fine = (
            np.isfinite(position).all()
            and np.isfinite(velocity).all()
            and (np.abs(velocity) <= ordinary.velocity).all()
            and (np.abs(acceleration) <= ordinary.acceleration).all()
            and (np.abs(acceleration - self.acceleration) <= stop.jerk * self.dt).all()
            # Position and velocity must tell the same story.
            and (np.abs(moved - velocity * self.dt) <= stop.acceleration * self.dt**2).all()
            and not self._leaves(position, velocity, acceleration).any()
        )
        if fine:
            self._held_back[:] = 0.0
            self._become(position, velocity, acceleration)
        return bool(fine)

    def _leaves(self, position: Vector, velocity: Vector, acceleration: Vector) -> np.ndarray:
        """Which joints, braking from there at the ordinary pace, would pass a position limit.

        A joint that is outside already counts only if it goes farther out. Shape (n,), bool.
        """
        given = self._state_input(self.limits.ordinary, position, velocity, acceleration)
        given.control_interface = ControlInterface.Velocity
        given.synchronization = Synchronization.No
        given.target_velocity = [0.0] * len(position)
        _checked(self._ruckig.calculate(given, self._braking))
        extrema = self._braking.position_extrema
        highest = np.array([bound.max for bound in extrema])
        lowest = np.array([bound.min for bound in extrema])
        above = highest > np.maximum(self.limits.upper, self.position) + _EPSILON
        below = lowest < np.minimum(self.limits.lower, self.position) - _EPSILON
        return np.asarray(above | below)

    def _solve(self, into: Trajectory, wanted: Vector, pace: Pace) -> None:
        given = self._state_input(pace)
        given.control_interface = ControlInterface.Velocity
        given.synchronization = Synchronization.No
        given.target_velocity = wanted.tolist()
        _checked(self._ruckig.calculate(given, into))

    def _state_input(
        self,
        pace: Pace,
        position: Vector | None = None,
        velocity: Vector | None = None,
        acceleration: Vector | None = None,
    ) -> InputParameter:
        given = self._input
        given.current_position = (self.position if position is None else position).tolist()
        given.current_velocity = (self.velocity if velocity is None else velocity).tolist()
        given.current_acceleration = (
            self.acceleration if acceleration is None else acceleration
        ).tolist()
        given.max_acceleration = pace.acceleration.tolist()
        given.max_jerk = pace.jerk.tolist()
        return given

    def _become(self, position: Vector, velocity: Vector, acceleration: Vector) -> None:
        self.position, self.velocity, self.acceleration = position, velocity, acceleration

    def _rest(self) -> None:
        self.velocity = np.zeros_like(self.position)
        self.acceleration = np.zeros_like(self.position)
        self._held_back = np.zeros_like(self.position)


def _checked(result: Result) -> None:
    if result not in (Result.Working, Result.Finished):
        raise ArithmeticError(f"ruckig found no profile: {result}")


def describe_limits(held_back: Vector, names: Sequence[str]) -> tuple[str, ...]:
    """One plain sentence for each joint that stops short of a limit."""
    return tuple(
        f"{name} is at its {'upper' if side > 0 else 'lower'} limit"
        for name, side in zip(names, held_back, strict=True)
        if side != 0
    )
