"""An arm in PyBullet that behaves as a real one would, seen from the control loop."""

import numpy as np
import pybullet

from app.link.messages import ObjectState
from app.robot.arm import Contact, Reading, Vector
from app.robot.models import model_assets
from app.robot.sim.kinematics import SerialKinematics
from app.robot.sim.proximity import FLOOR, SimulatedProximity
from app.robot.sim.world import (
    STEPS_PER_SECOND,
    add_floor,
    add_object,
    connect,
    load_robot,
    upright,
)

_POSITION_GAIN = 0.3
"""Part of a position error that the motors take back in one step."""
_SOLVER_ITERATIONS = 120
"""With Bullet's usual 50 the chain of brakes, coupled fingers and held thing does not converge, and
things slip; 120 leave no slip that can be measured. Most steps end early, by the residual."""
_BRAKED_SPEED = 0.005
"""rad/s; slower than this, a braking joint counts as standing and is locked where it is."""
_TOUCH = 0.5
"""N; what presses on a finger with less is not held."""
_LOST_STEPS = 24
"""0.1 s; a held thing that was not touched by both fingers for so long is held no more."""


class SimulatedArm:
    """A robot of ``app/robot/models``, its table and its objects, in a Bullet world of its own.

    Joints are driven as by a servo: Bullet finds, in each step, the torque that brings a joint to
    the wanted speed, ``v + gain * (q_wanted - v dt - q) / dt``, up to the motor's torque. Gravity
    is held so without a model of it. Time passes only in :meth:`step`.

    Implements :class:`app.robot.arm.Arm`.

    Args:
        model: Folder under ``app/robot/models``.
        robot: The robot's id on the link, for its description.
        objects: Whether table and objects are there.

    Raises:
        CannotStart: there is no such model, its meshes are missing, or PyBullet lacks numpy.
    """

    def __init__(
        self, model: str = "puma560", robot: str = "puma", *, objects: bool = True
    ) -> None:
        assets = model_assets(model)
        self.model = assets.model
        self.description = self.model.describe(robot)
        self.home: Vector = self.model.pose(self.model.home)
        self.kinematics = SerialKinematics(
            assets.urdf_path, self.model.base_link, self.model.tool_link
        )
        self.client = connect()
        self._open = True
        pybullet.setGravity(0, 0, -9.81, physicsClientId=self.client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=1 / STEPS_PER_SECOND,
            numSolverIterations=_SOLVER_ITERATIONS,
            deterministicOverlappingPairs=1,
            physicsClientId=self.client,
        )
        self.body, joints, self._links = load_robot(self.client, assets.urdf_path)
        self._link_names = {index: name for name, index in self._links.items()}
        self.proximity = SimulatedProximity(assets, objects=objects)
        self._joints = [joints[joint.name] for joint in self.model.joints]
        self._fingers = [joints[name] for name in self.model.gripper.fingers]
        self._measured = self._joints + self._fingers
        self._torques = [joint.torque for joint in self.model.joints]
        self._brakes = [joint.brake for joint in self.model.joints]
        self._gains = [_POSITION_GAIN] * len(self._joints)
        self._speed_gains = [1.0] * len(self._joints)
        self._braked = False
        self._locked = False
        self._place(self.home)
        self._couple_fingers()
        self.objects: dict[str, int] = {}
        self._moving: list[tuple[str, int]] = []
        self._thing_names: dict[int, str] = {}
        self._held: str | None = None
        self._lost = 0
        if objects:
            self._thing_names[add_floor(self.client)] = FLOOR
            for thing in self.model.objects:
                body = add_object(self.client, thing)
                self.objects[thing.name] = body
                self._thing_names[body] = thing.name
                if thing.mass > 0:
                    self._moving.append((thing.name, body))
        self.move(self.home, np.zeros(len(self._joints)))
        self.grip(self.model.gripper.width)

    def read(self) -> Reading:
        """Measure: joints, speeds, fingers, and where the objects that can move are.

        The tool's pose is that of the measured joints.
        """
        states = pybullet.getJointStates(self.body, self._measured, physicsClientId=self.client)
        count = len(self._joints)
        joints = np.array([state[0] for state in states[:count]])
        contacts = self._contacts()
        return Reading(
            joints=joints,
            velocities=np.array([state[1] for state in states[:count]]),
            gripper=max(0.0, sum(state[0] for state in states[count:])),
            tool=self.kinematics.forward(joints),
            objects=tuple(self._object(name, body) for name, body in self._moving),
            contacts=contacts,
            held=self._held,
        )

    def move(self, joints: Vector, velocities: Vector) -> None:
        """Set where the joints should be (rad) and how fast they should pass there (rad/s).

        For the end of the coming step. Has no effect while the brakes are on: the motors are off.
        """
        if self._braked:
            return
        pybullet.setJointMotorControlArray(
            self.body,
            self._joints,
            pybullet.POSITION_CONTROL,
            # Bullet adds the whole error from now on to the wanted speed; the way that this speed
            # covers in the step is no error.
            targetPositions=joints - velocities / STEPS_PER_SECOND,
            targetVelocities=velocities,
            forces=self._torques,
            positionGains=self._gains,
            velocityGains=self._speed_gains,
            physicsClientId=self.client,
        )

    def grip(self, width: float) -> None:
        """Open or close the fingers towards ``width`` (m) at the gripper's own speed and force.

        A width outside 0 to the gripper's own is taken for the nearest that it can do.
        """
        gripper = self.model.gripper
        half = min(max(width, 0.0), gripper.width) / 2
        for finger in self._fingers:
            pybullet.setJointMotorControl2(
                self.body,
                finger,
                pybullet.POSITION_CONTROL,
                targetPosition=half,
                force=gripper.force,
                maxVelocity=gripper.speed,
                positionGain=0.2,
                physicsClientId=self.client,
            )

    def brake(self, engaged: bool) -> None:
        """Engaged: motors off and brakes on, nothing drops. Released: the motors hold.

        The brakes first bring a moving joint to rest with their torque, then lock it where it
        stands. The gripper has no brake: its fingers keep their force, as a spring-closed one does.
        """
        if engaged == self._braked:
            return
        if engaged:
            self._braked, self._locked = True, False
            self._rub()
        else:
            self._braked = False
            self.move(self._angles()[0], np.zeros(len(self._joints)))

    def reset_scene(self) -> None:
        """Put every thing that can move back where it was at first, at rest."""
        places = {thing.name: thing for thing in self.model.objects}
        for name, body in self._moving:
            pybullet.resetBasePositionAndOrientation(
                body,
                places[name].position,
                upright(places[name].turn),
                physicsClientId=self.client,
            )
            pybullet.resetBaseVelocity(
                body, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), physicsClientId=self.client
            )

    def step(self) -> None:
        """Let 1/240 s pass."""
        pybullet.stepSimulation(physicsClientId=self.client)
        if self._braked and not self._locked:
            joints, velocities = self._angles()
            if np.abs(velocities).max() < _BRAKED_SPEED:
                self._lock(joints)

    def close(self) -> None:
        """Give the Bullet world back. Closing twice does no harm."""
        if self._open:
            self._open = False
            self.proximity.close()
            pybullet.disconnect(self.client)

    def _angles(self) -> tuple[Vector, Vector]:
        states = pybullet.getJointStates(self.body, self._joints, physicsClientId=self.client)
        return np.array([state[0] for state in states]), np.array([state[1] for state in states])

    def _rub(self) -> None:
        """Brake a motion: no speed is wanted, with at most the brakes' torque."""
        pybullet.setJointMotorControlArray(
            self.body,
            self._joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=[0.0] * len(self._joints),
            forces=self._brakes,
            physicsClientId=self.client,
        )

    def _lock(self, joints: Vector) -> None:
        """Hold still at exactly these angles, from which speed control alone creeps away."""
        pybullet.setJointMotorControlArray(
            self.body,
            self._joints,
            pybullet.POSITION_CONTROL,
            targetPositions=joints,
            targetVelocities=[0.0] * len(self._joints),
            forces=self._brakes,
            positionGains=self._gains,
            velocityGains=self._speed_gains,
            physicsClientId=self.client,
        )
        self._locked = True

    def _place(self, joints: Vector) -> None:
        """Put the joints somewhere at once, the fingers open."""
        for index, angle in zip(self._joints, joints, strict=True):
            pybullet.resetJointState(self.body, index, angle, physicsClientId=self.client)
        for finger in self._fingers:
            pybullet.resetJointState(
                self.body, finger, self.model.gripper.width / 2, physicsClientId=self.client
            )

    def _couple_fingers(self) -> None:
        """One drive moves both fingers: what is held stays in the middle."""
        left, right = self._fingers
        gear = pybullet.createConstraint(
            self.body,
            left,
            self.body,
            right,
            pybullet.JOINT_GEAR,
            [0, 1, 0],
            [0, 0, 0],
            [0, 0, 0],
            physicsClientId=self.client,
        )
        pybullet.changeConstraint(
            gear,
            gearRatio=-1,
            erp=0.2,
            maxForce=2 * self.model.gripper.force,
            physicsClientId=self.client,
        )

    def _contacts(self) -> tuple[Contact, ...]:
        """What the arm presses on, as felt in the last step."""
        forces: dict[tuple[int, int], float] = {}
        for point in pybullet.getContactPoints(self.body, physicsClientId=self.client):
            # The arm is body A of its contacts with others, A and B of those with itself.
            if point[2] != self.body and point[9] > 0:
                pair = point[3], point[2]
                forces[pair] = forces.get(pair, 0.0) + point[9]
        movable = {body for _, body in self._moving}
        self._find_held(forces)
        return tuple(
            Contact(
                self._link_names[link],
                self._thing_names.get(body, "unknown_thing"),
                force,
                link in self._fingers and body in movable,
            )
            for (link, body), force in forces.items()
        )

    def _find_held(self, forces: dict[tuple[int, int], float]) -> None:
        """A thing that presses on both fingers is held, until it was lost for a while."""
        for name, body in self._moving:
            if all(forces.get((finger, body), 0.0) > _TOUCH for finger in self._fingers):
                self._held, self._lost = name, 0
                return
        self._lost += 1
        if self._lost >= _LOST_STEPS:
            self._held = None

    def _object(self, name: str, body: int) -> ObjectState:
        position, (x, y, z, w) = pybullet.getBasePositionAndOrientation(
            body, physicsClientId=self.client
        )
        # Values from Bullet need no checking; this runs 240 times a second.
        return ObjectState.model_construct(name=name, position=position, orientation=(w, x, y, z))
