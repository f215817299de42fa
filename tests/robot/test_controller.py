from typing import get_args

import numpy as np
import pytest

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
from app.link.messages import Doubt, State, StopRequest
from app.robot.controller import DOUBTS, DT, tick_of
from app.robot.latch import StopLatch
from tests.robot.operator import JOG, Operator


def test_a_node_begins_disarmed_with_brakes_on() -> None:
    operator = Operator()
    assert operator.arm.braked
    assert (operator.state.mode, operator.state.reason) == ("disarmed", "not armed yet")
    operator.ask("take")
    operator.show(JOG, 1, 0.5)
    assert not operator.arm.velocities.any()


def test_a_state_tells_when_its_motion_began_and_by_which_frame() -> None:
    operator = Operator().ready()
    assert (operator.state.frame, operator.state.began) == (None, None)
    before = tick_of(operator.now)
    operator.show(JOG, 1, 0.2)
    state = operator.state
    assert state.began is not None
    assert before <= state.began <= before + 10, "with the first command of the showing"
    first = operator.sequence - 5
    assert state.frame == first
    operator.show(JOG, 1, 0.2)
    assert (operator.state.frame, operator.state.began) == (first, state.began)
    operator.show(None, 1, 0.5)
    assert (operator.state.frame, operator.state.began) == (None, None)


def test_a_jog_runs_while_it_is_held_and_ends_smoothly() -> None:
    operator = Operator().ready()
    operator.show(JOG, 1, 0.5)
    assert (operator.state.mode, operator.state.action) == ("moving", JOG)
    assert operator.state.frame is not None
    assert operator.arm.velocities[0] == pytest.approx(1.0)
    operator.show(None, 1, 0.5)
    assert (operator.state.mode, operator.state.stop) == ("armed", None)
    assert not operator.arm.velocities.any()


LINE = MoveLinear(offset=(0.0, 0.3, 0.0), speed=0.5)


@pytest.mark.parametrize(
    "action",
    [
        LINE,
        Sequence(steps=(Repeat(times=9, steps=(LINE, TurnJoint(joint=1, angle=-0.3))),)),
        Sequence(steps=(Wait(duration=0.1), LINE, Wait(duration=1.0), Home())),
    ],
    ids=["line", "repeat", "wait"],
)
@pytest.mark.parametrize("silent", [False, True])
def test_every_kind_of_program_stops_when_its_gesture_is_let_go_or_not_heard_of(
    action: Action, silent: bool
) -> None:
    operator = Operator().ready()
    operator.show(action, 1, 0.6)
    assert operator.state.mode == "moving"
    assert operator.arm.velocities.any()
    if silent:
        assert operator.standstill_after() <= 0.46
        assert operator.state.stop == "S2"
    else:
        operator.show(None, 1, 0.5)
        assert (operator.state.mode, operator.state.stop) == ("armed", None)
    there = operator.arm.joints
    operator.wait(1.0)
    assert (operator.arm.joints == there).all()


def test_what_gives_up_says_why_while_its_gesture_is_held() -> None:
    operator = Operator().ready()
    operator.show(MoveLinear(offset=(1.0, 0.0, 0.0)), 1, 0.5)
    state = operator.state
    assert (state.mode, state.armed, state.stop) == ("armed", True, None)
    assert state.reason is not None
    assert state.reason.startswith("only 32.0 cm of 100.0 cm can be reached in a straight line")
    assert State.model_validate_json(state.encode()) == state
    operator.show(None, 1, 0.2)
    assert operator.state.reason is None
    operator.show(LINE, 2, 0.2)
    assert (operator.state.mode, operator.state.reason) == ("moving", None)


@pytest.mark.parametrize(("joint", "velocity"), [(1, 4.3), (2, -4.3), (4, 4.3), (6, 4.3)])
def test_silence_stops_the_arm_within_500_ms(joint: int, velocity: float) -> None:
    operator = Operator().ready()
    operator.show(JogJoint(joint=joint, velocity=velocity), 1, 0.4)
    assert operator.state.mode == "moving"
    assert 0.25 < operator.standstill_after() <= 0.46
    state = operator.state
    assert (state.mode, state.stop, state.armed) == ("holding", "S2", True)
    assert state.reason == "no command in time: the picture or the link failed"
    assert not operator.arm.braked


