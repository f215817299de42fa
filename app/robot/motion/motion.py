"""One action at a time, from rest to rest."""

from collections.abc import Callable

import numpy as np

from app.config import ArmMotionSettings
from app.link.actions import (
    Action,
    Gripper,
    Home,
    JogCartesian,
    JogJoint,
    MoveLinear,
    Pose,
    Repeat,
    Sequence,
    Step,
    Stop,
    TurnJoint,
    Wait,
)
from app.robot.arm import Arm, Reading, Vector
from app.robot.motion import sequence
from app.robot.motion.ask_for_stop import AskForStop
from app.robot.motion.cartesian_jog import CartesianJog
from app.robot.motion.driving import DriveJog, DriveWay, cannot_drive
from app.robot.motion.go_to import GoTo
from app.robot.motion.grip import Grip
from app.robot.motion.joint_jog import JointJog
from app.robot.motion.limits import Limits
from app.robot.motion.task import Task
from app.robot.motion.trajectory import JointTrajectory
from app.robot.motion.turn_joint import JointTurn

_FINGERS_STILL = 0.002
"""m/s"""


class Motion:
    """Does actions with an arm. Safe to call in any order: whatever is asked, nothing jumps.

    Args:
        arm: Whose description, kinematics and gripper are used; joints are moved by the caller.
        settings: How fast.
        dt: s; one step.

    Raises:
        CannotStart: the arm's limits make no sense.
    """

    def __init__(self, arm: Arm, settings: ArmMotionSettings, dt: float) -> None:
        self._arm = arm
        self._joints = arm.description.joints
        self._settings = settings
        limits = Limits.of(self._joints, settings)
        self.trajectory = JointTrajectory(limits, arm.read().joints, dt)
        self.action: Action | None = None
        """What is being done, until the arm is at rest again."""
        self.wants_stop = False
        """A sequence has come to a stop: the caller is to stop the robot."""
        self._task: Task | None = None
        self._braking_hard = False
        self._width: float | None = None
        self._finger_speed = 0.0

    @property
    def busy(self) -> bool:
        """An action is being done, or the arm has not come to rest after one."""
        return self.action is not None or not self.trajectory.at_rest

    @property
    def doing(self) -> bool:
        """An action is under way and has neither ended nor been let go."""
        return self._task is not None

    @property
    def limits(self) -> tuple[str, ...]:
        """Limits at work, in plain words."""
        return self._task.limits if self._task is not None else ()

    def refusal(self, action: Action | Step) -> str | None:
        """Why this arm cannot do ``action``, in plain words; None when it can."""
        description = self._arm.description
        if description.drives and (reason := cannot_drive(action)) is not None:
            return reason
        if isinstance(action, Gripper) and description.gripper_max == 0:
            return "this robot has no gripper"
        if description.drives and isinstance(action, MoveLinear):
            return None
        if isinstance(action, MoveLinear | Wait | Repeat):
            return f"this arm cannot do {action.type} yet"
        if isinstance(action, Sequence):
            for number, step in enumerate(action.steps, start=1):
                if (reason := self.refusal(step)) is not None:
                    return f"step {number}: {reason}"
            return None
        poses = self._arm.description.poses
        if isinstance(action, Pose) and action.name not in poses:
            return f"this robot has no pose {action.name!r}; it has: {', '.join(sorted(poses))}"
        if isinstance(action, JogJoint | TurnJoint) and action.joint > len(self._joints):
            return f"this robot has no joint {action.joint}; it has {len(self._joints)}"
        return None

    def begin(self, action: Action) -> None:
        """Begin ``action``.

        Raises:
            ValueError: the arm is still busy, or cannot do it (see :meth:`refusal`).
        """
        if self.busy:
            raise ValueError("an action begins with the arm at rest")
        if (reason := self.refusal(action)) is not None:
            raise ValueError(reason)
        self._task = self._task_of(action)
        self._braking_hard = False
        self.action = action

    def release(self) -> None:
        """The gesture was let go: come to rest at the ordinary pace."""
        if self._task is not None and not self._task.release():
            self._task = None
        self._keep_fingers()

    def halt(self) -> None:
        """A stop: come to rest at once, within 200 ms."""
        self._task = None
        if not self._braking_hard:
            self._braking_hard = True
            self._keep_fingers()

    def reset(self, joints: Vector) -> None:
        """Be at rest where the arm really is, at ``joints`` (rad, shape (n,))."""
        self._task = self.action = None
        self.wants_stop = False
        self._braking_hard = False
        self.trajectory.reset(joints)

    def step(self, reading: Reading) -> None:
        """Move the trajectory on by one step."""
        if self._width is not None:
            self._finger_speed = (reading.gripper - self._width) / self.trajectory.dt
        self._width = reading.gripper
        if self._task is not None:
            if self._task.step(self.trajectory, reading):
                self._task = None
        else:
            self.trajectory.brake(hard=self._braking_hard)
        if self._task is None and self.trajectory.at_rest:
            self.action = None
            self._braking_hard = False

    def _keep_fingers(self) -> None:
        """Fingers on their way stop where they are; fingers that hold something go on holding."""
        gripping = isinstance(self.action, Gripper | Sequence)
        if gripping and self._width is not None and abs(self._finger_speed) > _FINGERS_STILL:
            self._arm.grip(self._width)

    def _task_of(self, action: Action | Step) -> Task:
        match action:
            case JogCartesian() if self._arm.description.drives:
                return DriveJog(action, self._joints, self._settings.speed)
            case MoveLinear() if self._arm.description.drives:
                return DriveWay(action)
            case JogJoint():
                return JointJog(action, self._joints, self._settings.speed)
            case JogCartesian():
                return CartesianJog(
                    action, self._arm.kinematics, self.trajectory.limits, self._settings
                )
            case TurnJoint():
                return JointTurn(action, self._joints)
            case Pose():
                return GoTo(np.array(self._arm.description.poses[action.name]))
            case Home():
                return GoTo(self._arm.home.copy())
            case Gripper():
                widest = self._arm.description.gripper_max
                width = min(action.width, widest)
                clipped = (f"the gripper opens to {widest:.3f} m",) if width < action.width else ()
                return Grip(width, self._arm.grip, clipped)
            case Sequence():
                return sequence.Sequence([self._maker(step) for step in action.steps])
            case Stop():
                return AskForStop(self._ask_for_stop)
            case MoveLinear() | Wait() | Repeat():
                raise ValueError(f"this arm cannot do {action.type} yet")

    def _ask_for_stop(self) -> None:
        self.wants_stop = True

    def _maker(self, step: Step) -> Callable[[], Task]:
        return lambda: self._task_of(step)
