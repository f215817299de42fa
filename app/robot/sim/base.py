"""A mobile base in PyBullet: wheels that really turn, slip and hold.

It has two joints, and so everything above it (trajectory, limits, stops, lease) is the arm's own:

    joint 1, drive (m):   s, the way gone forward;   ds = cos(psi) dx + sin(psi) dy
    joint 2, turn (rad):  theta, the turn made;      dtheta = dpsi, counted on past pi

with x, y and the heading psi of the base, measured from physics in each step. Going sideways counts
in neither. Wheels that do not steer are driven by sides (Siegwart et al., "Introduction to
Autonomous Mobile Robots", 2nd ed., section 3.2)::

    left = (v - w b / 2) / r      right = (v + w b / 2) / r

with the wheels' radius r and the track b as it acts in a turn. What slip takes away, feedback of
the measured way and turn gives back, as for a servo: a turn ends where it should, not where the
wheels believe.
"""

import math

import numpy as np
import pybullet

from app.errors import CannotStart
from app.link.messages import ObjectState
from app.robot.arm import Reading, ToolPose, Vector
from app.robot.models import MobileBaseModel, ModelAssets, ObjectModel
from app.robot.sim.brakes import Brakes
from app.robot.sim.kinematics import Matrix, fixed_pose
from app.robot.sim.world import (
    STEPS_PER_SECOND,
    add_floor,
    add_object,
    connect,
    load_robot,
    object_state,
    reset_objects,
)

_GAIN = 40.0
"""1/s; speed asked for per m (or rad) that the base is behind. A turn is then at most 5 mrad
behind, and stands 0.17 s after a stop; with 12 it is 13 mrad and 0.3 s."""
_SETTLE_STEPS = 60
_SOLVER_ITERATIONS = 100


class BaseKinematics:
    """Where the tool of a base is: always at the same place in its own frame."""

    def __init__(self, tool: ToolPose) -> None:
        self._tool = tool

    def forward(self, joints: Vector) -> ToolPose:
        """The tool in the base's own frame, wherever the base is."""
        return self._tool

    def jacobian(self, joints: Vector) -> Matrix:
        """Shape (6, 2): driving moves it along x, turning turns it about z."""
        x, y, _ = self._tool.position
        result = np.zeros((6, 2))
        result[0, 0] = 1.0
        result[:, 1] = (-y, x, 0.0, 0.0, 0.0, 1.0)
        return result