def test_after_silence_only_a_new_gesture_after_half_a_second_of_none_moves() -> None:
    operator = Operator().ready()
    operator.show(JOG, 1, 0.4)
    operator.wait(0.6)
    operator.show(JOG, 1, 0.5)
    operator.show(JOG, 2, 0.5)
    assert operator.state.mode == "holding"
    operator.show(None, 2, 0.4)
    assert operator.state.mode == "holding"
    operator.show(JOG, 3, 0.1)  # too early: begins anew
    operator.show(None, 3, 0.6)
    assert operator.state.mode == "armed"
    operator.show(JOG, 3, 0.2)
    assert operator.state.mode == "armed"
    operator.show(JOG, 4, 0.2)
    assert operator.state.mode == "moving"


def test_arming_begins_no_motion_and_the_first_new_gesture_does() -> None:
    operator = Operator()
    operator.ask("take")
    operator.show(JOG, 1, 0.3)
    operator.ask("arm")
    assert operator.state.mode == "armed"
    operator.show(JOG, 1, 0.5)
    assert not operator.arm.velocities.any()
    operator.show(JOG, 2, 0.2)
    assert operator.state.mode == "moving"


def test_a_gesture_whose_action_was_withheld_does_not_move_after_arming() -> None:
    operator = Operator()
    operator.ask("take")
    operator.controller.cycle(operator.now, [operator.command(None, 1, gesture="left")])
    operator.ask("arm")
    operator.show(JOG, 1, 0.3)
    assert operator.state.mode == "armed"


def test_arming_after_a_stop_waits_for_half_a_second_of_no_gesture() -> None:
    operator = Operator().ready()
    operator.show(JOG, 1, 0.3)
    operator.ask("release")
    operator.wait(0.5)
    operator.ask("take")
    operator.ask("arm")
    assert operator.state.mode == "holding"
    operator.show(JOG, 2, 0.5)
    assert operator.state.mode == "holding"
    operator.show(None, 2, 0.6)
    assert operator.state.mode == "armed"


def test_a_gesture_without_an_allowed_action_is_not_no_gesture() -> None:
    operator = Operator()
    operator.ask("take")
    operator.ask("arm")
    operator.controller.stop(StopRequest(category="S2", source="test", reason="x"))
    for _ in range(40):
        command = operator.command(None, 1, gesture="left", reason="not armed")
        operator.controller.cycle(operator.now, [command])
        operator.wait(0.03)
    assert operator.state.mode == "holding"


def test_a_turn_ends_at_its_angle_and_does_not_repeat_until_a_new_hold() -> None:
    operator = Operator().ready()
    turn = TurnJoint(joint=1, angle=0.3)
    operator.show(turn, 1, 3.0)
    assert operator.state.mode == "armed"
    assert operator.arm.joints[0] - operator.arm.home[0] == pytest.approx(0.3, abs=1e-6)
    operator.show(None, 1, 0.2)
    operator.show(turn, 2, 3.0)
    assert operator.arm.joints[0] - operator.arm.home[0] == pytest.approx(0.6, abs=1e-6)


def test_the_next_gesture_begins_when_the_arm_has_come_to_rest() -> None:
    operator = Operator().ready()
    operator.show(JOG, 1, 0.5)
    operator.show(JogCartesian(linear=(0.0, 0.0, 0.1)), 2, 1.5)
    assert operator.arm.read().tool.position[2] > 0.75
    steps = np.diff([joints for joints, _ in operator.arm.moves], axis=0)
    assert np.abs(np.diff(steps, axis=0)).max() < 40 * DT**2


def test_another_action_under_the_same_hold_ends_it() -> None:
    operator = Operator().ready()
    operator.show(JOG, 1, 0.3)
    operator.show(Home(), 1, 0.5)
    assert operator.state.mode == "armed"
    assert operator.state.reason is not None
    assert operator.state.reason.startswith("the action changed while its gesture was held")


def test_an_unknown_pose_moves_nothing_and_says_why() -> None:
    operator = Operator().ready()
    operator.show(Pose(name="moon"), 1, 0.3)
    assert operator.state.mode == "armed"
    assert operator.state.reason is not None
    assert operator.state.reason.startswith("this robot has no pose 'moon'; it has: home")


