"""From gestures to commands."""

from dataclasses import replace

import pytest

from app.gateway.drive import FROZEN, Driver, Lease, Situation
from app.gateway.numbers import Counter, newer
from app.link.actions import Gripper, Home, JogCartesian, Sequence, Stop, TurnJoint
from app.link.messages import State
from app.pipeline.types import Cause

ACTIONS = {
    "forward": JogCartesian(linear=(0.1, 0.0, 0.0)),
    "home": Home(),
    "turn": TurnJoint(joint=1, angle=0.5),
    "wave": Sequence(steps=(TurnJoint(joint=6, angle=0.5),)),
    "open": Gripper(width=0.08),
    "stop": Stop(),
}


def state(**values: object) -> State:
    return State(
        **{
            "robot": "puma",
            "tick": 1234,
            "mode": "armed",
            "armed": True,
            "controller": "me",
            "epoch": 7,
            "joints": (0.0,) * 6,
            "velocities": (0.0,) * 6,
            "commanded": (0.0,) * 6,
            "gripper": 0.0,
            "tool_position": (0.0,) * 3,
            "tool_orientation": (1.0, 0.0, 0.0, 0.0),
            **values,
        }
    )


READY = Situation(ACTIONS, Lease(7), state())


def at(seconds: float) -> Situation:
    return replace(READY, at=seconds)


def let_go(driver: Driver, begin: float = 2.0, seconds: float = 0.5) -> None:
    """Ten frames a second that show no gesture."""
    for count in range(round(seconds * 10) + 1):
        assert driver.decide(None, 3, at(begin + count / 10)).reason is None


@pytest.fixture
def driver() -> Driver:
    return Driver("me", Counter(), Counter())


def test_a_frame_without_a_gesture_is_a_command_too(driver: Driver) -> None:
    decision = driver.decide(None, 5, READY)
    command = decision.command
    assert command is not None
    assert (command.action, command.gesture, command.reason) == (None, None, None)
    assert (command.epoch, command.tick, command.frame) == (7, 1234, 5)
    assert decision.reason is None


def test_sequence_rises_and_a_hold_stays_while_the_gesture_does(driver: Driver) -> None:
    commands = [
        driver.decide(gesture, frame, READY).command
        for frame, gesture in enumerate(["forward", "forward", None, "forward", "home"])
    ]
    assert all(commands)
    first = commands[0].sequence
    assert [command.sequence - first for command in commands] == [0, 1, 2, 3, 4]
    holds = [command.hold for command in commands]
    assert holds[0] == holds[1]
    assert holds[1] < holds[3] < holds[4]
    assert [command.action for command in commands] == [
        ACTIONS["forward"], ACTIONS["forward"], None, ACTIONS["forward"], ACTIONS["home"],
    ]  # fmt: skip


def test_a_gesture_that_ended_with_the_frames_begins_anew(driver: Driver) -> None:
    first = driver.decide("home", 1, READY).command
    driver.end()
    second = driver.decide("home", 2, READY).command
    assert first is not None
    assert second is not None
    assert second.hold > first.hold


def test_two_sessions_never_share_a_hold() -> None:
    holds = Counter()
    first = Driver("a", holds, Counter()).decide("home", 1, READY).command
    second = Driver("b", holds, Counter()).decide("home", 1, READY).command
    assert first is not None
    assert second is not None
    assert first.hold != second.hold


OBSTACLES = {
    "no lease, nobody": (
        replace(READY, lease=None, state=state(controller=None)),
        "nobody has control: take control first",
    ),
    "no lease, another": (
        replace(READY, lease=None, state=state(controller="you")),
        "you do not have control: you drives",
    ),
    "away": (replace(READY, state=None), "the robot is not connected"),
    "disarmed": (
        replace(READY, state=state(mode="disarmed", armed=False)),
        "the robot is not armed",
    ),
    "stopped": (
        replace(READY, state=state(mode="stopped", armed=False)),
        "the robot is stopped: reset it, then arm it",
    ),
    "faulted": (
        replace(READY, state=state(mode="faulted", armed=False, fault="too hot")),
        "the robot has a fault: too hot",
    ),
    "holding": (
        replace(READY, state=state(mode="holding", reason="no commands")),
        "the robot holds still: no commands: show no gesture for half a second, then a new one",
    ),
    "stale": (replace(READY, stale="the frame is too old"), "the frame is too old"),
}