class SimulatedBase:
    """A profile's base and the things in its room, in a Bullet world of its own.

    Implements :class:`app.robot.arm.Arm`. It has no gripper.

    Args:
        assets: A profile with ``base``.
        robot: The robot's id on the link, for its description.
        objects: Whether the things are there.

    Raises:
        CannotStart: PyBullet lacks numpy or cannot load the URDF, or the profile has no base.
    """

    def __init__(self, assets: ModelAssets, robot: str = "husky", *, objects: bool = True) -> None:
        if assets.model.base is None:
            raise CannotStart(f"{assets.model.name} does not drive", model=assets.name)
        self.model = assets.model
        self.proximity = None
        self.base: MobileBaseModel = assets.model.base
        self.description = assets.describe(robot)
        self.home: Vector = self.model.pose(self.model.home)
        self.kinematics = BaseKinematics(
            fixed_pose(assets.urdf_path, self.model.base_link, self.model.tool_link)
        )
        self.client = connect()
        self._open = True
        pybullet.setGravity(0, 0, -9.81, physicsClientId=self.client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=1 / STEPS_PER_SECOND,
            numSolverIterations=_SOLVER_ITERATIONS,
            deterministicOverlappingPairs=1,
            # Friction along and across a wheel, each by itself. With a cone the spinning wheels of
            # a turn lose all hold at once and catch again, and the base jerks round.
            enableConeFriction=0,
            physicsClientId=self.client,
        )
        self.objects: dict[str, int] = {}
        self._moving: list[tuple[str, int]] = []
        add_floor(self.client)
        for thing in self.model.objects if objects else ():
            body = add_object(self.client, thing)
            self.objects[thing.name] = body
            if thing.mass > 0:
                self._moving.append((thing.name, body))
        self.body, joints, self._links = load_robot(self.client, assets.urdf_path, fixed=False)
        self._wheels = [joints[name] for name in (*self.base.left, *self.base.right)]
        count = len(self.base.left), len(self.base.right)
        self._sides = np.array([-1.0] * count[0] + [1.0] * count[1])
        self._torque = self.model.joints[0].torque
        brake = self.model.joints[0].brake
        self._brakes = Brakes(
            self.client, self.body, self._wheels, [brake] * len(self._wheels), wheels=True
        )
        # Bullet gives a body's pose at its centre of mass; ours is the first link's frame.
        dynamics = pybullet.getDynamicsInfo(self.body, -1, physicsClientId=self.client)
        self._from_mass = pybullet.invertTransform(dynamics[3], dynamics[4])
        self._driven = self._turned = 0.0
        self._place(objects)
        self._pose = self._measure()
        self.move(np.zeros(2), np.zeros(2))

    def read(self) -> Reading:
        """Measure: way and turn, their speeds, the pose in the room, and the things that move."""
        return Reading(
            joints=np.array([self._driven, self._turned]),
            velocities=self._speeds(),
            gripper=0.0,
            tool=self.kinematics.forward(self.home),
            objects=tuple(self._object(name, body) for name, body in self._moving),
            base=self._pose,
        )

    def move(self, joints: Vector, velocities: Vector) -> None:
        """Set where the base should be (m gone, rad turned) and how fast it should pass there.

        For the end of the coming step. Has no effect while the brakes are on: the motors are off.
        """
        if self._brakes.engaged:
            return
        behind = joints - velocities / STEPS_PER_SECOND - (self._driven, self._turned)
        drive, turn = velocities + _GAIN * behind
        speeds = (drive + self._sides * turn * self.base.track / 2) / self.base.radius
        pybullet.setJointMotorControlArray(
            self.body,
            self._wheels,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=speeds,
            forces=[self._torque] * len(self._wheels),
            physicsClientId=self.client,
        )

    def grip(self, width: float, force: float | None = None) -> None:
        """There is no gripper: does nothing."""

    def reset_scene(self) -> None:
        """Put every thing that can move back where it was at first, at rest."""
        reset_objects(self.client, self.model.objects, dict(self._moving))

    def brake(self, engaged: bool) -> None:
        """Engaged: motors off, wheels braked to rest and then held. Released: motors hold."""
        if engaged == self._brakes.engaged:
            return
        if engaged:
            self._brakes.engage()
        else:
            self._brakes.release()
            self.move(np.array([self._driven, self._turned]), np.zeros(2))

    def step(self) -> None:
        """Let 1/240 s pass."""
        pybullet.stepSimulation(physicsClientId=self.client)
        self._brakes.after_step()
        before, self._pose = self._pose, self._measure()
        turned = math.remainder(self._pose[2] - before[2], 2 * math.pi)
        heading = before[2] + turned / 2
        dx, dy = self._pose[0] - before[0], self._pose[1] - before[1]
        self._driven += math.cos(heading) * dx + math.sin(heading) * dy
        self._turned += turned

    def close(self) -> None:
        """Give the Bullet world back. Closing twice does no harm."""
        if self._open:
            self._open = False
            pybullet.disconnect(self.client)

    def _measure(self) -> tuple[float, float, float]:
        """Where the base is: m, m, rad about Z, in the room."""
        position, turn = pybullet.getBasePositionAndOrientation(
            self.body, physicsClientId=self.client
        )
        (x, y, _), (i, j, k, w) = pybullet.multiplyTransforms(position, turn, *self._from_mass)
        heading = math.atan2(2 * (w * k + i * j), 1 - 2 * (j * j + k * k))
        return float(x), float(y), heading

    def _speeds(self) -> Vector:
        """m/s forward and rad/s about Z."""
        linear, angular = pybullet.getBaseVelocity(self.body, physicsClientId=self.client)
        heading = self._pose[2]
        forward = math.cos(heading) * linear[0] + math.sin(heading) * linear[1]
        return np.array([forward, angular[2]])

    def _place(self, objects: bool) -> None:
        """Put the base on the floor at the middle of the room, and let it come to rest there."""
        floors: list[ObjectModel] = [t for t in self.model.objects if t.grid] if objects else []
        top = max([0.0, *(thing.position[2] + thing.size[2] / 2 for thing in floors)])
        position, turn = pybullet.invertTransform(*self._from_mass)
        lifted = (position[0], position[1], position[2] + top)
        pybullet.resetBasePositionAndOrientation(
            self.body, lifted, turn, physicsClientId=self.client
        )
        self._pose = self._measure()
        self.move(np.zeros(2), np.zeros(2))
        for _ in range(_SETTLE_STEPS):
            pybullet.stepSimulation(physicsClientId=self.client)

    def _object(self, name: str, body: int) -> ObjectState:
        return object_state(self.client, name, body)
