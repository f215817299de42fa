import random

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
    Sequence,
    Stop,
    TurnJoint,
)
from app.robot.models import model_assets
from app.robot.motion.limits import Limits
from app.robot.motion.trajectory import JointTrajectory
from tests.robot.fakes import DT, FakeArm
from tests.robot.motion.rig import Rig


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("speed", [0.1, -0.1])
def test_straight_lines_are_straight_and_as_fast_as_asked(axis: int, speed: float) -> None:
    rig = Rig()
    start = rig.arm.read().tool
    linear = [0.0, 0.0, 0.0]
    linear[axis] = speed
    rig.motion.begin(JogCartesian(linear=tuple(linear)))
    rig.run(1.0)
    before = rig.arm.read().tool.position
    rig.run(0.5)
    now = rig.arm.read().tool
    assert now.position[axis] - before[axis] == pytest.approx(speed * 0.5, rel=0.01)
    rig.motion.release()
    assert rig.finish() < 0.3
    for joints in rig.track:
        tool = rig.arm.kinematics.forward(joints)
        off = tool.position - start.position
        off[axis] = 0.0
        assert np.abs(off).max() < 1e-4
        assert abs(abs(tool.orientation @ start.orientation) - 1) < 1e-6


def test_a_held_jog_begins_at_a_crawl_and_one_with_a_duration_does_not() -> None:
    def way(action: JogCartesian) -> float:
        rig = Rig()
        start = rig.arm.read().tool.position
        rig.do(action, 0.5)
        return float(np.linalg.norm(rig.arm.read().tool.position - start))

    settings = ArmMotionSettings()
    held = way(JogCartesian(linear=(0.0, 0.1, 0.0)))
    assert held == pytest.approx(0.5 * 0.1 * settings.creep, rel=0.1)
    assert way(JogCartesian(linear=(0.0, 0.1, 0.0), duration=0.5)) == pytest.approx(0.05, rel=0.1)


def test_turning_about_the_tool_keeps_its_point() -> None:
    rig = Rig()
    start = rig.arm.read().tool.position
    rig.do(JogCartesian(frame="tool", angular=(0.0, 0.0, 0.5)), 1.0)
    for joints in rig.track:
        assert np.abs(rig.arm.kinematics.forward(joints).position - start).max() < 1e-4


def test_the_tool_frame_is_the_tools() -> None:
    rig = Rig()
    start = rig.arm.read().tool.position
    rig.do(JogCartesian(frame="tool", linear=(0.0, 0.0, 0.1)), 1.0)  # points down at home
    moved = rig.arm.read().tool.position - start
    assert moved[2] < -0.04
    assert np.abs(moved[:2]).max() < 1e-3


def test_a_straight_line_ends_before_a_limit_and_is_straight_to_the_end() -> None:
    rig = Rig()
    start = rig.arm.read().tool.position
    rig.do(JogCartesian(linear=(0.0, 0.0, 0.5)), 3.0)
    assert "a joint is at its limit" in rig.limits or any("singular" in x for x in rig.limits)
    for joints in rig.track:
        off = rig.arm.kinematics.forward(joints).position - start
        assert np.abs(off[:2]).max() < 1e-3


def test_a_line_out_of_reach_slows_down_and_stops() -> None:
    rig = Rig()
    rig.do(JogCartesian(linear=(0.5, 0.0, 0.0)), 4.0)
    assert any("singular" in text for text in rig.limits)


@pytest.mark.parametrize(
    "linear", [(0.3, 0.0, 0.0), (0.3, 0.3, 0.0), (0.2, 0.0, 0.3), (-0.3, 0.0, 0.0), (0.0, 0.0, 0.4)]
)
def test_from_a_singular_position_the_way_back_is_open(linear: tuple[float, float, float]) -> None:
    """Out until it goes no further; then back at the speed asked for, within every limit."""
    rig = Rig(FakeArm(bounded=False))
    rig.do(JogCartesian(linear=linear), 5.0)
    assert any("singular" in text or "at its limit" in text for text in rig.limits)
    end = rig.arm.read().tool.position
    back = tuple(-0.5 * part for part in linear)
    rig.do(JogCartesian(linear=back), 3.0)
    moved = rig.arm.read().tool.position - end
    away = moved @ np.array(back) / np.linalg.norm(back)
    assert away > 0.1
    assert np.linalg.norm(moved - away * np.array(back) / np.linalg.norm(back)) < 1e-3  # straight


