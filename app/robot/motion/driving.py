"""What a base can do: drive (joint 1, m) and turn (joint 2, rad).

Its frames ``base`` and ``tool`` are one, its own: x ahead, z up, and they go where it goes.
"""

import numpy as np

from app.link.actions import (
    Action,
    Home,
    JogCartesian,
    MoveLinear,
    Pose,
    Step,
)
from app.link.messages import JointDescription
from app.robot.arm import Reading, Vector
from app.robot.motion.at_work import AtWork
from app.robot.motion.go_to import GoTo
from app.robot.motion.trajectory import JointTrajectory

_CAN = "this robot drives and turns; it cannot"


def cannot_drive(action: Action | Step) -> str | None:
    """Why a base cannot do ``action``, in plain words; None when it can, or when any robot could.

    Named poses and home are refused: nothing says that the way there is clear.
    """
    match action:
        case JogCartesian():
            return _cannot_move(action.linear, action.angular)
        case MoveLinear():
            if action.offset[0] and action.rotation[2]:
                return f"{_CAN} do both at once over an exact way: make two steps of it"
            return _cannot_move(action.offset, action.rotation)
        case Pose() | Home():
            return f"{_CAN} find a clear way to a place by itself: drive it there"
    return None


def _cannot_move(
    linear: tuple[float, float, float], angular: tuple[float, float, float]
) -> str | None:
    if linear[1]:
        return f"{_CAN} move sideways"
    if linear[2]:
        return f"{_CAN} move up or down"
    if angular[0] or angular[1]:
        return f"{_CAN} tilt"
    return None


class DriveJog:
    """Drives, turns or both at a constant speed, until broken off or for the action's duration.

    Args:
        action: What to do; :func:`cannot_drive` has nothing against it.
        joints: The two of the base.
        speed: Part of a joint's speed that is allowed.
    """

    def __init__(
        self, action: JogCartesian, joints: tuple[JointDescription, ...], speed: float
    ) -> None:
        wanted = np.array([action.linear[0], action.angular[2]])
        most = np.array([joint.velocity for joint in joints]) * speed
        part = min(1.0, float((most / np.maximum(np.abs(wanted), 1e-9)).min()))
        self._wanted = wanted * part  # both alike, so that the curve stays the one asked for
        self._left = action.duration
        self.limits: tuple[str, ...] = (
            (AtWork(f"the robot moves at {100 * part:.0f}% of the speed asked for", "speed"),)
            if part < 1
            else ()
        )

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """Speed up, run, and brake when the duration is over."""
        if self._left is not None and self._left <= 0:
            trajectory.brake()
            return trajectory.at_rest
        if self._left is not None:
            self._left -= trajectory.dt
        trajectory.follow_velocity(self._wanted)
        return False

    def release(self) -> bool:
        """The caller brakes."""
        return False


class DriveWay:
    """Drives or turns by exactly what a straight move says, counted from where it begins."""

    def __init__(self, action: MoveLinear) -> None:
        self._way: Vector = np.array([action.offset[0], action.rotation[2]])
        self._going: GoTo | None = None
        self.limits: tuple[str, ...] = ()

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """One step nearer."""
        if self._going is None:
            limits = trajectory.limits
            self._going = GoTo(np.clip(trajectory.position + self._way, limits.lower, limits.upper))
        return self._going.step(trajectory, reading)

    def release(self) -> bool:
        """The caller brakes."""
        return False