@pytest.mark.parametrize("category", ["S1", "S0"])
def test_a_stop_latches_until_reset_arm_and_a_new_gesture(category: str) -> None:
    operator = Operator().ready()
    operator.show(JOG, 1, 0.4)
    operator.controller.stop(StopRequest(category=category, source="page", reason="button"))
    assert operator.arm.braked == (category == "S0")
    assert operator.standstill_after() <= 0.2
    operator.wait(0.05)
    assert operator.arm.braked
    state = operator.state
    assert (state.mode, state.stop, state.stops, state.armed) == ("stopped", category, 1, False)
    assert state.reason == "button (page)"
    operator.show(JOG, 2, 0.3)
    assert operator.ask("arm").code == "latched"
    assert operator.ask("reset", holder="anybody").granted
    assert (operator.state.mode, operator.state.armed) == ("disarmed", False)
    operator.show(JOG, 3, 0.3)
    assert operator.ask("arm").granted
    assert not operator.arm.velocities.any()
    operator.show(JOG, 3, 0.3)
    assert operator.state.mode == "holding"
    operator.show(None, 3, 0.6)
    operator.show(JOG, 4, 0.3)
    assert operator.state.mode == "moving"


def test_the_worst_stop_wins() -> None:
    operator = Operator().ready()
    for category, expected in [
        ("S2", "S2"),
        ("S1", "S1"),
        ("S2", "S1"),
        ("S0", "S0"),
        ("S1", "S0"),
    ]:
        operator.controller.stop(StopRequest(category=category, source="test", reason="x"))
        assert operator.state.stop == expected


def test_a_reset_waits_for_standstill() -> None:
    operator = Operator().ready()
    operator.show(JOG, 1, 0.4)
    operator.controller.stop(StopRequest(source="page", reason="button"))
    operator.wait(0.02)
    assert operator.ask("reset").code == "moving"
    operator.wait(0.3)
    assert operator.ask("reset").granted


def test_the_latch_survives_a_restart(tmp_path) -> None:
    latch = StopLatch(tmp_path / "latch")
    Operator(latch).controller.stop(StopRequest(source="page", reason="button"))
    latch.close()
    latch = StopLatch(tmp_path / "latch")
    again = Operator(latch)
    assert again.state.mode == "stopped"
    assert again.state.reason == "button (from before the node started)"
    again.ask("take")
    assert not again.ask("arm").granted
    assert again.ask("reset").granted
    latch.close()
    assert Operator(StopLatch(tmp_path / "latch")).state.mode == "disarmed"


def test_the_stop_gesture_of_the_holder_stops() -> None:
    operator = Operator().ready()
    operator.show(Stop(), 1, 0.1)
    assert operator.state.mode == "stopped"
    assert operator.state.reason == "the gesture 'stop' was shown (anna)"
    assert operator.state.stops == 1


def test_a_takeover_stops_the_arm_and_needs_arming_again() -> None:
    operator = Operator().ready()
    operator.show(JOG, 1, 0.4)
    old = operator.command(JOG, 1)
    assert not operator.ask("take", holder="ben").granted
    assert operator.ask("take", holder="ben", takeover=True).granted
    assert operator.standstill_after() <= 0.2
    state = operator.state
    assert (state.mode, state.armed, state.controller, state.stop) == (
        "disarmed",
        False,
        "ben",
        "S2",
    )
    operator.controller.cycle(operator.now, [old])
    assert operator.state.dropped == {"epoch": 1}
    assert operator.ask("arm", holder="anna").code == "no_control"
    assert operator.ask("arm", holder="ben").granted


def test_a_holder_who_is_gone_frees_the_lease() -> None:
    operator = Operator().ready()
    operator.wait(2.1)
    state = operator.state
    assert (state.controller, state.armed, state.mode) == (None, False, "disarmed")
    assert state.reason == "anna has not been heard of: control is free"


def test_disarming_stops_and_brakes() -> None:
    operator = Operator().ready()
    operator.show(JOG, 1, 0.4)
    assert operator.ask("disarm").granted
    assert operator.standstill_after() <= 0.2
    operator.wait(0.05)
    assert operator.arm.braked
    assert operator.state.reason == "disarmed by anna"


def test_disarmed_and_armed_within_one_cycle_the_arm_stops_all_the_same() -> None:
    operator = Operator().ready()
    operator.show(JOG, 1, 0.4)
    assert operator.ask("disarm").granted
    assert operator.ask("arm").granted
    operator.show(JOG, 1, 0.3)
    assert not operator.arm.velocities.any()


def test_a_stop_gesture_stops_however_long_its_name_is() -> None:
    operator = Operator().ready()
    operator.controller.cycle(operator.now, [operator.command(Stop(), 1, gesture="x" * 1000)])
    assert operator.state.mode == "stopped"


