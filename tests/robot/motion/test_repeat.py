import pytest

from app.link.actions import Home, Repeat, Sequence, Stop, TurnJoint, Wait
from app.robot.motion.repeat import counted_out
from tests.robot.fakes import DT
from tests.robot.motion.rig import Rig

NOD = (TurnJoint(joint=1, angle=0.1), TurnJoint(joint=1, angle=-0.05))


def test_repeats_are_counted_out_and_places_are_named() -> None:
    places = list(counted_out(Sequence(steps=(Home(), Repeat(times=2, steps=NOD), Stop()))))
    assert [place.action for place in places] == [Home(), *NOD, *NOD, Stop()]
    assert [str(place) for place in places] == [
        "step 1 of 3",
        "step 2 of 3 (time 1 of 2, step 1)",
        "step 2 of 3 (time 1 of 2, step 2)",
        "step 2 of 3 (time 2 of 2, step 1)",
        "step 2 of 3 (time 2 of 2, step 2)",
        "step 3 of 3",
    ]


def test_a_repeat_is_done_as_often_as_it_says() -> None:
    rig = Rig()
    rig.motion.begin(Sequence(steps=(Repeat(times=3, steps=NOD),)))
    seen = set()
    while rig.motion.busy:
        rig.step()
        seen.add(rig.motion.place)
    assert rig.arm.joints[0] == pytest.approx(rig.arm.home[0] + 0.15)
    assert len(seen - {None}) == 6


def test_letting_go_ends_a_repeat() -> None:
    rig = Rig()
    rig.motion.begin(Sequence(steps=(Repeat(times=50, steps=NOD),)))
    rig.run(1.0)
    rig.motion.release()
    assert rig.finish() < 0.4
    assert rig.arm.joints[0] < rig.arm.home[0] + 0.3


def test_a_wrong_step_in_a_repeat_is_named() -> None:
    rig = Rig()
    bad = Sequence(steps=(Home(), Repeat(times=2, steps=(TurnJoint(joint=9, angle=0.1),))))
    refusal = rig.motion.refusal(bad)
    assert refusal == "step 2: step 1: this robot has no joint 9; it has 6"
    assert refusal.kind == "unknown_joint"


def test_a_wait_stands_for_its_time_and_ends_when_let_go() -> None:
    rig = Rig()
    rig.motion.begin(Sequence(steps=(Wait(duration=0.5), TurnJoint(joint=1, angle=0.1))))
    rig.run(0.5 - DT)
    assert rig.motion.trajectory.at_rest
    rig.run(0.2)
    assert not rig.motion.trajectory.at_rest
    rig.finish()
    rig.motion.begin(Sequence(steps=(Wait(duration=60.0), Home())))
    rig.run(0.2)
    rig.motion.release()
    assert rig.finish() < 0.02
