"""Moving the tool by an exact way in a straight line, turning it evenly as it goes.

The machinery is that of :class:`~app.robot.motion.cartesian_jog.CartesianJog`: the reference runs
along a constant twist at a pace from 0 to 1. Here the way that the pace has covered, in seconds at
full pace, has an end, and the pace is ruckig's profile to it. Before anything moves, the line is
gone along by inverse kinematics (Newton's method, a little in each cycle): what cannot be reached
is refused before it begins, and how fast the pace may change is bounded once for the whole line,
so that the brake begins in time. At the end the last micrometres are a motion of the joints, which
ends exactly.
"""

import math
from typing import NamedTuple

import numpy as np
from ruckig import ControlInterface, InputParameter, Result, Ruckig, Trajectory

from app.config import ArmMotionSettings
from app.link.actions import JogCartesian, MoveLinear
from app.robot.arm import Kinematics, Reading, Vector
from app.robot.motion.at_work import AtWork, with_kind
from app.robot.motion.cartesian_jog import (
    BLOCKED,
    KEEP_OFF,
    TOO_NEAR_SINGULAR,
    CartesianJog,
    Ramp,
)
from app.robot.motion.limits import Limits
from app.robot.motion.line import JointLine
from app.robot.motion.rotation import difference, rotate, turn
from app.robot.motion.task import Refused
from app.robot.motion.trajectory import JointTrajectory

_OWN_SPEED = 0.5
"""Part of the fastest straight motion that is taken where the action names no speed."""
_LOOK_STEP_M = 0.02
_LOOK_STEP_RAD = 0.06
_LOOKS_A_CYCLE = 3
"""Points of the line gone along in one cycle: well below a millisecond."""
_NEWTON_STEPS = 6
_CLOSE = 1e-9
"""m and rad; Newton's method has converged."""
_STUCK_S = 0.4
"""A line on which nothing has gone on for this long has ended."""
_RESTARTS = 3
_RAMP_MARGIN = 0.9
"""For what the joints' path does between two points that were looked at."""


class _Goal(NamedTuple):
    position: Vector
    orientation: Vector


