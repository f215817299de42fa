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
from app.robot.motion.go_to import GoClear, GoTo
from app.robot.motion.grip import Grip
from app.robot.motion.guard import Guard
from app.robot.motion.joint_jog import JointJog
from app.robot.motion.limits import Limits
from app.robot.motion.planner import Planner, Search
from app.robot.motion.task import Refused, Task
from app.robot.motion.trajectory import JointTrajectory
from app.robot.motion.turn_joint import JointTurn

_FINGERS_STILL = 0.002
"""m/s"""
_PLANNED_EXTRA = 0.005
"""m; planned ways keep so much farther off than the stop distances, so that nothing stops them."""


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
        self.guard = Guard(
            arm.proximity,
            arm.kinematics,
            arm.description.workspace,
            settings.clearance,
            len(self._joints),
        )
        self.action: Action | None = None
        """What is being done, until the arm is at rest again."""
        self.wants_stop = False
        """A sequence has come to a stop: the caller is to stop the robot."""
        self._task: Task | None = None
        self._refused: tuple[str, ...] = ()
        """Why the last task did not go on, while its gesture is held."""
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
        if self._task is None:
            return self._refused
        return self._task.limits + self.guard.limits

    def refusal(self, action: Action | Step) -> str | None:
        """Why this arm cannot do ``action``, in plain words; None when it can."""
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
        self._refused = ()
        self._braking_hard = False
        self.action = action

    def release(self) -> None:
        """The gesture was let go: come to rest at the ordinary pace."""
        self._refused = ()
        if self._task is not None and not self._task.release():
            self._task = None
        self._keep_fingers()

    def halt(self) -> None:
        """A stop: come to rest at once, within 200 ms."""
        self._task = None
        self._refused = ()
        if not self._braking_hard:
            self._braking_hard = True
            self._keep_fingers()

    def reset(self, joints: Vector) -> None:
        """Be at rest where the arm really is, at ``joints`` (rad, shape (n,))."""
        self._task = self.action = None
        self._refused = ()
        self.wants_stop = False
        self._braking_hard = False
        self.trajectory.reset(joints)

    def step(self, reading: Reading) -> None:
        """Move the trajectory on by one step."""
        if self._width is not None:
            self._finger_speed = (reading.gripper - self._width) / self.trajectory.dt
        self._width = reading.gripper
        trajectory = self.trajectory
        self.guard.watch(reading, trajectory.position, standing=trajectory.at_rest)
        if self._task is not None:
            self._go_on(self._task, reading)
        else:
            self.trajectory.brake(hard=self._braking_hard)
        if self._task is None and self.trajectory.at_rest:
            self.action = None
            self._braking_hard = False

    def _go_on(self, task: Task, reading: Reading) -> None:
        """One step of the task, if nothing is in its way."""
        trajectory, guard = self.trajectory, self.guard
        before = trajectory.now
        trajectory.slowed = guard.scale
        try:
            if task.step(trajectory, reading):
                self._task = None
            moved = trajectory.position is not before.position
            if guard.active and moved and not guard.allows(trajectory):
                trajectory.become(before)
                trajectory.brake()
                raise Refused(*guard.limits)
        except Refused as refused:
            self._task = None
            self._refused = (str(refused),)

    def _keep_fingers(self) -> None:
        """Fingers on their way stop where they are; fingers that hold something go on holding."""
        gripping = isinstance(self.action, Gripper | Sequence)
        if gripping and self._width is not None and abs(self._finger_speed) > _FINGERS_STILL:
            self._arm.grip(self._width)

    def _task_of(self, action: Action | Step) -> Task:
        match action:
            case JogJoint():
                return JointJog(action, self._joints, self._settings.speed)
            case JogCartesian():
                return CartesianJog(
                    action, self._arm.kinematics, self.trajectory.limits, self._settings
                )
            case TurnJoint():
                return JointTurn(action, self._joints)
            case Pose():
                return self._go_clear(self._arm.description.poses[action.name], action.name)
            case Home():
                return self._go_clear(self._arm.home, "home")
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

    def _go_clear(self, target: tuple[float, ...] | Vector, name: str) -> Task:
        joints = np.array(target, dtype=float)
        if not self.guard.active:
            return GoTo(joints)
        return GoClear(joints, f"the pose {name}", self._search, self._settings.planning_s)

    def _search(self, start: Vector, goal: Vector) -> Search:
        guard, limits = self.guard, self.trajectory.limits

        def room(joints: Vector) -> float:
            return guard.room(guard.margins(joints), _PLANNED_EXTRA)

        return Planner(limits.lower, limits.upper, guard.reach, room).search(start, goal)

    def _ask_for_stop(self) -> None:
        self.wants_stop = True

    def _maker(self, step: Step) -> Callable[[], Task]:
        return lambda: self._task_of(step)