@pytest.mark.parametrize("what", OBSTACLES)
def test_an_obstacle_is_told_and_moves_nothing(driver: Driver, what: str) -> None:
    situation, reason = OBSTACLES[what]
    decision = driver.decide("forward", 1, situation)
    assert decision.reason == reason
    assert decision.command is None or decision.command.action is None
    # Nor does it once the obstacle is gone, until the gesture is shown again.
    decision = driver.decide("forward", 2, READY)
    assert decision.reason is not None
    assert "show it again" in decision.reason
    assert decision.command is not None
    assert decision.command.action is None
    assert decision.command.gesture == "forward"
    let_go(driver)
    decision = driver.decide("forward", 4, at(2.6))
    assert decision.reason is None
    assert decision.command is not None
    assert decision.command.action == ACTIONS["forward"]


def test_an_obstacle_in_the_middle_ends_the_showing(driver: Driver) -> None:
    driver.decide("forward", 1, READY)
    driver.decide("forward", 2, replace(READY, state=state(mode="holding")))
    decision = driver.decide("forward", 3, READY)
    assert decision.command is not None
    assert decision.command.action is None


def test_one_late_frame_does_not_end_the_showing(driver: Driver) -> None:
    driver.decide("forward", 1, READY)
    assert driver.decide("forward", 2, replace(READY, stale="late")).command is None
    decision = driver.decide("forward", 3, READY)
    assert decision.command is not None
    assert decision.command.action == ACTIONS["forward"]


def test_nothing_shown_needs_no_reason(driver: Driver) -> None:
    decision = driver.decide(None, 1, replace(READY, lease=None))
    assert (decision.command, decision.stop, decision.reason) == (None, None, None)


@pytest.mark.parametrize(
    "situation",
    [
        READY,
        replace(READY, lease=None),
        replace(READY, state=None),
        replace(READY, stale="late"),
        replace(READY, state=state(mode="moving")),
    ],
)
def test_a_stop_gesture_stops_whoever_shows_it_once(driver: Driver, situation: Situation) -> None:
    stop = driver.decide("stop", 1, situation).stop
    assert stop is not None
    assert (stop.category, stop.source) == ("S1", "me")
    assert driver.decide("stop", 2, situation).stop is None
    driver.decide(None, 3, situation)
    assert driver.decide("stop", 4, situation).stop is not None


def test_a_stop_is_not_sent_as_an_action(driver: Driver) -> None:
    command = driver.decide("stop", 1, READY).command
    assert command is not None
    assert command.action is None


def test_a_gesture_that_was_deleted_moves_nothing(driver: Driver) -> None:
    decision = driver.decide("gone", 1, READY)
    assert decision.reason == "the gesture 'gone' is no longer enrolled"
    assert decision.command is not None
    assert decision.command.action is None


@pytest.mark.parametrize("gesture", ["turn", "wave"])
def test_an_action_that_adds_up_is_not_repeated_while_the_hand_stays_up(
    driver: Driver, gesture: str
) -> None:
    first = driver.decide(gesture, 1, at(0.0)).command
    assert first is not None and first.action is not None
    let_go(driver, 0.1, 0.3)  # the hand was seen badly
    again = driver.decide(gesture, 2, at(0.5))
    assert again.command is not None
    assert (again.command.hold, again.command.action) == (first.hold, None)
    assert again.reason == (
        "this was done already: show no gesture for half a second, then a new one"
    )
    driver.end()  # frames did not come for seconds
    driver.decide(None, 3, at(5.0))
    assert driver.decide(gesture, 4, at(5.1)).reason == again.reason
    let_go(driver, 5.2)
    anew = driver.decide(gesture, 5, at(5.8)).command
    assert anew is not None
    assert anew.hold > first.hold
    assert anew.action == ACTIONS[gesture]


def test_another_gesture_in_between_makes_a_new_showing(driver: Driver) -> None:
    driver.decide("turn", 1, at(0.0))
    driver.decide("forward", 2, at(0.1))
    command = driver.decide("turn", 3, at(0.2)).command
    assert command is not None
    assert command.action == ACTIONS["turn"]


def test_a_jog_goes_on_after_a_flicker(driver: Driver) -> None:
    driver.decide("forward", 1, at(0.0))
    driver.decide(None, 2, at(0.1))
    decision = driver.decide("forward", 3, at(0.2))
    assert decision.reason is None
    assert decision.command is not None
    assert decision.command.action == ACTIONS["forward"]


def test_a_flicker_does_not_make_a_barred_showing_a_new_one(driver: Driver) -> None:
    driver.decide("forward", 1, replace(READY, state=state(mode="disarmed", armed=False)))
    driver.decide(None, 2, at(0.1))
    decision = driver.decide("forward", 3, at(0.2))
    assert decision.reason is not None
    assert "show it again" in decision.reason
    assert decision.command is not None
    assert decision.command.action is None


