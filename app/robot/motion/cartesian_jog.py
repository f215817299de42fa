"""Moving the tool in a straight line, or turning it, at a constant speed.

The tool's reference pose runs along the wanted twist ``u`` at the pace ``s(t) u`` with ``s`` from 0
to 1 (ruckig, jerk-limited), so the line is straight by construction. Joint velocities follow from
damped least squares with feedback of the drift between reference and arm::

    dq = J^T (J J^T + m^2 I)^-1 (s u + K e)
    m^2 = 0 if w >= w0 else (1 - (w/w0)^2) m0^2,     w the smallest singular value of J

(Chiaverini, Siciliano and Egeland, "Review of the damped least-squares inverse kinematics with
experiments on an industrial robot manipulator", IEEE Trans. Control Systems Technology 2(2), 1994;
Nakamura and Hanafusa 1986.) Where a joint would pass its limit, ``s`` falls for all joints alike,
so that the tool stays on its line. ``s`` looks ahead: it is judged where the arm will be when it
could have slowed down.

A jog without a duration begins at a crawl (``ArmMotionSettings.creep``). From the moment a person
sees the tool move, the hand's way down, the pipeline and the release take about 0.6 s: at full
speed from the start nobody could move the tool by less than 6 cm (benchmarks/RESULTS.md).
"""

import math
from typing import NamedTuple

import numpy as np
from ruckig import ControlInterface, InputParameter, Result, Ruckig, Trajectory

from app.config import ArmMotionSettings
from app.link.actions import JogCartesian
from app.robot.arm import Kinematics, Reading, Vector
from app.robot.motion.limits import Limits
from app.robot.motion.rotation import difference, rotate, turn
from app.robot.motion.trajectory import JointTrajectory

_DRIFT_GAIN = 8.0
"""1/s; K above."""
_DAMPING = 0.04
"""m0 above: bounds dq near a singularity to |u| / (2 m0)."""
_DAMPED_BELOW = 0.05
"""w0 above."""
_LOOK_AHEAD_S = 0.2
_BLOCKED = 0.02
"""Part of the twist that damping may lose before the way counts as closed."""
_SLOWEST = 0.15
"""Near a singularity the tool keeps at least this part of its speed, so that it can leave."""
_MARGIN = 0.8
"""Part of a joint's ordinary acceleration that is planned with; the rest is for curvature."""


_KEEP_OFF = 0.005
"""rad; straight motion ends this far from a joint's limit."""


class _Ramp(NamedTuple):
    """How fast the pace may change."""

    acceleration: float
    """1/s^2"""
    jerk: float
    """1/s^3"""


