import pytest

from app.link.actions import Gripper, Sequence
from app.robot.motion.at_work import with_kind
from tests.robot.motion.rig import Rig


def test_the_force_is_the_one_asked_for_or_the_grippers_own() -> None:
    rig = Rig()
    rig.motion.begin(Gripper(width=0.02, force=5.0))
    rig.finish()
    assert (rig.arm.width, rig.arm.force) == (pytest.approx(0.02, abs=1e-3), 5.0)
    rig.motion.begin(Gripper(width=0.08))
    rig.finish()
    assert rig.arm.force is None


def test_too_wide_and_too_strong_are_clipped_and_said() -> None:
    rig = Rig()
    rig.motion.begin(Gripper(width=0.2, force=200.0))
    rig.finish()
    assert (rig.arm.wanted_width, rig.arm.force) == (0.08, 40.0)
    assert rig.limits == {
        "the gripper opens to 0.080 m",
        "the gripper presses with 40 N at most",
    }
    assert {with_kind(text).kind for text in rig.limits} == {"gripper"}


def test_fingers_let_go_on_the_way_keep_their_force() -> None:
    rig = Rig()
    rig.do(Sequence(steps=(Gripper(width=0.0, force=5.0),)), 0.2)
    rig.run(0.5)
    assert 0.03 < rig.arm.width < 0.06
    assert rig.arm.force == 5.0


def test_fingers_let_go_before_they_were_told_anything_are_told_nothing() -> None:
    rig = Rig()
    rig.motion.begin(Gripper(width=0.0))
    rig.finish()
    rig.motion.begin(Gripper(width=0.08))
    rig.motion.release()
    rig.run(0.5)
    assert rig.arm.wanted_width == 0.0


def test_fingers_that_hold_what_still_turns_between_them_go_on_holding() -> None:
    rig = Rig()
    rig.motion.begin(Gripper(width=0.0, force=5.0))
    rig.run(0.1)
    rig.arm.held = "red_cube"
    rig.step()
    rig.motion.release()
    assert rig.arm.wanted_width == 0.0


def test_fingers_let_go_while_they_open_stop_though_something_is_held() -> None:
    rig = Rig()
    rig.motion.begin(Gripper(width=0.0))
    rig.finish()
    rig.arm.held = "red_cube"
    rig.motion.begin(Gripper(width=0.08))
    rig.run(0.1)
    rig.motion.halt()
    rig.run(0.5)
    assert 0.0 < rig.arm.width < 0.06
