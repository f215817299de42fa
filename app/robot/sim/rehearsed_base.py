"""A simulated base that can be put anywhere and says what it touches, for dry runs.

With physics, other than an arm in a dry run: how wheels slip in a turn no formula here would tell,
and what is pushed is pushed.
"""

import math
from collections.abc import Sequence

import numpy as np
import pybullet

from app.link.messages import ObjectState
from app.robot.arm import Met, Vector
from app.robot.models import ModelAssets
from app.robot.sim.base import SimulatedBase

_TOUCH_M = 0.005
"""What is nearer than this is met."""


class RehearsedBase(SimulatedBase):
    """A base in a world of its own, beside the one that drives.

    Args:
        assets: A profile with ``base``.
        robot: The robot's id on the link, for its description.

    Raises:
        CannotStart: as :class:`SimulatedBase`.
    """

    def __init__(self, assets: ModelAssets, robot: str = "husky") -> None:
        super().__init__(assets, robot)
        # How high it stands at rest.
        place, turn = pybullet.getBasePositionAndOrientation(self.body, physicsClientId=self.client)
        (_, _, self._height), _ = pybullet.multiplyTransforms(place, turn, *self._from_mass)
        self._fixed = {thing.name: thing.mass == 0 for thing in self.model.objects}
        self._floors = {thing.name for thing in self.model.objects if thing.grid}

    def place(
        self,
        joints: Vector,
        base: tuple[float, float, float],
        objects: Sequence[ObjectState],
    ) -> None:
        """Stand somewhere, at rest.

        Args:
            joints: What has been driven (m) and turned (rad) so far, shape (2,).
            base: Where to stand: m, m, rad about Z, in the room.
            objects: Where the things that can move are; others are where they were at first.
        """
        self.brake(False)
        self.reset_scene()
        for thing in objects:
            if (body := self.objects.get(thing.name)) is not None:
                w, i, j, k = thing.orientation
                pybullet.resetBasePositionAndOrientation(
                    body, thing.position, (i, j, k, w), physicsClientId=self.client
                )
        x, y, heading = base
        upright = (0.0, 0.0, math.sin(heading / 2), math.cos(heading / 2))
        place, turn = pybullet.multiplyTransforms(
            (x, y, self._height), upright, *pybullet.invertTransform(*self._from_mass)
        )
        pybullet.resetBasePositionAndOrientation(
            self.body, place, turn, physicsClientId=self.client
        )
        still = (0.0, 0.0, 0.0)
        pybullet.resetBaseVelocity(self.body, still, still, physicsClientId=self.client)
        for wheel in self._wheels:
            pybullet.resetJointState(self.body, wheel, 0.0, 0.0, physicsClientId=self.client)
        self._driven, self._turned = joints.tolist()
        self._pose = self._measure()
        self.move(joints, np.zeros(2))

    def meets(self) -> list[Met]:
        """The things, the floor aside, that the base touches where it is now."""
        return [
            Met(name, self._fixed[name])
            for name, body in self.objects.items()
            if name not in self._floors
            and pybullet.getClosestPoints(self.body, body, _TOUCH_M, physicsClientId=self.client)
        ]