def test_a_jog_into_a_limit_stops_there_and_leaves_it_again() -> None:
    rig = Rig(FakeArm(bounded=False))
    rig.do(JogJoint(joint=3, velocity=4.0), 4.0)
    upper = rig.arm.description.joints[2].upper
    assert upper - 0.05 < rig.arm.joints[2] <= upper
    assert "joint3 is at its upper limit" in rig.limits
    assert "joint3 turns at most at 2.02 rad/s" in rig.limits
    rig.do(JogJoint(joint=3, velocity=-1.0), 0.5)
    assert rig.arm.joints[2] < upper - 0.2


@pytest.mark.parametrize("angle", [0.5, -0.25, 1e-4, 0.0])
def test_a_turn_ends_exactly_at_its_angle(angle: float) -> None:
    rig = Rig()
    rig.motion.begin(TurnJoint(joint=1, angle=angle))
    rig.finish()
    expected = rig.arm.home + np.eye(6)[0] * angle
    assert np.abs(rig.arm.joints - expected).max() < 1e-9


def test_a_turn_past_the_limit_is_clipped_and_said() -> None:
    rig = Rig()
    rig.motion.begin(TurnJoint(joint=5, angle=6.0))
    rig.finish()
    assert rig.arm.joints[4] == pytest.approx(1.7453)
    assert "joint5 ends at its upper limit, 3.102 rad short" in rig.limits


def test_poses_are_reached_and_unknown_ones_refused() -> None:
    rig = Rig()
    rig.motion.begin(Pose(name="left"))
    rig.finish()
    assert rig.arm.joints == pytest.approx(rig.arm.description.poses["left"])
    reason = rig.motion.refusal(Sequence(steps=(Home(), Pose(name="moon"))))
    assert reason is not None
    assert reason.startswith("step 2: this robot has no pose 'moon'; it has: home, inspect,")


def test_letting_go_on_the_way_comes_to_rest_on_the_way() -> None:
    rig = Rig()
    rig.motion.begin(TurnJoint(joint=1, angle=2.0))
    rig.run(0.4)
    rig.motion.release()
    assert rig.finish() < 0.45
    assert 0.05 < rig.arm.joints[0] - rig.arm.home[0] < 1.0


@pytest.mark.parametrize("joint", range(1, 7))
@pytest.mark.parametrize("after", [0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5])
def test_a_stop_takes_at_most_200_ms_from_any_state(joint: int, after: float) -> None:
    rig = Rig()
    rig.motion.begin(JogJoint(joint=joint, velocity=4.3))
    rig.run(after)
    rig.motion.halt()
    assert rig.finish() <= 0.2


def test_a_stop_in_a_straight_line_takes_at_most_200_ms() -> None:
    for count in range(10, 200, 10):
        rig = Rig()
        rig.motion.begin(JogCartesian(linear=(0.3, 0.3, -0.3)))
        rig.run(count * DT)
        rig.motion.halt()
        assert rig.finish() <= 0.2


def test_a_sequence_runs_step_by_step() -> None:
    rig = Rig()
    rig.motion.begin(
        Sequence(
            steps=(
                TurnJoint(joint=1, angle=0.2),
                JogJoint(joint=1, velocity=0.5, duration=0.5),
                JogCartesian(linear=(0.0, 0.0, 0.1), duration=0.4),
                Gripper(width=0.0),
                Home(),
            )
        )
    )
    rig.finish()
    turned = max(joints[0] for joints in rig.track) - rig.arm.home[0]
    assert turned == pytest.approx(0.2 + 0.25, abs=0.05)
    assert rig.arm.width == 0.0
    assert rig.arm.joints == pytest.approx(rig.arm.home)