def test_a_burst_of_stale_commands_moves_nothing() -> None:
    operator = Operator().ready()
    burst = [operator.command(JOG, 1) for _ in range(30)]
    operator.wait(0.3)
    operator.controller.cycle(operator.now, burst)
    operator.wait(0.1)
    assert operator.state.dropped == {"expired": 30}
    assert not operator.arm.velocities.any()


def test_commands_from_the_future_are_dropped() -> None:
    operator = Operator().ready()
    operator.controller.cycle(operator.now, [operator.command(JOG, 1, tick=10**9)])
    assert operator.state.dropped == {"future": 1}


def test_a_blocked_arm_is_stopped() -> None:
    operator = Operator().ready()
    operator.arm.stuck = True
    operator.show(JOG, 1, 1.0)
    assert operator.state.mode == "stopped"
    assert operator.state.fault is not None
    assert operator.state.fault.startswith("joint1 is 0.15 rad away from where it should be")
    assert operator.arm.braked
    operator.arm.stuck = False
    assert operator.ask("reset").granted
    assert operator.state.fault is None


def test_arming_begins_where_the_arm_really_is() -> None:
    operator = Operator()
    operator.arm.joints = operator.arm.home + 0.1
    operator.wait(DT)
    operator.ready()
    assert operator.state.commanded == pytest.approx(operator.arm.home + 0.1)


def test_the_gripper_moves_while_held() -> None:
    operator = Operator().ready()
    operator.show(Gripper(width=0.0), 1, 0.2)
    operator.show(None, 1, 0.5)
    assert 0.03 < operator.arm.width < 0.06


def doubted(operator: Operator, doubt: str, seconds: float = 0.1, **more: object) -> None:
    """Commands that doubt what the operator shows or sees, 30 a second."""
    for count in range(round(seconds / DT)):
        operator.now += DT
        commands = [operator.command(None, 1, doubt=doubt, **more)] if count % 8 == 0 else []
        operator.controller.cycle(operator.now, commands)


@pytest.mark.parametrize("doubt", ["no_hand", "unknown_hand", "two_hands", "low_margin"])
def test_a_hand_that_is_not_sure_any_more_holds_the_arm_still(doubt: str) -> None:
    operator = Operator().ready()
    operator.show(JOG, 1, 0.4)
    doubted(operator, doubt)
    state = operator.state
    assert (state.mode, state.stop, state.doubt, state.armed) == ("holding", "S2", doubt, True)
    assert state.reason == DOUBTS[doubt]
    assert operator.standstill_after() <= 0.2
    # Only a new gesture after half a second of none goes on.
    operator.show(JOG, 2, 0.3)
    assert operator.state.mode == "holding"
    operator.show(None, 2, 0.6)
    assert (operator.state.mode, operator.state.doubt) == ("armed", None)
    operator.show(JOG, 3, 0.3)
    assert operator.state.mode == "moving"


@pytest.mark.parametrize("doubt", ["frozen", "stale_picture"])
def test_eyes_that_see_nothing_new_hold_the_arm_still_although_the_gesture_is_held(
    doubt: str,
) -> None:
    operator = Operator().ready()
    operator.show(JOG, 1, 0.4)
    # Half a second without an action, but not without a gesture.
    doubted(operator, doubt, 1.0, gesture="jog_joint", reason="x")
    state = operator.state
    assert (state.mode, state.stop, state.doubt) == ("holding", "S2", doubt)
    assert not operator.arm.velocities.any()
    operator.show(JOG, 1, 0.3)
    assert not operator.arm.velocities.any()


def test_every_doubt_has_words_of_its_own() -> None:
    assert set(DOUBTS) == set(get_args(Doubt))
    assert len(set(DOUBTS.values())) == len(DOUBTS)


def test_a_doubt_without_an_action_under_way_stops_nothing() -> None:
    operator = Operator().ready()
    doubted(operator, "no_hand", 0.3)
    assert operator.state.mode == "armed"
    turn = TurnJoint(joint=1, angle=0.1)
    operator.show(turn, 1, 2.0)  # ends by itself
    doubted(operator, "unknown_hand", 0.3)
    assert operator.state.mode == "armed"
    operator.show(JOG, 2, 0.4)
    operator.show(None, 2, 0.02)  # let go: a hand that goes on to the next gesture
    doubted(operator, "unknown_hand", 0.1)
    assert operator.state.mode in ("moving", "armed")
    operator.show(JogJoint(joint=2, velocity=0.3), 3, 0.5)
    assert operator.state.mode == "moving"


