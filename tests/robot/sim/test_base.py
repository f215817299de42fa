"""A base that drives: real wheels on a real floor, under the node's own controller."""

from collections.abc import Iterator

import numpy as np
import pybullet
import pytest

from app.errors import CannotStart
from app.link.actions import (
    Gripper,
    Home,
    JogCartesian,
    JogJoint,
    MoveLinear,
    Pose,
    Sequence,
    TurnJoint,
)
from app.link.messages import StopCategory
from app.robot.models import model_assets
from app.robot.sim.base import SimulatedBase
from tests.robot.sim.rig import Rig


@pytest.fixture
def rig() -> Iterator[Rig]:
    rig = Rig("husky")
    yield rig
    rig.arm.close()


def place(rig: Rig) -> np.ndarray:
    assert rig.controller.reading.base is not None
    return np.array(rig.controller.reading.base)


def base_of(rig: Rig) -> SimulatedBase:
    assert isinstance(rig.arm, SimulatedBase)
    return rig.arm


def test_it_says_what_it_is(rig: Rig) -> None:
    description = rig.arm.description
    assert description.drives
    assert description.gripper_max == 0
    assert [joint.unit for joint in description.joints] == ["m", "rad"]
    assert rig.controller.state(rig.now).base == pytest.approx((0, 0, 0), abs=1e-3)


def test_an_arm_is_no_base() -> None:
    with pytest.raises(CannotStart, match="KUKA LBR iiwa 14 does not drive"):
        SimulatedBase(model_assets("kuka_iiwa"))


@pytest.mark.parametrize("frame", ["base", "tool"])
def test_a_straight_jog_drives_where_it_looks(rig: Rig, frame: str) -> None:
    rig.show(TurnJoint(joint=2, angle=0.5), 10.0)
    rig.wait(0.2)
    start = place(rig)
    rig.show(JogCartesian(frame=frame, linear=(0.3, 0, 0)), 2.0)
    rig.wait(0.5)
    way = place(rig) - start
    assert np.hypot(*way[:2]) == pytest.approx(0.3 * 2, rel=0.15)
    assert np.arctan2(way[1], way[0]) == pytest.approx(start[2], abs=0.03)
    assert way[2] == pytest.approx(0.0, abs=0.01)


def test_a_turning_jog_turns_and_both_make_a_curve(rig: Rig) -> None:
    rig.show(JogCartesian(frame="tool", angular=(0, 0, 0.5)), 2.0)
    rig.wait(0.5)
    assert place(rig)[2] == pytest.approx(1.0, rel=0.15)
    before = place(rig)
    rig.show(JogCartesian(frame="tool", linear=(0.3, 0, 0), angular=(0, 0, -0.5)), 2.0)
    rig.wait(0.5)
    assert place(rig)[2] - before[2] == pytest.approx(-1.0, rel=0.15)
    assert np.hypot(*(place(rig) - before)[:2]) > 0.4


def test_ways_and_turns_are_exact_as_measured(rig: Rig) -> None:
    for joint, way in ((1, 0.75), (2, 1.57), (2, -0.6), (1, -0.4)):
        before = rig.controller.reading.joints[joint - 1]
        rig.show(TurnJoint(joint=joint, angle=way), 15.0)
        rig.wait(0.5)
        assert rig.controller.reading.joints[joint - 1] - before == pytest.approx(way, abs=2e-3)
    heading = place(rig)[2]
    assert heading == pytest.approx(1.57 - 0.6, abs=5e-3)
    before = rig.controller.reading.joints[0]
    rig.show(MoveLinear(frame="tool", offset=(0.3, 0, 0)), 10.0)
    rig.wait(0.3)
    assert rig.controller.reading.joints[0] - before == pytest.approx(0.3, abs=2e-3)


def test_turns_are_counted_on_past_half_a_turn(rig: Rig) -> None:
    for _ in range(3):
        rig.show(TurnJoint(joint=2, angle=1.5), 15.0)
        rig.wait(0.2)
    assert rig.controller.reading.joints[1] == pytest.approx(4.5, abs=5e-3)
    assert place(rig)[2] == pytest.approx(4.5 - 2 * np.pi, abs=5e-3)