def test_letting_go_ends_a_sequence() -> None:
    rig = Rig()
    jog = JogCartesian(linear=(0.0, 0.0, 0.1), duration=5.0)
    rig.motion.begin(Sequence(steps=(jog, TurnJoint(joint=1, angle=1.0))))
    rig.run(0.5)
    rig.motion.release()
    assert rig.finish() < 0.4
    assert rig.arm.joints[0] == pytest.approx(rig.arm.home[0], abs=0.01)


def test_a_stop_in_a_sequence_asks_for_a_stop() -> None:
    rig = Rig()
    rig.motion.begin(Sequence(steps=(TurnJoint(joint=1, angle=0.1), Stop(), Home())))
    while not rig.motion.wants_stop:
        rig.step()
    assert rig.arm.joints[0] == pytest.approx(rig.arm.home[0] + 0.1)


def test_fingers_let_go_on_the_way_stay_there() -> None:
    rig = Rig()
    rig.do(Gripper(width=0.0), 0.2)
    rig.run(1.0)
    assert 0.03 < rig.arm.width < 0.06


def test_fingers_that_hold_something_go_on_holding() -> None:
    rig = Rig()
    rig.arm.blocked_at = 0.045
    rig.motion.begin(Gripper(width=0.0))
    rig.finish()
    rig.motion.halt()
    rig.run(0.5)
    assert rig.arm.wanted_width == 0.0


def test_a_new_action_needs_the_arm_at_rest() -> None:
    rig = Rig()
    rig.motion.begin(Home())
    with pytest.raises(ValueError, match="begins with the arm at rest"):
        rig.motion.begin(Home())


def random_action(rng: random.Random) -> Action:
    def speed(most: float) -> float:
        return rng.choice([rng.uniform(-most, most), most, -most, 0.0])

    kind = rng.randrange(7)
    if kind <= 1:
        return JogJoint(joint=rng.randint(1, 6), velocity=speed(4.3))
    if kind <= 3:
        return JogCartesian(
            frame=rng.choice(["base", "tool"]),
            linear=(speed(1.0), speed(1.0), speed(1.0)),
            angular=tuple(rng.choice([0.0, speed(3.15)]) for _ in range(3)),
        )
    if kind == 6:
        return MoveLinear(
            frame=rng.choice(["base", "tool"]),
            offset=(speed(0.3), speed(0.3), speed(0.3)),
            rotation=tuple(rng.choice([0.0, speed(3.1)]) for _ in range(3)),
            speed=rng.choice([None, 0.05, 1.0]),
        )
    if kind == 4:
        return TurnJoint(joint=rng.randint(1, 6), angle=speed(6.3))
    return Pose(name=rng.choice(["home", "ready", "left", "right", "tray", "inspect"]))


@pytest.mark.parametrize("seed", range(8))
def test_no_limit_is_ever_broken_whatever_is_asked(seed: int) -> None:
    rng = random.Random(seed)
    rig = Rig()
    for _ in range(250):
        action = random_action(rng)
        if not rig.motion.busy:
            rig.motion.begin(action)
        for _ in range(rng.randint(1, 30)):
            rig.step()
        what = rng.random()
        if what < 0.5:
            rig.motion.release()
        elif what < 0.8:
            rig.motion.halt()
            assert rig.finish() <= 0.2


def panda_limits() -> Limits:
    return Limits.of(model_assets("franka_panda").describe("r").joints, ArmMotionSettings())


def test_a_joint_whose_limits_leave_out_zero_may_move_slowly() -> None:
    """Joint 4 of the Panda: ruckig calls 0 an extreme position of a joint that hardly moves."""
    start = np.array([0.0, -0.3285, 0.0, -1.9233, 0.0, 1.5947, 0.7854])
    trajectory = JointTrajectory(panda_limits(), start, DT)
    velocity = np.array([1e-4, 0.0, 2e-4, 3.506833247261309e-10, 1e-4, 1e-10, 3e-4])
    assert trajectory.accept(start + velocity * DT, velocity)
