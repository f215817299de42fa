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
