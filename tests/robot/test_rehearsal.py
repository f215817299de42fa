from collections.abc import Iterator

import numpy as np
import pytest

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
    Stop,
    TurnJoint,
    Wait,
)
from app.link.messages import DryRunReport, ObjectState
from app.robot import rehearsal
from app.robot.motion.at_work import KINDS
from app.robot.rehearsal import MOST_POINTS, STEP_S, Rehearsal
from app.robot.sim.kinematic_arm import KinematicArm
from tests.robot.motion.rig import Rig

SETTINGS = ArmMotionSettings()


@pytest.fixture(scope="module")
def kinematic() -> Iterator[KinematicArm]:
    arm = KinematicArm(dt=STEP_S)
    yield arm
    arm.close()


@pytest.fixture
def among_things(kinematic: KinematicArm) -> KinematicArm:
    kinematic.place(kinematic.home, 0.08, ())
    return kinematic


@pytest.fixture
def arm(among_things: KinematicArm, monkeypatch: pytest.MonkeyPatch) -> KinematicArm:
    """Nothing is near it: only its own limits count."""
    monkeypatch.setattr(among_things, "proximity", None)
    free = among_things.description.model_copy(update={"workspace": None})
    monkeypatch.setattr(among_things, "description", free)
    return among_things


def run(arm: KinematicArm, action: Action) -> DryRunReport:
    report = Rehearsal(arm, SETTINGS).run(action)
    assert all(problem.kind in KINDS for problem in report.problems)
    assert len(report.path.times) == len(report.path.joints) == len(report.path.tool)
    return report


def kinds(report: DryRunReport) -> list[tuple[int | None, str]]:
    return [(problem.step, problem.kind) for problem in report.problems]


PROGRAM = Sequence(
    steps=(
        TurnJoint(joint=1, angle=0.3),
        MoveLinear(offset=(0.0, 0.05, -0.1)),
        Gripper(width=0.0),
        JogCartesian(linear=(0.0, 0.0, 0.1), duration=0.5),
        Repeat(times=2, steps=(TurnJoint(joint=6, angle=0.2), Wait(duration=0.5))),
    )
)


def test_it_ends_where_the_arm_would_and_takes_as_long(arm: KinematicArm) -> None:
    """The longer steps change nothing that counts."""
    report = run(arm, PROGRAM)
    rig = Rig()
    rig.motion.begin(PROGRAM)
    seconds = rig.finish(30)
    assert report.ok
    assert report.problems == ()
    assert report.duration_s == pytest.approx(seconds, abs=0.3)
    assert report.path.joints[-1] == pytest.approx(rig.arm.joints, abs=0.01)
    assert report.path.joints[0] == pytest.approx(rig.arm.home, abs=1e-4)
    assert report.path.times[-1] == pytest.approx(report.duration_s)
    end = rig.arm.read().tool.position
    assert report.path.tool[-1] == pytest.approx(end, abs=0.005)


def test_a_long_path_is_thinned_and_keeps_its_ends(arm: KinematicArm) -> None:
    report = run(arm, Sequence(steps=(Wait(duration=30.0), TurnJoint(joint=1, angle=0.5))))
    assert len(report.path.times) == MOST_POINTS
    assert report.path.times[0] == 0.0
    assert report.path.times[-1] == pytest.approx(report.duration_s)
    assert report.path.joints[-1][0] == pytest.approx(arm.home[0] + 0.5, abs=1e-4)
    assert len(report.encode()) < 40_000


@pytest.mark.parametrize(
    ("action", "expected"),
    [
        (JogCartesian(linear=(0.0, 0.1, 0.0)), set()),
        (JogCartesian(linear=(0.0, 0.0, 0.5)), {"slowed", "joint_limit"}),
        (JogCartesian(linear=(0.5, 0.0, 0.0)), {"slowed", "singularity"}),
        (JogCartesian(linear=(1.0, 0.0, 0.0)), {"speed", "slowed", "singularity"}),
        (JogJoint(joint=5, velocity=4.0), {"speed", "joint_limit"}),
        (TurnJoint(joint=5, angle=6.0), {"joint_limit"}),
        (MoveLinear(offset=(1.0, 0.0, 0.0)), {"unreachable"}),
        (MoveLinear(offset=(0.1, 0.0, 0.6)), {"joint_limit"}),
        (MoveLinear(offset=(0.0, 0.1, 0.0), speed=1.0), {"speed"}),
        (Gripper(width=0.2), {"gripper"}),
        (Gripper(width=0.0, force=100.0), {"gripper"}),
        (Pose(name="moon"), {"unknown_pose"}),
        (TurnJoint(joint=7, angle=0.1), {"unknown_joint"}),
        (Stop(), set()),
        (Home(), set()),
    ],
)
def test_each_limit_is_named_by_its_kind(
    arm: KinematicArm, action: Action, expected: set[str]
) -> None:
    report = run(arm, action)
    found = {problem.kind for problem in report.problems}
    assert found - {"slowed"} == expected - {"slowed"}
    assert report.ok == (not found - {"slowed"})


