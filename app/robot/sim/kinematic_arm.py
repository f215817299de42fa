"""A simulated arm without physics: it goes exactly where it is told, and nothing else moves."""

from collections.abc import Sequence

import numpy as np
import pybullet

from app.link.messages import ObjectState
from app.robot.arm import Reading, Vector
from app.robot.sim.arm import SimulatedArm


class KinematicArm(SimulatedArm):
    """An arm whose motors never fail it, for asking what a motion would do.

    The fingers go at the gripper's own speed and meet nothing. Things stay where they are put.

    Args:
        model: Name or file of the profile.
        robot: The robot's id on the link, for its description.
        dt: s; what passes in one step.

    Raises:
        CannotStart: as :class:`SimulatedArm`.
    """

    def __init__(self, model: str = "puma560", robot: str = "puma", *, dt: float) -> None:
        self._dt = dt
        self._at: Vector = np.zeros(0)
        self._speed: Vector = np.zeros(0)
        self._width = self._wanted_width = 0.0
        self._still: tuple[ObjectState, ...] = ()
        super().__init__(model, robot)
        self.place(self.home, self.description.gripper_max, ())

    def place(self, joints: Vector, gripper: float, objects: Sequence[ObjectState]) -> None:
        """Stand at ``joints`` (rad, shape (n,)), the fingers ``gripper`` (m) apart.

        Args:
            joints: Where to stand.
            gripper: Between the fingers.
            objects: Where the things that can move are; others stay where they were at first.
        """
        self._brakes.release()
        self._at, self._speed = joints.copy(), np.zeros_like(joints)
        self._width = self._wanted_width = gripper
        for thing in objects:
            if (body := self.objects.get(thing.name)) is not None:
                w, x, y, z = thing.orientation
                pybullet.resetBasePositionAndOrientation(
                    body, thing.position, (x, y, z, w), physicsClientId=self.client
                )
        self._still = super().read().objects
        self._pose()

    def read(self) -> Reading:
        """What a perfect arm would measure."""
        return Reading(
            joints=self._at.copy(),
            velocities=self._speed.copy(),
            gripper=self._width,
            tool=self.kinematics.forward(self._at),
            objects=self._still,
        )

    def move(self, joints: Vector, velocities: Vector) -> None:
        """Be there at once: rad and rad/s, shape (n,). Has no effect while the brakes are on."""
        if self._brakes.engaged:
            return
        self._at, self._speed = joints.copy(), velocities.copy()

    def grip(self, width: float, force: float | None = None) -> None:
        """Open or close the fingers towards ``width`` (m); there is nothing to press."""
        self._wanted_width = min(max(width, 0.0), self.description.gripper_max)

    def brake(self, engaged: bool) -> None:
        """Engaged: stands where it is, at once. There is nothing that could slip."""
        if engaged:
            self._brakes.engage()
            self._speed = np.zeros_like(self._at)
        else:
            self._brakes.release()

    def step(self) -> None:
        """Let one step pass."""
        gripper = self.model.gripper
        most = 2 * gripper.speed * self._dt if gripper else 0.0
        self._width += float(np.clip(self._wanted_width - self._width, -most, most))
        self._pose()

    def _pose(self) -> None:
        """Show the same in the world, for whoever measures distances there."""
        for index, angle in zip(self._joints, self._at, strict=True):
            pybullet.resetJointState(self.body, index, angle, physicsClientId=self.client)
        for finger in self._fingers:
            pybullet.resetJointState(
                self.body, finger, self._width / 2, physicsClientId=self.client
            )
