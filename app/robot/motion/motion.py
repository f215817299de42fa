"""One action at a time, from rest to rest."""

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
from app.robot.motion.at_work import AtWork
from app.robot.motion.cartesian_jog import CartesianJog
from app.robot.motion.driving import DriveJog, DriveWay, cannot_drive
from app.robot.motion.go_to import GoClear, GoTo
from app.robot.motion.grip import Grip
from app.robot.motion.guard import Guard
from app.robot.motion.joint_jog import JointJog
from app.robot.motion.limits import Limits
from app.robot.motion.move_linear import LinearMove
from app.robot.motion.planner import Planner, Search
from app.robot.motion.repeat import Place, counted_out
from app.robot.motion.task import Refused, Task
from app.robot.motion.trajectory import JointTrajectory
from app.robot.motion.turn_joint import JointTurn
from app.robot.motion.wait import Pause

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
        self.gave_up: AtWork | None = None
        """Why the newest action ended although it was not done."""
        self._task: Task | None = None
        self._limits: tuple[str, ...] = ()
        self._braking_hard = False

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
        """Limits at work, or why the newest action went no further, in plain words."""
        return self._limits

    @property
    def place(self) -> Place | None:
        """The step of a sequence that is being done."""
        return self._task.place if isinstance(self._task, sequence.Sequence) else None

    def refusal(self, action: Action | Step) -> AtWork | None:
        """Why this arm cannot do ``action``, in plain words; None when it can."""
        description = self._arm.description
        if description.drives and (cannot := cannot_drive(action)) is not None:
            return AtWork(cannot, "unreachable")
        if isinstance(action, Gripper) and description.gripper_max == 0:
            return AtWork("this robot has no gripper", "gripper")
        if isinstance(action, Sequence | Repeat):
            for number, step in enumerate(action.steps, start=1):
                if (reason := self.refusal(step)) is not None:
                    return reason.at(f"step {number}")
            return None
        poses = self._arm.description.poses
        if isinstance(action, Pose) and action.name not in poses:
            text = f"this robot has no pose {action.name!r}; it has: {', '.join(sorted(poses))}"
            return AtWork(text, "unknown_pose")
        if isinstance(action, JogJoint | TurnJoint) and action.joint > len(self._joints):
            text = f"this robot has no joint {action.joint}; it has {len(self._joints)}"
            return AtWork(text, "unknown_joint")
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
        self.gave_up = None
        self._braking_hard = False
        self.action = action

    def release(self) -> None:
        """The gesture was let go: come to rest at the ordinary pace."""
        self._limits = ()
        if self._task is not None and not self._task.release():
            self._task = None

    def halt(self) -> None:
        """A stop: come to rest at once, within 200 ms."""
        if self._task is not None:
            self._task.release()  # what it moves besides the joints
        self._task = None
        self._limits = ()
        self._braking_hard = True

    def reset(self, joints: Vector) -> None:
        """Be at rest where the arm really is, at ``joints`` (rad, shape (n,))."""
        self._task = self.action = None
        self._limits = ()
        self.wants_stop = False
        self._braking_hard = False
        self.trajectory.reset(joints)

    def step(self, reading: Reading) -> None:
        """Move the trajectory on by one step."""
        trajectory = self.trajectory
        self.guard.watch(reading, trajectory.position, standing=trajectory.at_rest)
        if self._task is not None:
            self._go_on(self._task, reading)
        else:
            self.trajectory.brake(hard=self._braking_hard)
            if self.gave_up is None:
                self._limits = ()
        if self._task is None and self.trajectory.at_rest:
            self.action = None
            self._braking_hard = False

    def _go_on(self, task: Task, reading: Reading) -> None:
        """One step of the task, if nothing is in its way."""
        trajectory, guard = self.trajectory, self.guard
        before = trajectory.now
        trajectory.slowed = guard.scale
        try:
            ended = task.step(trajectory, reading)
            moved = trajectory.position is not before.position
            if guard.active and moved and not guard.allows(trajectory):
                trajectory.become(before)
                trajectory.brake()
                raise Refused(guard.limits[0])
            self._limits = task.limits + guard.limits
            if ended:
                self._task = None
        except Refused as refused:
            self._task = None
            self.gave_up = refused.why
            self._limits = (refused.why,)

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
            case MoveLinear():
                return LinearMove(
                    action, self._arm.kinematics, self.trajectory.limits, self._settings
                )
            case TurnJoint():
                return JointTurn(action, self._joints)
            case Pose():
                return self._go_clear(self._arm.description.poses[action.name], action.name)
            case Home():
                return self._go_clear(self._arm.home, "home")
            case Gripper():
                return self._grip_of(action)
            case Wait():
                return Pause(action)
            case Sequence():
                return sequence.Sequence(tuple(counted_out(action)), self._task_of)
            case Stop():
                return AskForStop(self._ask_for_stop)
            case Repeat():
                raise ValueError("a repeat is done only in a sequence")

    def _grip_of(self, action: Gripper) -> Grip:
        widest = self._arm.description.gripper_max
        strongest = self._arm.description.gripper_force
        width, force = min(action.width, widest), action.force
        clipped: list[str] = []
        if width < action.width:
            clipped.append(AtWork(f"the gripper opens to {widest:.3f} m", "gripper"))
        if force is not None and strongest is not None and force > strongest:
            clipped.append(AtWork(f"the gripper presses with {strongest:g} N at most", "gripper"))
            force = strongest
        return Grip(width, force, self._arm.grip, tuple(clipped))

    def _go_clear(self, target: tuple[float, ...] | Vector, name: str) -> Task:
        joints = np.array(target, dtype=float)
        if not self.guard.active:
            return GoTo(joints)
        blocked = self.guard.nearest_at
        return GoClear(joints, f"the pose {name}", self._search, blocked, self._settings.planning_s)

    def _search(self, start: Vector, goal: Vector) -> Search:
        guard, limits = self.guard, self.trajectory.limits

        def room(joints: Vector) -> float:
            return guard.room(guard.margins(joints), _PLANNED_EXTRA)

        return Planner(limits.lower, limits.upper, guard.reach, room).search(start, goal)

    def _ask_for_stop(self) -> None:
        self.wants_stop = True
