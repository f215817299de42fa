"""Turning one joint at a constant speed."""

import numpy as np

from app.link.actions import JogJoint
from app.link.messages import JointDescription
from app.robot.arm import Reading
from app.robot.motion.at_work import AtWork
from app.robot.motion.trajectory import JointTrajectory, describe_limits


class JointJog:
    """Runs until it is broken off, or for the action's duration.

    Args:
        action: What to do.
        joints: The arm's joints.
        speed: Part of a joint's speed that is allowed.
    """

    def __init__(
        self, action: JogJoint, joints: tuple[JointDescription, ...], speed: float
    ) -> None:
        self._names = [joint.name for joint in joints]
        self._wanted = np.zeros(len(joints))
        index = action.joint - 1
        most = joints[index].velocity * speed
        self._wanted[index] = np.clip(action.velocity, -most, most)
        self._left = action.duration
        unit = joints[index].unit
        does = "turns" if unit == "rad" else "moves"
        self._clipped = (
            (AtWork(f"{joints[index].name} {does} at most at {most:.2f} {unit}/s", "speed"),)
            if abs(action.velocity) > most
            else ()
        )
        self.limits: tuple[str, ...] = ()

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """Speed up, run, brake before the limit or when the duration is over."""
        if self._left is not None and self._left <= 0:
            trajectory.brake()
            return trajectory.at_rest
        if self._left is not None:
            self._left -= trajectory.dt
        trajectory.follow_velocity(self._wanted)
        self.limits = self._clipped + describe_limits(trajectory.held_back, self._names)
        return False

    def release(self) -> bool:
        """The caller brakes."""
        return False
