"""Turning one joint by an exact angle."""

import numpy as np

from app.link.actions import TurnJoint
from app.link.messages import JointDescription
from app.robot.arm import Reading
from app.robot.motion.at_work import AtWork
from app.robot.motion.go_to import GoTo
from app.robot.motion.trajectory import JointTrajectory


class JointTurn:
    """Ends exactly at the angle, counted from where the joint is when the turn begins.

    An angle past the joint's limit is clipped to the limit, and said.
    """

    def __init__(self, action: TurnJoint, joints: tuple[JointDescription, ...]) -> None:
        self._action = action
        self._joint = joints[action.joint - 1]
        self._going: GoTo | None = None
        self.limits: tuple[str, ...] = ()

    def step(self, trajectory: JointTrajectory, reading: Reading) -> bool:
        """One step nearer."""
        if self._going is None:
            self._going = self._begin(trajectory)
        return self._going.step(trajectory, reading)

    def release(self) -> bool:
        """The caller brakes."""
        return False

    def _begin(self, trajectory: JointTrajectory) -> GoTo:
        index = self._action.joint - 1
        target = np.clip(trajectory.position, trajectory.limits.lower, trajectory.limits.upper)
        asked = trajectory.position[index] + self._action.angle
        target[index] = np.clip(asked, self._joint.lower, self._joint.upper)
        short = abs(asked - target[index])
        if short > 1e-9:
            side = "upper" if asked > target[index] else "lower"
            unit = self._joint.unit
            text = f"{self._joint.name} ends at its {side} limit, {short:.3f} {unit} short"
            self.limits = (AtWork(text, "joint_limit"),)
        return GoTo(target)