def test_what_only_slows_is_told_and_is_no_failure(arm: KinematicArm) -> None:
    # Stretching out to just before the singular position.
    report = run(arm, MoveLinear(offset=(0.29, 0.0, 0.0)))
    assert {problem.kind for problem in report.problems} == {"slowed"}
    assert report.ok
    assert report.path.tool[-1][0] - report.path.tool[0][0] == pytest.approx(0.29, abs=1e-4)


def test_what_would_be_touched_is_a_problem(among_things: KinematicArm) -> None:
    steps = (TurnJoint(joint=1, angle=0.1), MoveLinear(offset=(0.0, 0.0, -0.4)))
    report = run(among_things, Sequence(steps=steps))
    assert not report.ok
    assert report.problems[-1].kind == "collision"
    assert report.problems[-1].step == 2
    assert "mm from the table" in report.problems[-1].message
    # Each pair that only slows is told once, however the distance changes.
    slowing = [problem.message for problem in report.problems if problem.kind == "slowed"]
    assert len(slowing) <= 4


def test_problems_say_in_which_step_and_when(arm: KinematicArm) -> None:
    steps = (
        TurnJoint(joint=1, angle=0.5),
        Repeat(times=3, steps=(Gripper(width=0.1), Gripper(width=0.0))),
        MoveLinear(offset=(1.0, 0.0, 0.0)),
        TurnJoint(joint=1, angle=0.5),
    )
    report = run(arm, Sequence(steps=steps))
    assert kinds(report) == [(2, "gripper"), (3, "unreachable")]
    turned, ended = report.problems
    assert 0.5 < turned.time_s < 2.0
    assert turned.message == "the gripper opens to 0.080 m"
    # What cannot be done ends the program: the last turn is not made.
    assert ended.time_s == pytest.approx(report.duration_s, abs=STEP_S)
    assert report.path.joints[-1][0] == pytest.approx(arm.home[0] + 0.5, abs=1e-3)


def test_every_step_that_the_robot_refuses_is_named(arm: KinematicArm) -> None:
    report = run(arm, Sequence(steps=(Pose(name="moon"), Home(), TurnJoint(joint=9, angle=1.0))))
    assert kinds(report) == [(1, "unknown_pose"), (3, "unknown_joint")]
    assert report.duration_s == 0.0
    assert len(report.path.times) == 1


def test_a_jog_without_an_end_is_tried_for_two_seconds(arm: KinematicArm) -> None:
    report = run(arm, JogJoint(joint=1, velocity=0.3))
    assert 2.0 <= report.duration_s < 2.5
    assert report.path.joints[-1][0] - report.path.joints[0][0] == pytest.approx(0.6, abs=0.1)


def test_a_stop_in_a_program_ends_it(arm: KinematicArm) -> None:
    report = run(arm, Sequence(steps=(Stop(), TurnJoint(joint=1, angle=0.5))))
    assert report.ok
    assert report.path.joints[-1] == pytest.approx(arm.home, abs=1e-4)


def test_a_step_that_never_ends_is_found(
    arm: KinematicArm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where an arm is held back by something on its way to a pose."""
    from app.robot.motion.go_to import GoTo

    monkeypatch.setattr(GoTo, "step", lambda self, trajectory, reading: trajectory.brake())
    report = run(arm, Sequence(steps=(Wait(duration=8.0), Pose(name="left"))))
    assert kinds(report) == [(2, "never_ends")]
    assert report.duration_s == pytest.approx(8.0 + rehearsal.STANDING_S, abs=0.2)


def test_what_takes_too_long_is_broken_off(
    arm: KinematicArm, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rehearsal, "LONGEST_S", 5.0)
    report = run(arm, Sequence(steps=(Wait(duration=60.0),)))
    assert kinds(report) == [(1, "too_long")]
    assert "after 5 s of the program" in report.problems[0].message
    assert not report.ok


def test_it_is_broken_off_when_nobody_waits_for_it(arm: KinematicArm) -> None:
    report = Rehearsal(arm, SETTINGS, go_on=lambda: False).run(PROGRAM)
    assert report.duration_s <= 2 * STEP_S


def test_things_stand_where_the_real_ones_are(kinematic: KinematicArm) -> None:
    there = ObjectState(name="red_cube", position=(0.6, 0.2, 0.5), orientation=(1.0, 0, 0, 0))
    kinematic.place(np.array(kinematic.model.poses["left"]), 0.03, (there,))
    for _ in range(60):
        kinematic.step()
    reading = kinematic.read()
    found = {thing.name: thing.position for thing in reading.objects}
    assert found["red_cube"] == pytest.approx(there.position)
    assert reading.gripper == 0.03
    assert reading.joints == pytest.approx(kinematic.model.poses["left"])