class LinearMove(CartesianJog):
    """Ends exactly at the end of the line, or is refused with the reason.

    Args:
        action: What to do.
        kinematics: Of the arm.
        limits: Of the arm.
        settings: Speeds of straight motion.
    """

    def __init__(
        self,
        action: MoveLinear,
        kinematics: Kinematics,
        limits: Limits,
        settings: ArmMotionSettings,
    ) -> None:
        offset, rotation = np.array(action.offset), np.array(action.rotation)
        wanted = action.speed or _OWN_SPEED * settings.linear_speed
        speed = min(wanted, settings.linear_speed)
        self._length = max(
            float(np.linalg.norm(offset)) / speed,
            float(np.linalg.norm(rotation)) / (_OWN_SPEED * settings.angular_speed),
        )
        """s at full pace."""
        each = max(self._length, 1e-9)
        super().__init__(
            JogCartesian(
                frame=action.frame,
                linear=tuple((offset / each).tolist()),
                angular=tuple((rotation / each).tolist()),
            ),
            kinematics,
            limits,
            settings,
        )
        if speed < wanted:
            text = f"the tool moves at most at {speed:.2f} m/s"
            self._clipped = (AtWork(text, "speed"),)
        self._creeps_for = 0.0  # its way is given: no need to be brief
        self._size = float(np.linalg.norm(offset))
        count = max(self._size / _LOOK_STEP_M, float(np.linalg.norm(rotation)) / _LOOK_STEP_RAD)
        self._looks = max(4, math.ceil(count))
        self._looked = 0
        self._seen: Vector | None = None
        """Joints at the newest point that was looked at."""
        self._bound = Ramp(math.inf, math.inf)
        self._start: _Goal | None = None
        self._end: Vector | None = None
        """Joints at the end of the line, once the reference is there."""
        self._way = 0.0
        self._released = False
        self._begun = 0
        self._idle = 0.0
        self._to_end = Ruckig(1, 1.0)
        self._end_profile = Trajectory(1)
        self._end_input = InputParameter(1)
        self._end_input.control_interface = ControlInterface.Position
        self._finish: JointLine | None = None

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """One step along the line."""
        if self._end is not None:
            if self._finish is None:
                self._finish = JointLine(trajectory, self._end)
            return self._finish.step(trajectory)
        if self._looked < self._looks:
            trajectory.brake()
            if trajectory.at_rest and self._length > 0:
                self._look_ahead(trajectory)
            return self._length == 0
        before = self._way
        ended = super().step(trajectory, reading)
        if self._way >= self._length and not self._thrown_off:
            return self._arrive(trajectory)
        self._idle = 0.0 if self._way > before else self._idle + trajectory.dt
        lost = self._begun > _RESTARTS
        if not self._released and (self._idle > _STUCK_S or lost) and trajectory.at_rest:
            why = next(map(with_kind, self.limits), AtWork("the arm cannot follow", "other"))
            raise self._refused(self._way / self._length, why)
        return ended

    def release(self) -> bool:
        """Slow down along the line."""
        self._released = True
        return self._end is None and super().release()

    def _begin(self, trajectory: JointTrajectory) -> None:
        """Start the reference where the arm is; thrown off, on the way from there to the end."""
        super()._begin(trajectory)
        self._begun += 1
        assert self._start is not None and self._twist is not None
        goal = self._point(1.0)
        left = self._length - self._way
        if self._begun > 1:
            self._linear = (goal.position - self._position) / left
            self._angular = difference(goal.orientation, self._orientation) / left
        else:
            self._linear, self._angular = self._twist[:3], self._twist[3:]
        # The line and the axis of the turn stand still, whatever the tool's own axes do.
        self._frame = "base"
        self._twist = np.concatenate([self._linear, self._angular])

    def _point(self, part: float) -> _Goal:
        """Where the tool is after ``part`` of the line, 0 to 1."""
        assert self._start is not None
        linear, angular = self._line
        return _Goal(
            self._start.position + part * self._length * linear,
            turn(self._start.orientation, part * self._length * angular),
        )

    def _look_ahead(self, trajectory: JointTrajectory) -> None:
        """Go along a little of the line before the arm does."""
        if self._start is None:
            self._start = _Goal(*self._kinematics.forward(trajectory.position))
            self._line = self._linear, self._angular
            if self._frame == "tool":
                orientation = self._start.orientation
                self._line = (
                    rotate(orientation, self._linear),
                    rotate(orientation, self._angular),
                )
            self._seen = trajectory.position
        for _ in range(min(_LOOKS_A_CYCLE, self._looks - self._looked)):
            self._look()

    def _look(self) -> None:
        """Look at the next point of the line.

        Raises:
            Refused: the arm cannot go there.
        """
        assert self._seen is not None
        wanted = np.concatenate(self._line)
        jacobian = self._kinematics.jacobian(self._seen)
        velocity, _ = self._solve(jacobian, wanted)
        lost = float(np.linalg.norm(jacobian @ velocity - wanted))
        ramp = self._ramp_for(wanted, velocity)
        self._bound = Ramp(
            min(self._bound.acceleration, _RAMP_MARGIN * ramp.acceleration),
            min(self._bound.jerk, _RAMP_MARGIN * ramp.jerk),
        )
        reached = self._looked / self._looks
        if lost > BLOCKED * float(np.linalg.norm(wanted)):
            raise self._refused(reached, TOO_NEAR_SINGULAR)
        self._looked += 1
        joints = self._near(self._point(self._looked / self._looks), self._seen)
        if joints is None:
            raise self._refused(reached, AtWork("it is out of the arm's reach", "unreachable"))
        outside = (joints > self._limits.upper - KEEP_OFF) | (
            joints < self._limits.lower + KEEP_OFF
        )
        farther = np.abs(joints - self._middle) > np.abs(self._seen - self._middle)
        if (outside & farther).any():
            number = int(np.argmax(outside & farther)) + 1
            why = AtWork(f"joint {number} would pass its limit", "joint_limit")
            raise self._refused(reached, why)
        self._seen = joints

    @property
    def _middle(self) -> Vector:
        middle: Vector = (self._limits.lower + self._limits.upper) / 2
        return middle

    def _refused(self, part: float, why: AtWork) -> Refused:
        """The end, ``part`` of the line having been gone along or looked at."""
        text = (
            f"only {100 * self._size * part:.1f} cm of {100 * self._size:.1f} cm can be reached "
            "in a straight line"
            if self._size > 0
            else f"only {100 * part:.0f}% of the turn can be made"
        )
        return Refused(AtWork(f"{text}: {why}", why.kind))

    def _near(self, goal: _Goal, joints: Vector) -> Vector | None:
        """The joints that bring the tool to ``goal``, nearest to ``joints``; None without any."""
        for _ in range(_NEWTON_STEPS):
            tool = self._kinematics.forward(joints)
            away = np.concatenate(
                [goal.position - tool.position, difference(goal.orientation, tool.orientation)]
            )
            if np.abs(away).max() < _CLOSE:
                return joints
            joints = joints + self._solve(self._kinematics.jacobian(joints), away)[0]
        return None

    def _arrive(self, trajectory: JointTrajectory) -> bool:
        """The reference is at the end; the arm is within its last micrometres."""
        end = self._near(self._point(1.0), trajectory.position)
        if end is None or (end > self._limits.upper).any() or (end < self._limits.lower).any():
            why = AtWork("its very end is out of the arm's reach", "unreachable")
            raise self._refused(1.0, why)
        self._end = end
        return False

    def _ramp(self, velocity: Vector) -> Ramp:
        ramp = super()._ramp(velocity)
        return Ramp(
            min(ramp.acceleration, self._bound.acceleration), min(ramp.jerk, self._bound.jerk)
        )

    def _advance(self, target: float, ramp: Ramp, dt: float) -> None:
        """Move the way on, at a pace of at most ``target``, to its end at the latest."""
        if target <= 0.0:
            before = self._pace
            super()._advance(target, ramp, dt)
            self._way += (before + self._pace) / 2 * dt
            return
        given = self._end_input
        given.current_position = [self._way]
        given.current_velocity = [self._pace]
        given.current_acceleration = [self._pace_rate]
        given.target_position = [self._length]
        given.target_velocity = [0.0]
        given.max_velocity = [target]
        given.max_acceleration = [ramp.acceleration]
        given.max_jerk = [ramp.jerk]
        result = self._to_end.calculate(given, self._end_profile)
        if result not in (Result.Working, Result.Finished):
            raise ArithmeticError(f"ruckig found no profile: {result}")
        if self._end_profile.duration <= dt:
            self._way, self._pace, self._pace_rate = self._length, 0.0, 0.0
            return
        way, speed, rate = self._end_profile.at_time(dt)
        self._way, self._pace, self._pace_rate = way[0], speed[0], rate[0]
