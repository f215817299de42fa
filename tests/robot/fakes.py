"""An arm that goes exactly where it is told, with the real geometry of the PUMA 560."""

import numpy as np

from app.link.messages import ObjectState
from app.robot.arm import Contact, Proximity, Reading, Vector
from app.robot.models import model_assets
from app.robot.sim.kinematics import SerialKinematics

DT = 1 / 240


class FakeArm:
    """Implements :class:`app.robot.arm.Arm` without physics, and notes what it is told."""

    def __init__(self, joints: Vector | None = None, *, bounded: bool = True) -> None:
        assets = model_assets("puma560")
        model = assets.model
        self.description = model.describe("puma")
        if not bounded:
            self.description = self.description.model_copy(update={"workspace": None})
        self.home: Vector = model.pose(model.home)
        self.proximity: Proximity | None = None
        self.kinematics = SerialKinematics(assets.urdf_path, model.base_link, model.tool_link)
        self.joints = (self.home if joints is None else joints).copy()
        self.velocities = np.zeros(6)
        self.width = model.gripper.width
        self.wanted_width = self.width
        self.objects: tuple[ObjectState, ...] = ()
        self.held: str | None = None
        self.contacts: tuple[Contact, ...] = ()
        self.blocked_at: float | None = None
        """m; a thing between the fingers."""
        self.stuck = False
        """The arm does not follow."""
        self.braked = False
        self.closed = False
        self.scene_resets = 0
        self.moves: list[tuple[Vector, Vector]] = []

    def read(self) -> Reading:
        tool = self.kinematics.forward(self.joints)
        if self.held is not None:  # it goes where the hand goes
            self.objects = tuple(
                ObjectState(
                    name=thing.name,
                    position=tuple(tool.position),
                    orientation=tuple(tool.orientation),
                )
                if thing.name == self.held
                else thing
                for thing in self.objects
            )
        return Reading(
            joints=self.joints.copy(),
            velocities=self.velocities.copy(),
            gripper=self.width,
            tool=tool,
            objects=self.objects,
            contacts=self.contacts,
            held=self.held,
        )

    def move(self, joints: Vector, velocities: Vector) -> None:
        self.moves.append((joints.copy(), velocities.copy()))
        if not self.braked and not self.stuck:
            self.joints, self.velocities = joints.copy(), velocities.copy()

    def grip(self, width: float) -> None:
        self.wanted_width = width

    def brake(self, engaged: bool) -> None:
        self.braked = engaged
        if engaged:
            self.velocities = np.zeros(6)

    def reset_scene(self) -> None:
        self.scene_resets += 1

    def step(self) -> None:
        least = 0.0 if self.blocked_at is None else self.blocked_at
        step = np.clip(max(self.wanted_width, least) - self.width, -0.16 * DT, 0.16 * DT)
        self.width += float(step)

    def close(self) -> None:
        self.closed = True
