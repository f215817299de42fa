"""Doing an action with a robot that does not exist, faster than time passes.

The same :class:`~app.robot.motion.motion.Motion` that moves the real arm moves the other one, so
that what it says of limits is what the real arm would do; only the steps are longer. Things that
can be carried stay where they are, and the fingers meet nothing.
"""

import re
import time
from collections.abc import Callable, Iterable

import numpy as np

from app.config import ArmMotionSettings
from app.link.actions import Action, JogCartesian, JogJoint, Sequence, Wait
from app.link.messages import DryRunPath, DryRunProblem, DryRunReport
from app.robot.arm import Arm, Met, Vector
from app.robot.motion.at_work import AtWork, with_kind
from app.robot.motion.motion import Motion
from app.robot.motion.repeat import Place

STEP_S = 1 / 60
"""Four times a control cycle: jerk-limited motion comes out the same, in a quarter of the work."""
JOG_S = 2.0
"""How long a jog without a duration is tried."""
STANDING_S = 6.0
"""A step in which the arm stands for this long, and which is no wait, never ends: fingers give up
after 5 s."""
LONGEST_S = 1800.0
"""Of a program."""
MOST_WALL_S = 12.0
"""Of the check."""
MOST_POINTS = 200
"""Of the path."""
MOST_PROBLEMS = 50
LOOK_OUT = 4
"""Steps between two looks for what a robot that drives touches."""


class Rehearsal:
    """One dry run.

    Args:
        arm: Stands where the action is to begin, and moves as told.
        settings: How fast the real one moves.
        go_on: Asked now and then; False breaks the dry run off.
        meets: What the robot touches where it is now, for one that drives.
        dt: s; what passes in one step of ``arm``.

    Raises:
        CannotStart: the arm's limits make no sense.
    """

    def __init__(
        self,
        arm: Arm,
        settings: ArmMotionSettings,
        go_on: Callable[[], bool] = lambda: True,
        meets: Callable[[], Iterable[Met]] = lambda: (),
        dt: float = STEP_S,
    ) -> None:
        self._arm = arm
        self._dt = dt
        self._motion = Motion(arm, settings, dt)
        self._go_on = go_on
        self._meets = meets
        self._met_before = {met.thing for met in meets()}
        self._blocked = False
        self._problems: dict[tuple[int | None, str, str], DryRunProblem] = {}
        first = arm.read()
        self._track: list[Vector] = [first.joints]
        self._bases: list[tuple[float, float, float]] = []
        if first.base is not None:
            self._bases.append(first.base)
        self._standing = 0.0
        self._place: Place | None = None

    def run(self, action: Action) -> DryRunReport:
        """Do ``action``, and say what became of it."""
        if self._refused(action):
            return self._report()
        self._motion.begin(action)
        self._place = self._motion.place
        endless = isinstance(action, JogJoint | JogCartesian) and action.duration is None
        began = time.monotonic()
        while self._motion.busy:
            if endless and self._time >= JOG_S:
                self._motion.release()
                endless = False
            self._step()
            if self._motion.wants_stop or self._blocked:
                break
            if self._standing > STANDING_S:
                text = "the arm stands and the step does not end"
                self._note(AtWork(text, "never_ends"))
                break
            if time.monotonic() - began > MOST_WALL_S or self._time > LONGEST_S:
                text = f"the check was broken off after {self._time:.0f} s of the program"
                self._note(AtWork(text, "too_long"))
                break
            if not self._go_on():
                break
        return self._report()

    @property
    def _time(self) -> float:
        """How long it has gone on, s."""
        return (len(self._track) - 1) * self._dt

    def _step(self) -> None:
        arm, motion = self._arm, self._motion
        before = self._place
        motion.step(arm.read())
        arm.move(motion.trajectory.position, motion.trajectory.velocity)
        arm.step()
        self._track.append(motion.trajectory.position.copy())
        if (base := arm.read().base) is not None:
            self._bases.append(base)
            if len(self._bases) % LOOK_OUT == 0:
                self._look_out()
        for text in map(with_kind, motion.limits):
            if text.kind != "note":
                self._note(text)
        if motion.gave_up is not None:
            self._note(motion.gave_up)
        self._place = motion.place or before
        action = motion.action if self._place is None else self._place.action
        may_stand = isinstance(action, Wait | JogJoint | JogCartesian)
        same = self._place == before
        stands = same and motion.doing and motion.trajectory.at_rest and not may_stand
        self._standing = self._standing + self._dt if stands else 0.0

    def _look_out(self) -> None:
        """Note what a robot that drives runs into; what does not move is the end of the way."""
        for met in self._meets():
            if met.thing in self._met_before:
                continue  # it stood there already, and may leave
            self._met_before.add(met.thing)
            name = met.thing.replace("_", " ")
            if met.fixed:
                self._note(AtWork(f"the robot would drive against the {name}", "collision"))
                self._blocked = True
            else:
                self._note(AtWork(f"the robot would push the {name}", "collision"))

    def _refused(self, action: Action) -> bool:
        """Whether the robot would not even begin; each wrong step is noted."""
        steps = action.steps if isinstance(action, Sequence) else (action,)
        for number, step in enumerate(steps, start=1):
            if (reason := self._motion.refusal(step)) is not None:
                self._add(number if isinstance(action, Sequence) else None, reason)
        return bool(self._problems)

    def _note(self, text: AtWork) -> None:
        place = self._place
        self._add(None if place is None else place.step, text)

    def _add(self, step: int | None, text: AtWork) -> None:
        # The numbers of a limit, such as a distance, change from one moment to the next.
        key = (step, text.kind, re.sub(r"\d+", "", text.plain))
        if key not in self._problems and len(self._problems) < MOST_PROBLEMS:
            self._problems[key] = DryRunProblem(
                step=step, time_s=round(self._time, 3), kind=text.kind, message=text.plain
            )

    def _report(self) -> DryRunReport:
        count = min(MOST_POINTS, len(self._track))
        chosen = np.unique(np.linspace(0, len(self._track) - 1, count).round().astype(int))
        tools = [self._arm.kinematics.forward(self._track[index]).position for index in chosen]
        problems = tuple(self._problems.values())
        return DryRunReport(
            ok=all(problem.kind == "slowed" for problem in problems),
            duration_s=round(self._time, 3),
            problems=problems,
            path=DryRunPath(
                times=tuple(round(int(index) * self._dt, 3) for index in chosen),
                joints=tuple(tuple(self._track[index].round(5).tolist()) for index in chosen),
                tool=tuple(_point(tool) for tool in tools),
                base=tuple(_point(self._bases[index]) for index in chosen) if self._bases else (),
            ),
        )


def _point(values: Vector | tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = np.asarray(values).round(5).tolist()
    return x, y, z