@pytest.mark.parametrize("joint", [1, 2])
def test_it_stands_within_200_ms_of_every_stop(rig: Rig, joint: int) -> None:
    categories: tuple[StopCategory, ...] = ("S2", "S1", "S0")
    for category in categories:
        reading = rig.show(JogJoint(joint=joint, velocity=4.0), 0.6)
        assert reading.velocities[joint - 1] > 0.9 * [0.475, 0.95][joint - 1]
        assert rig.stop(category) <= 0.2, category
        assert rig.controller.fault is None
        if category != "S2":
            rig.reset()


def test_braked_wheels_are_locked_even_when_it_is_pushed(rig: Rig) -> None:
    rig.stop("S1")
    base = base_of(rig)
    assert rig.controller.braked
    before = place(rig)
    for _ in range(240):
        pybullet.applyExternalForce(
            base.body, -1, (60, 0, 0), (0, 0, 0), pybullet.LINK_FRAME, physicsClientId=base.client
        )
        rig.cycle()
    assert place(rig) == pytest.approx(before, abs=5e-3)


def test_a_base_that_is_blocked_stops_for_good(rig: Rig) -> None:
    """Into the wall: the wheels spin, the base does not follow."""
    rig.show(TurnJoint(joint=2, angle=np.pi), 15.0)
    rig.wait(0.2)
    rig.show(JogJoint(joint=1, velocity=0.5), 12.0)
    assert rig.controller.fault is not None
    assert "drive is 0.1" in rig.controller.fault
    assert rig.controller.fault.endswith("where it should be: is the robot blocked?")
    assert rig.controller.state(rig.now).stop == "S1"


def test_it_pushes_a_crate(rig: Rig) -> None:
    rig.show(JogJoint(joint=1, velocity=0.4), 6.0)
    crate = {thing.name: thing for thing in rig.controller.reading.objects}["crate"]
    assert crate.position[0] > 2.5
    assert rig.controller.fault is None


REFUSED = [
    (JogCartesian(linear=(0, 0.1, 0)), "it cannot move sideways"),
    (JogCartesian(frame="tool", linear=(0.1, 0, 0.1)), "it cannot move up or down"),
    (JogCartesian(angular=(0.1, 0, 0)), "it cannot tilt"),
    (MoveLinear(offset=(0, 0.1, 0)), "it cannot move sideways"),
    (MoveLinear(offset=(0.1, 0, 0), rotation=(0, 0, 1)), "make two steps of it"),
    (Pose(name="start"), "it cannot find a clear way to a place by itself: drive it there"),
    (Home(), "it cannot find a clear way to a place by itself: drive it there"),
    (Gripper(width=0.0), "this robot has no gripper"),
    (
        Sequence(steps=(TurnJoint(joint=1, angle=0.1), Gripper(width=0.0))),
        "step 2: this robot has no gripper",
    ),
    (JogJoint(joint=3, velocity=0.1), "this robot has no joint 3; it has 2"),
]


def test_what_it_cannot_do_is_refused_in_plain_words(rig: Rig) -> None:
    before = place(rig)
    for action, reason in REFUSED:
        rig.show(action, 0.1)  # type: ignore[arg-type]
        assert reason in str(rig.controller.state(rig.now).reason)
        rig.wait(0.1)
    assert place(rig) == pytest.approx(before, abs=1e-3)


def test_a_speed_that_is_too_high_is_cut_and_said(rig: Rig) -> None:
    limits: set[str] = set()
    rig.show(
        JogCartesian(linear=(1.0, 0, 0)),
        1.0,
        lambda: limits.update(rig.controller.motion.limits),
    )
    assert limits == {"the robot moves at 48% of the speed asked for"}
    assert rig.controller.reading.velocities[0] == pytest.approx(0.475, abs=0.02)