def test_a_hand_that_was_up_when_the_gestures_changed_begins_nothing(driver: Driver) -> None:
    let_go(driver, 0.0, 2.0)  # a hand that nobody knows
    driver.gestures_changed()
    driver.decide(None, 1, at(2.1))
    decision = driver.decide("forward", 2, at(2.2))
    assert decision.reason == (
        "the gestures changed while a hand was up: "
        "show no gesture for half a second, then a new one"
    )
    assert decision.command is not None
    assert decision.command.action is None
    let_go(driver, 2.3)
    assert driver.decide("forward", 3, at(2.9)).reason is None


def test_a_jog_under_way_goes_on_when_other_gestures_change(driver: Driver) -> None:
    driver.decide("forward", 1, at(0.0))
    driver.gestures_changed()
    decision = driver.decide("forward", 2, at(0.1))
    assert decision.command is not None
    assert decision.command.action == ACTIONS["forward"]


def test_a_jog_under_way_ends_when_the_gestures_become_another_persons(driver: Driver) -> None:
    driver.decide("forward", 1, at(0.0))
    driver.gestures_changed(all_of_them=True)
    for frame, seconds, gesture in ((2, 0.1, "forward"), (4, 0.2, "forward"), (6, 0.3, "open")):
        decision = driver.decide(gesture, frame, at(seconds))
        assert decision.command is not None
        assert decision.command.action is None
        assert "the gestures changed while a hand was up" in str(decision.reason)
        driver.decide(None, frame + 1, at(seconds + 0.05))
    let_go(driver, 0.4)
    assert driver.decide("forward", 9, at(1.0)).reason is None


@pytest.mark.parametrize("cause", ["no_hand", "unknown_hand", "two_hands", "low_margin"])
def test_why_no_gesture_is_held_any_more_is_told_to_the_robot(driver: Driver, cause: Cause) -> None:
    held = driver.decide("forward", 1, READY, cause=cause)
    assert held.command is not None
    # One bad frame ends nothing while the gesture is held.
    assert (held.command.action, held.command.doubt) == (ACTIONS["forward"], None)
    let_go = driver.decide(None, 2, READY, cause=cause)
    assert let_go.command is not None
    assert (let_go.command.action, let_go.command.doubt) == (None, cause)
    assert let_go.doubt == cause


@pytest.mark.parametrize("cause", ["moving", "waiting", "nothing_enrolled", None])
def test_a_hand_on_its_way_is_no_doubt(driver: Driver, cause: Cause | None) -> None:
    command = driver.decide(None, 1, READY, cause=cause).command
    assert command is not None
    assert command.doubt is None


BLIND = {
    "frozen": (READY, True, FROZEN),
    "stale_picture": (replace(READY, unseen="it is 2 s old"), False, "it is 2 s old"),
}


@pytest.mark.parametrize("doubt", BLIND)
def test_a_held_gesture_moves_nothing_while_a_picture_stands(driver: Driver, doubt: str) -> None:
    situation, frozen, reason = BLIND[doubt]
    driver.decide("forward", 1, READY)
    decision = driver.decide("forward", 2, situation, frozen=frozen)
    command = decision.command
    assert command is not None
    assert (command.action, command.gesture, command.doubt) == (None, "forward", doubt)
    assert (decision.reason, command.reason) == (reason, reason)
    # Nor once the picture lives again, until the gesture is shown again.
    again = driver.decide("forward", 3, READY).command
    assert again is not None
    assert (again.action, again.doubt) == (None, None)
    # A picture without a gesture that stands still threatens nobody.
    none = driver.decide(None, 4, situation, frozen=frozen).command
    assert none is not None
    assert none.doubt is None


def test_a_stop_counts_with_a_frozen_picture_too(driver: Driver) -> None:
    assert driver.decide("stop", 1, READY, frozen=True).stop is not None


def test_the_wanted_speed_goes_along(driver: Driver) -> None:
    command = driver.decide("forward", 1, replace(READY, scale=0.2)).command
    assert command is not None
    assert command.scale == 0.2


def test_a_long_fault_does_not_break_the_command(driver: Driver) -> None:
    faulted = replace(READY, state=state(mode="faulted", armed=False, fault="x" * 1000))
    command = driver.decide("forward", 1, faulted).command
    assert command is not None
    assert command.reason is not None


@pytest.mark.parametrize(
    ("sequence", "than", "expected"),
    [(1, None, True), (2, 1, True), (1, 1, False), (1, 2, False), (0, 2**32 - 1, True),
     (2**32 - 1, 0, False)],
)  # fmt: skip
def test_newer(sequence: int, than: int | None, expected: bool) -> None:
    assert newer(sequence, than) is expected