class CartesianJog:
    """Runs until it is broken off, or for the action's duration.

    Args:
        action: What to do.
        kinematics: Of the arm.
        limits: Of the arm.
        settings: Speeds of straight motion.
    """

    def __init__(
        self,
        action: JogCartesian,
        kinematics: Kinematics,
        limits: Limits,
        settings: ArmMotionSettings,
    ) -> None:
        self._kinematics = kinematics
        self._limits = limits
        self._settings = settings
        self._frame = action.frame
        linear, angular = np.array(action.linear), np.array(action.angular)
        part = min(
            1.0,
            _part(settings.linear_speed, float(np.linalg.norm(linear))),
            _part(settings.angular_speed, float(np.linalg.norm(angular))),
        )
        self._linear, self._angular = part * linear, part * angular
        self._clipped = (
            (f"the tool moves at {100 * part:.0f}% of the speed asked for",) if part < 1 else ()
        )
        self._left = action.duration
        self._creeps_for = settings.creep_s if action.duration is None else 0.0
        self._crawl_left = 0.0
        self._pace = 0.0
        self._pace_rate = 0.0
        self._ruckig = Ruckig(1, 1.0)
        self._profile = Trajectory(1)
        self._input = InputParameter(1)
        self._input.control_interface = ControlInterface.Velocity
        self._twist: Vector | None = None
        self._position = np.zeros(3)
        self._orientation = np.zeros(4)
        self._thrown_off = False
        self.limits: tuple[str, ...] = ()

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """One step along the line."""
        over = self._left is not None and self._left <= 0
        if self._thrown_off or self._twist is None:
            if over or not trajectory.at_rest:
                trajectory.brake()
                return over and trajectory.at_rest
            self._begin(trajectory)
        if self._left is not None:
            self._left -= trajectory.dt
        jacobian = self._kinematics.jacobian(trajectory.position)
        now, _ = self._solve(jacobian, self._wanted())
        ramp = self._ramp(now)
        target, reasons = (0.0, ()) if over else self._allowed(trajectory, now, ramp)
        if self._crawl_left > 0:
            self._crawl_left -= trajectory.dt
            target = min(target, self._settings.creep)
        target = min(target, trajectory.scale) * trajectory.slowed
        self._advance(target, ramp, trajectory.dt)
        self.limits = self._clipped + reasons
        if self._pace < 1e-6 and abs(self._pace_rate) < 1e-4 and target == 0.0:
            trajectory.brake()
            return over and trajectory.at_rest
        velocity, _ = self._solve(jacobian, self._pace * self._wanted() + self._drift(trajectory))
        # The joints' path is curved: the mean velocity over the step, not that of its beginning.
        middle = trajectory.position + velocity * (trajectory.dt / 2)
        velocity, _ = self._solve(
            self._kinematics.jacobian(middle), self._pace * self._wanted() + self._drift(trajectory)
        )
        position = trajectory.position + velocity * trajectory.dt
        if not trajectory.accept(position, velocity):
            self._thrown_off = True
            trajectory.brake()
            return False
        twist = self._pace * self._wanted() * trajectory.dt
        self._position = self._position + twist[:3]
        self._orientation = turn(self._orientation, twist[3:])
        return False

    def release(self) -> bool:
        """Slow down along the line."""
        if self._twist is None or self._thrown_off:
            return False
        self._left = 0.0
        return True

    def _begin(self, trajectory: JointTrajectory) -> None:
        """Start the reference where the arm is."""
        self._position, self._orientation = map(
            np.copy, self._kinematics.forward(trajectory.position)
        )
        linear, angular = self._linear, self._angular
        if self._frame == "tool":
            linear = rotate(self._orientation, linear)
            angular = rotate(self._orientation, angular)
        self._twist = np.concatenate([linear, angular])
        self._pace = self._pace_rate = 0.0
        self._crawl_left = self._creeps_for
        self._thrown_off = False

    def _wanted(self) -> Vector:
        """The full twist in the base frame, shape (6,): m/s and rad/s."""
        assert self._twist is not None
        if self._frame == "base" or not self._angular.any():
            return self._twist
        # In the tool's frame, a turning tool takes its own directions with it.
        return np.concatenate(
            [
                rotate(self._orientation, self._linear),
                rotate(self._orientation, self._angular),
            ]
        )

    def _drift(self, trajectory: JointTrajectory) -> Vector:
        """Feedback on how far the arm has left the reference, shape (6,)."""
        tool = self._kinematics.forward(trajectory.position)
        return _DRIFT_GAIN * np.concatenate(
            [
                self._position - tool.position,
                difference(self._orientation, tool.orientation),
            ]
        )

    def _solve(self, jacobian: np.ndarray, twist: Vector) -> tuple[Vector, float]:
        """Joint velocities for ``twist``, and the smallest singular value."""
        u, values, vt = np.linalg.svd(jacobian, full_matrices=False)
        least = float(values[-1])
        damping = 0.0
        if least < _DAMPED_BELOW:
            damping = (1 - (least / _DAMPED_BELOW) ** 2) * _DAMPING**2
        return vt.T @ ((values / (values**2 + damping)) * (u.T @ twist)), least

    def _allowed(
        self, trajectory: JointTrajectory, now: Vector, ramp: _Ramp
    ) -> tuple[float, tuple[str, ...]]:
        """The part of the speed that limits and singularities leave, and what takes the rest."""
        wanted = self._wanted()
        size = float(np.linalg.norm(wanted))
        if size == 0.0:
            return 0.0, ()
        pace = max(self._pace, _SLOWEST)
        ahead = trajectory.position + now * (pace * _LOOK_AHEAD_S)
        there = self._kinematics.jacobian(ahead)
        then, least = self._solve(there, wanted)
        lost = float(np.linalg.norm(there @ then - wanted)) / size
        if lost > _BLOCKED:
            return 0.0, ("the arm cannot move that way from here: too near a singular position",)
        part, reasons = 1.0, []
        if least < self._settings.slow_below:
            part = max(_SLOWEST, least / self._settings.slow_below)
            reasons.append("slowed near a singular position")
        fastest = np.maximum(np.abs(now), np.abs(then)) + 1e-12
        by_speed = float((self._limits.ordinary.velocity / fastest).min()) * 0.95
        if by_speed < part:
            part = by_speed
            reasons.append("slowed by a joint's speed limit")
        by_room = self._room(trajectory, now, ramp)
        if by_room < part:
            part = by_room
            reasons.append(
                "slowed before a joint's limit" if part > 0 else "a joint is at its limit"
            )
        return part, tuple(reasons)

    def _room(self, trajectory: JointTrajectory, velocity: Vector, ramp: _Ramp) -> float:
        """The pace from which the tool can still brake along its line before a joint's limit.

        With ``r`` the time to the nearest limit at full pace: the pace ``s`` of which
        ``s^2 / 2a + s a / 2j = r``, with half the acceleration that braking has.
        """
        limits = self._limits
        room = np.where(
            velocity > 0,
            limits.upper - trajectory.position,
            trajectory.position - limits.lower,
        )
        room = np.maximum(room - _KEEP_OFF, 0.0)
        moving = np.abs(velocity) > 1e-6
        if not moving.any():
            return 1.0
        time = float((room[moving] / np.abs(velocity[moving])).min())
        a = ramp.acceleration / 2
        lag = a * a / (2 * ramp.jerk)
        return min(1.0, math.sqrt(lag * lag + 2 * a * time) - lag)

    def _ramp(self, velocity: Vector) -> _Ramp:
        """How fast the pace may change, given the joint velocities at full pace."""
        settings, ordinary = self._settings, self._limits.ordinary
        wanted = self._wanted()
        joints = np.abs(velocity) + 1e-9
        acceleration = min(
            _part(settings.linear_acceleration, float(np.linalg.norm(wanted[:3]))),
            _part(settings.angular_acceleration, float(np.linalg.norm(wanted[3:]))),
            _MARGIN * float((ordinary.acceleration / joints).min()),
        )
        jerk = min(
            acceleration / settings.ramp_jerk_s, _MARGIN * float((ordinary.jerk / joints).min())
        )
        return _Ramp(acceleration, jerk)

    def _advance(self, target: float, ramp: _Ramp, dt: float) -> None:
        """Move the pace towards ``target``."""
        given = self._input
        given.current_position = [0.0]
        given.current_velocity = [self._pace]
        given.current_acceleration = [self._pace_rate]
        given.target_velocity = [target]
        given.max_acceleration = [ramp.acceleration]
        given.max_jerk = [ramp.jerk]
        result = self._ruckig.calculate(given, self._profile)
        if result not in (Result.Working, Result.Finished):
            raise ArithmeticError(f"ruckig found no profile: {result}")
        _, speed, rate = self._profile.at_time(dt)
        self._pace, self._pace_rate = max(0.0, speed[0]), rate[0]


def _part(bound: float, of: float) -> float:
    """What part of ``of`` lies within ``bound``; large when ``of`` is nothing."""
    return bound / of if of > 1e-9 else 1e6
