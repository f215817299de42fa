"""From held keys to commands."""

from dataclasses import replace

import pytest

from app.errors import MessageRefused
from app.gateway.drive import Driver, Lease, Situation
from app.gateway.held_keys import TOO_EARLY, HeldKeys
from app.gateway.messages import Jog, parse_client_message
from app.gateway.numbers import Counter
from app.link.actions import JogCartesian
from tests.gateway.test_drive import state

FORWARD = JogCartesian(linear=(0.1, 0.0, 0.0))
READY = Situation({}, Lease(7), state())
STANDING = replace(READY, state=state(mode="disarmed", armed=False))


def jog(hold: int, *, held: bool = True, scale: float = 1.0) -> Jog:
    return Jog(type="jog", hold=hold, action=FORWARD if held else None, scale=scale, tick=1)


@pytest.fixture
def keys() -> HeldKeys:
    return HeldKeys(Counter(), Counter())


def test_nothing_held_is_a_command_too(keys: HeldKeys) -> None:
    decision = keys.decide(jog(0, held=False), READY)
    assert decision.reason is None
    command = decision.command
    assert command is not None
    assert (command.action, command.gesture, command.epoch, command.tick) == (None, None, 7, 1234)


@pytest.mark.parametrize("held", [True, False])
def test_a_command_lives_as_long_as_is_left(keys: HeldKeys, held: bool) -> None:
    late = replace(READY, life_ms=70)
    by_key = keys.decide(jog(1, held=held), late).command
    by_hand = Driver("me", Counter(), Counter()).decide(None, 1, late).command
    assert by_key is not None and by_key.ttl_ms == 70
    assert by_hand is not None and by_hand.ttl_ms == 70


def test_every_press_has_a_number_of_its_own(keys: HeldKeys) -> None:
    commands = [keys.decide(jog(hold), READY).command for hold in (1, 1, 2)]
    commands.append(keys.decide(jog(2, held=False), READY).command)
    commands.append(keys.decide(jog(2), READY).command)  # a client that does not count
    holds = [command.hold for command in commands if command is not None]
    assert holds[0] == holds[1] < holds[2] < holds[4]
    numbers = [command.sequence for command in commands if command is not None]
    assert numbers == sorted(set(numbers))
    assert [command.action for command in commands if command is not None] == [
        FORWARD, FORWARD, FORWARD, None, FORWARD,
    ]  # fmt: skip


def test_a_press_from_before_the_robot_was_ready_moves_nothing(keys: HeldKeys) -> None:
    first = keys.decide(jog(1), STANDING)
    assert first.reason == "the robot is not armed"
    assert first.command is not None and first.command.action is None
    still = keys.decide(jog(1), READY)
    assert still.reason == TOO_EARLY
    assert still.command is not None and still.command.action is None
    assert still.command.gesture is not None  # the node waits until it is let go
    anew = keys.decide(jog(2), READY)
    assert anew.command is not None and anew.command.action == FORWARD


def test_a_press_during_which_the_robot_was_disarmed_is_over(keys: HeldKeys) -> None:
    keys.decide(jog(1), READY)
    keys.decide(jog(1), STANDING)
    assert keys.decide(jog(1), READY).reason == TOO_EARLY


def test_without_control_or_in_time_nothing_is_commanded(keys: HeldKeys) -> None:
    nobody = keys.decide(jog(1), replace(READY, lease=None))
    assert nobody.command is None
    assert nobody.reason == "you do not have control: me drives"
    late = keys.decide(jog(2), replace(READY, stale="too old"))
    assert (late.command, late.reason) == (None, "too old")


def test_who_sees_an_old_picture_holds_still(keys: HeldKeys) -> None:
    keys.decide(jog(1), READY)
    blind = keys.decide(jog(1), replace(READY, unseen="it is old"))
    assert blind.command is not None
    assert (blind.command.action, blind.command.doubt) == (None, "stale_picture")
    assert keys.decide(jog(2, held=False), replace(READY, unseen="it is old")).reason is None


def test_a_stick_goes_on_a_part_of_the_sessions_speed(keys: HeldKeys) -> None:
    half = replace(READY, scale=0.5)
    commands = [keys.decide(jog(1, scale=scale), half).command for scale in (1.0, 0.5, 0.05)]
    scales = [command.scale for command in commands if command is not None]
    assert scales == [0.5, 0.25, 0.05]


def test_gestures_move_nothing_while_keys_drive() -> None:
    driver = Driver("me", Counter(), Counter())
    situation = replace(READY, actions={"forward": FORWARD}, by_keys=True)
    decision = driver.decide("forward", 1, situation)
    assert decision.command is None
    assert decision.reason == "you drive by keys: gestures move nothing meanwhile"


@pytest.mark.parametrize(
    "text",
    [
        '{"type":"jog","hold":1,"action":{"type":"stop"},"tick":1}',
        '{"type":"jog","hold":1,"tick":1}',
        '{"type":"jog","hold":-1,"action":null,"tick":1}',
        '{"type":"jog","hold":1,"action":null,"tick":0}',
        '{"type":"jog","hold":1,"action":null,"scale":2,"tick":1}',
    ],
)
def test_what_is_no_held_key_is_refused(text: str) -> None:
    with pytest.raises(MessageRefused):
        parse_client_message(text)