def test_another_stop_is_not_told_as_the_doubt_before_it() -> None:
    operator = Operator().ready()
    operator.show(JOG, 1, 0.4)
    doubted(operator, "no_hand", 0.1)
    operator.controller.stop(StopRequest(category="S2", source="page", reason="wait"))
    assert (operator.state.doubt, operator.state.reason) == (None, "wait (page)")


def test_the_speed_follows_the_scale_smoothly() -> None:
    operator = Operator().ready()
    velocities, wanted = [], JogJoint(joint=1, velocity=1.0)
    for scale, expected in [(0.2, 0.2), (1.0, 1.0), (0.05, 0.05), (0.5, 0.5)]:
        for count in range(round(0.8 / DT)):
            operator.now += DT
            commands = [operator.command(wanted, 1, scale=scale)] if count % 8 == 0 else []
            operator.controller.cycle(operator.now, commands)
            velocities.append(float(operator.arm.velocities[0]))
        assert operator.state.scale == scale
        assert velocities[-1] == pytest.approx(expected, abs=1e-6)
    limits = operator.controller.motion.trajectory.limits.ordinary
    acceleration = np.diff(velocities) / DT
    assert np.abs(acceleration).max() <= limits.acceleration[0] * 1.001
    assert np.abs(np.diff(acceleration) / DT).max() <= limits.jerk[0] * 1.001


@pytest.mark.parametrize(
    "action",
    [
        TurnJoint(joint=1, angle=1.5),
        Pose(name="tray"),
        JogCartesian(linear=(0.0, 0.0, 0.2)),
        JogCartesian(angular=(0.0, 0.0, 0.5), frame="tool"),
    ],
    ids=lambda action: action.type,
)
def test_a_change_of_the_scale_in_any_motion_keeps_the_limits(action: Action) -> None:
    operator = Operator().ready()
    limits = operator.controller.motion.trajectory.limits
    tops, velocities = [], []
    for scale, seconds in [(1.0, 0.3), (0.1, 0.3), (0.1, 0.2), (0.5, 0.2)]:
        part = []
        for count in range(round(seconds / DT)):
            operator.now += DT
            commands = [operator.command(action, 1, scale=scale)] if count % 8 == 0 else []
            operator.controller.cycle(operator.now, commands)
            part.append(operator.controller.motion.trajectory.velocity.copy())
        tops.append(float((np.abs(part) / limits.ordinary.velocity).max()))
        velocities += part
    assert tops[2] <= 0.1 + 1e-6
    assert min(tops[0], tops[3]) > 1.5 * tops[2]
    acceleration = np.diff(velocities, axis=0) / DT
    assert (np.abs(acceleration) <= limits.ordinary.acceleration * 1.01).all()
    assert (np.abs(np.diff(acceleration, axis=0) / DT) <= limits.stop.jerk * 1.01).all()


def test_the_states_tell_the_newest_steps() -> None:
    operator = Operator().ready()
    operator.show(JOG, 1, 0.4)
    doubted(operator, "two_hands")
    steps = operator.state.transitions
    assert [step.number for step in steps] == list(range(1, len(steps) + 1))
    assert (steps[-1].before, steps[-1].after, steps[-1].stop) == ("armed", "holding", "S2")
    assert steps[-1].reason == DOUBTS["two_hands"]
    assert 0 <= tick_of(operator.now) - steps[-1].tick <= 110
    assert State.model_validate_json(operator.state.encode()).transitions == steps


def test_things_go_back_only_while_the_arm_is_disarmed_or_stopped_and_stands() -> None:
    operator = Operator().ready()
    assert operator.ask("reset_scene", holder="anybody").code == "armed"
    operator.show(JOG, 1, 0.4)
    operator.ask("disarm")
    assert operator.ask("reset_scene").code == "moving"
    operator.wait(0.4)
    assert operator.arm.scene_resets == 0
    assert operator.ask("reset_scene", holder="anybody").granted
    operator.controller.stop(StopRequest(source="page", reason="button"))
    operator.wait(0.1)
    assert operator.ask("reset_scene").granted
    assert operator.arm.scene_resets == 2
    assert operator.state.mode == "stopped"
