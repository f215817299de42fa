import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

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
from app.link.messages import Command, LeaseReply, LeaseRequest, State, StopRequest
from app.robot.controller import DT, Controller, tick_of
from app.robot.latch import StopLatch
from tests.robot.fakes import FakeArm

JOG = JogJoint(joint=1, velocity=1.0)


class Operator:
    """A controller with a fake arm, a clock of its own, and somebody who drives it."""

    def __init__(self, latch: StopLatch | None = None) -> None:
        self.arm = FakeArm()
        self.now = 1000.0
        self.controller = Controller(
            self.arm, "puma", ArmMotionSettings(), latch or StopLatch(None), self.now
        )
        self.epoch = 0
        self.sequence = 0

    @property
    def state(self) -> State:
        return self.controller.state(self.now)

    def ask(self, kind: str, holder: str = "anna", **more: object) -> LeaseReply:
        request = LeaseRequest(kind=kind, holder=holder, epoch=self.epoch, **more)
        reply = self.controller.answer(request, self.now)
        if kind == "take" and reply.granted:
            assert reply.epoch is not None
            self.epoch = reply.epoch
        return reply

    def command(self, action: Action | None, hold: int, **more: object) -> Command:
        self.sequence += 1
        values = {
            "epoch": self.epoch,
            "sequence": self.sequence,
            "tick": tick_of(self.now),
            "frame": self.sequence,
            "hold": hold,
            "gesture": None if action is None else action.type,
            "action": action,
        }
        return Command(**(values | more))

    def wait(self, seconds: float) -> None:
        for _ in range(round(seconds / DT)):
            self.now += DT
            self.controller.cycle(self.now)

    def show(self, action: Action | None, hold: int, seconds: float) -> None:
        """A command every eighth cycle, 30 a second."""
        for count in range(round(seconds / DT)):
            self.now += DT
            commands = [self.command(action, hold)] if count % 8 == 0 else []
            self.controller.cycle(self.now, commands)

    def ready(self) -> "Operator":
        assert self.ask("take").granted
        assert self.ask("arm").granted
        self.show(None, 0, 0.6)
        assert self.state.mode == "armed"
        return self

    def standstill_after(self, limit: float = 1.0) -> float:
        for count in range(round(limit / DT)):
            if not self.arm.velocities.any() and not self.controller.motion.busy:
                return count * DT
            self.wait(DT)
        raise AssertionError("still moving")


def test_a_node_begins_disarmed_with_brakes_on() -> None:
    operator = Operator()
    assert operator.arm.braked
    assert (operator.state.mode, operator.state.reason) == ("disarmed", "not armed yet")
    operator.ask("take")
    operator.show(JOG, 1, 0.5)
    assert not operator.arm.velocities.any()


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
    operator.show(JogCartesian(linear=(0.0, 0.0, 0.1)), 2, 1.0)
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
    operator = Operator(StopLatch(tmp_path / "latch"))
    operator.controller.stop(StopRequest(source="page", reason="button"))
    again = Operator(StopLatch(tmp_path / "latch"))
    assert again.state.mode == "stopped"
    assert again.state.reason == "button (from before the node started)"
    again.ask("take")
    assert not again.ask("arm").granted
    assert again.ask("reset").granted
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


class AnyOrder(RuleBasedStateMachine):
    """Whatever happens in whatever order: moving needs everything at once."""

    def __init__(self) -> None:
        super().__init__()
        self.it = Operator()
        self.hold = 0
        self.holders = {"anna": 0, "ben": 0}
        self.last_valid = -1.0
        self.was_moving = False

    @rule(holder=st.sampled_from(["anna", "ben"]), takeover=st.booleans())
    def take(self, holder: str, takeover: bool) -> None:
        if self.it.ask("take", holder=holder, takeover=takeover).granted:
            self.holders[holder] = self.it.epoch

    @rule(
        holder=st.sampled_from(["anna", "ben"]),
        kind=st.sampled_from(["renew", "release", "arm", "arm", "disarm", "reset"]),
    )
    def ask(self, holder: str, kind: str) -> None:
        self.it.controller.answer(
            LeaseRequest(kind=kind, holder=holder, epoch=self.holders[holder]), self.it.now
        )

    @rule(category=st.sampled_from(["S0", "S1", "S2"]))
    def stop(self, category: str) -> None:
        before = self.it.state.stops
        self.it.controller.stop(StopRequest(category=category, source="test", reason="x"))
        assert self.it.state.stops == before + 1
        assert not self.it.controller.safety.may_move

    @rule(
        holder=st.sampled_from(["anna", "ben"]),
        new=st.booleans(),
        seconds=st.floats(0.02, 0.8),
        action=st.sampled_from([JOG, None, None, TurnJoint(joint=2, angle=0.2), Home(), Stop()]),
    )
    def show(self, holder: str, new: bool, seconds: float, action: Action | None) -> None:
        self.hold += new
        self.it.epoch = self.holders[holder]
        controller = self.it.controller
        for count in range(round(seconds / DT)):
            self.it.now += DT
            commands = [self.it.command(action, self.hold)] if count % 8 == 0 else []
            dropped = sum(controller.gate.dropped.values())
            controller.cycle(self.it.now, commands)
            if commands and sum(controller.gate.dropped.values()) == dropped:
                self.last_valid = self.it.now
            self.check()

    @rule(seconds=st.floats(0.01, 2.5))
    def wait(self, seconds: float) -> None:
        for _ in range(round(seconds / DT)):
            self.it.wait(DT)
            self.check()

    @precondition(lambda self: self.it.controller.safety.phase.value == "disarmed")
    @rule()
    def get_ready(self) -> None:
        if self.it.ask("take").granted:
            self.holders["anna"] = self.it.epoch
            self.it.ask("arm")
            self.show("anna", True, 0.7, None)
            self.show("anna", True, 0.4, JOG)

    @invariant()
    def check(self) -> None:
        state = self.it.state
        silent = self.it.now - self.last_valid
        if state.mode == "moving":
            assert state.armed
            assert state.stop is None
            assert state.controller is not None
            assert silent <= 0.25 + 2 * DT
        if silent > 0.25 + 0.2 + 3 * DT:
            assert not self.it.arm.velocities.any()
        if state.mode in ("stopped", "disarmed"):
            assert not state.armed
        if self.it.arm.braked:
            assert not self.it.arm.velocities.any()


AnyOrder.TestCase.settings = settings(
    max_examples=200,
    stateful_step_count=12,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
TestAnyOrder = pytest.mark.timeout(300)(AnyOrder.TestCase)
