"""An arm in PyBullet that behaves as a real one would, seen from the control loop."""

import numpy as np
import pybullet

from app.link.messages import ObjectState
from app.robot.arm import Contact, Reading, Vector
from app.robot.models import load_profile, model_assets
from app.robot.sim.brake_check import GRAVITY, MARGIN, weakest_brake
from app.robot.sim.brakes import Brakes
from app.robot.sim.kinematics import SerialKinematics
from app.robot.sim.proximity import FLOOR, SimulatedProximity
from app.robot.sim.world import (
    STEPS_PER_SECOND,
    add_floor,
    add_object,
    connect,
    load_robot,
    object_state,
    reset_objects,
)

_POSITION_GAIN = 0.3
"""Part of a position error that the motors take back in one step."""
_SOLVER_ITERATIONS = 120
"""With Bullet's usual 50 the chain of brakes, coupled fingers and held thing does not converge, and
things slip; 120 leave no slip that can be measured. Most steps end early, by the residual."""
_TOUCH = 0.5
"""N; what presses on a finger with less is not held."""
_LOST_STEPS = 24
"""0.1 s; a held thing that was not touched by both fingers for so long is held no more."""


class SimulatedArm:
    """A profile's robot, its table and its objects, in a Bullet world of its own.

    Joints are driven as by a servo: Bullet finds, in each step, the torque that brings a joint to
    the wanted speed, ``v + gain * (q_wanted - v dt - q) / dt``, up to the motor's torque. Gravity
    is held so without a model of it. Time passes only in :meth:`step`.

    Implements :class:`app.robot.arm.Arm`.

    Args:
        model: A profile: the name of one that comes with Farhand, or a file.
        robot: The robot's id on the link, for its description.
        objects: Whether table and objects are there.

    Raises:
        CannotStart: there is no such model, its meshes are missing, its brakes cannot hold it, or
            PyBullet lacks numpy.
    """

    def __init__(
        self, model: str = "puma560", robot: str = "puma", *, objects: bool = True
    ) -> None:
        assets = model_assets(model)
        self.model = assets.model
        self.description = assets.describe(robot)
        self.home: Vector = self.model.pose(self.model.home)
        self.kinematics = SerialKinematics(
            assets.urdf_path, self.model.base_link, self.model.tool_link
        )
        self.client = connect()
        self._open = True
        pybullet.setGravity(0, 0, -GRAVITY, physicsClientId=self.client)
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
        gripper = self.model.gripper
        self._fingers = [joints[name] for name in gripper.fingers] if gripper else []
        self._measured = self._joints + self._fingers
        self._torques = [joint.torque for joint in self.model.joints]
        self._brakes = Brakes(
            self.client, self.body, self._joints, [joint.brake for joint in self.model.joints]
        )
        self._gains = [_POSITION_GAIN] * len(self._joints)
        self._speed_gains = [1.0] * len(self._joints)
        self._check_brakes(model)
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
        if gripper:
            self.grip(gripper.width)

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
        if self._brakes.engaged:
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

    def grip(self, width: float, force: float | None = None) -> None:
        """Open or close the fingers towards ``width`` (m) at the gripper's own speed.

        They press with ``force`` (N, each finger), the gripper's own unless given. A width outside
        0 to the gripper's own, and a force above its own, are taken for the nearest it can do.
        Without a gripper this does nothing.
        """
        gripper = self.model.gripper
        if gripper is None:
            return
        half = min(max(width, 0.0), gripper.width) / 2
        press = gripper.force if force is None else min(force, gripper.force)
        for finger in self._fingers:
            pybullet.setJointMotorControl2(
                self.body,
                finger,
                pybullet.POSITION_CONTROL,
                targetPosition=half,
                force=press,
                maxVelocity=gripper.speed,
                positionGain=0.2,
                physicsClientId=self.client,
            )

    def brake(self, engaged: bool) -> None:
        """Engaged: motors off and brakes on, nothing drops. Released: the motors hold.

        The brakes bring a moving joint to rest with their torque, then hold it exactly where it
        stands, against as much as that torque. The gripper has no brake: its fingers keep their
        force, as a spring-closed one does.
        """
        if engaged == self._brakes.engaged:
            return
        if engaged:
            self._brakes.engage()
        else:
            self._brakes.release()
            self.move(self._angles(), np.zeros(len(self._joints)))

    def reset_scene(self) -> None:
        """Put every thing that can move back where it was at first, at rest."""
        reset_objects(self.client, self.model.objects, dict(self._moving))

    def step(self) -> None:
        """Let 1/240 s pass."""
        pybullet.stepSimulation(physicsClientId=self.client)
        self._brakes.after_step()

    def close(self) -> None:
        """Give the Bullet world back. Closing twice does no harm."""
        if self._open:
            self._open = False
            self.proximity.close()
            pybullet.disconnect(self.client)

    def _angles(self) -> Vector:
        states = pybullet.getJointStates(self.body, self._joints, physicsClientId=self.client)
        return np.array([state[0] for state in states])

    def _check_brakes(self, profile: str) -> None:
        """Refuse an arm that drops when its brakes come on.

        Raises:
            CannotStart: with the numbers, and the line of the profile.
        """
        weak = weakest_brake(self.client, self.body, self._joints, self.model, self.kinematics)
        if weak is None:
            return
        joint = self.model.joints[weak.joint]
        unit = "N" if self.description.joints[weak.joint].unit == "m" else "Nm"
        load = f" and {weak.load:.2g} kg in its gripper" if weak.load else ""
        self.close()
        raise load_profile(profile).wrong(
            f"{joint.name}: its brake of {joint.brake:g} {unit} does not hold the arm{load}: that "
            f"takes up to {weak.needed:.3g} {unit}, and {MARGIN:g} times as much to be sure, "
            f"{weak.needed * MARGIN:.3g} {unit}",
            "joints",
            weak.joint,
            "brake",
        )

    def _place(self, joints: Vector) -> None:
        """Put the joints somewhere at once, the fingers open."""
        for index, angle in zip(self._joints, joints, strict=True):
            pybullet.resetJointState(self.body, index, angle, physicsClientId=self.client)
        gripper = self.model.gripper
        for finger in self._fingers:
            assert gripper is not None
            pybullet.resetJointState(
                self.body, finger, gripper.width / 2, physicsClientId=self.client
            )

    def _couple_fingers(self) -> None:
        """One drive moves both fingers: what is held stays in the middle."""
        gripper = self.model.gripper
        if gripper is None:
            return
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
            maxForce=2 * gripper.force,
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
        for name, body in self._moving if self._fingers else ():
            if all(forces.get((finger, body), 0.0) > _TOUCH for finger in self._fingers):
                self._held, self._lost = name, 0
                return
        self._lost += 1
        if self._lost >= _LOST_STEPS:
            self._held = None

    def _object(self, name: str, body: int) -> ObjectState:
        return object_state(self.client, name, body)
