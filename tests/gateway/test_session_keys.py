"""Driving by keys within one session."""

import json
import time
from typing import Any

from app.gateway.drive import Lease, Situation
from app.gateway.frame_age import Age
from app.gateway.held_keys import HeldKeys
from app.gateway.messages import Jog
from app.gateway.metrics import Metrics
from app.gateway.numbers import Counter, tick_ms
from app.gateway.outbox import Outbox
from app.gateway.session_keys import KEYS_S, SessionKeys
from app.link.actions import JogCartesian
from app.link.messages import COMMAND_TTL_MS, Command
from tests.gateway.test_drive import state

UP = JogCartesian(linear=(0.0, 0.0, 0.1))


class Robot:
    """Keeps what it is sent."""

    def __init__(self) -> None:
        self.commands: list[Command] = []

    def send(self, command: Command) -> None:
        self.commands.append(command)


class NoDiary:
    """Notes nothing."""

    def jog(self, jog: Jog, decision: object) -> None:
        pass


class Keys(SessionKeys):
    """Keys of a session that holds the lease, or does not."""

    def __init__(self) -> None:
        self.robot, self.outbox, self.lease = Robot(), Outbox(), True
        held = HeldKeys(Counter(), Counter())
        diary: Any = NoDiary()
        robot: Any = self.robot
        super().__init__(held, 500, robot, self.outbox, Metrics(), diary)

    def press(self, hold: int, tick: int | None = None) -> None:
        jog = Jog(type="jog", hold=hold, action=UP, tick=tick_ms() if tick is None else tick)
        self.take(jog, self.situate)

    def situate(self, now: float, age: Age) -> Situation:
        return Situation(
            {},
            Lease(7) if self.lease else None,
            state(),
            stale=age.stale,
            life_ms=age.life_ms,
            at=now,
        )

    async def told(self) -> list[tuple[int, str | None]]:
        said = []
        while len(self.outbox):
            message = json.loads(await self.outbox.get() or "")
            assert message.pop("type") == "jog"
            said.append((message["hold"], message["reason"]))
        return said


async def test_a_press_is_commanded_and_told_once() -> None:
    keys = Keys()
    for _ in range(3):
        keys.press(1)
    assert [command.action for command in keys.robot.commands] == [UP] * 3
    assert await keys.told() == [(1, None)]


async def test_it_is_told_when_nothing_comes_of_a_press_and_when_that_changes() -> None:
    keys = Keys()
    keys.lease = False
    keys.press(1)
    ((hold, refused),) = await keys.told()
    assert hold == 1
    assert refused is not None and "control" in refused
    keys.press(1)
    assert await keys.told() == []
    keys.lease = True
    keys.press(2)
    assert await keys.told() == [(2, None)]
    assert [command.action for command in keys.robot.commands] == [UP]


async def test_an_old_press_moves_nothing() -> None:
    keys = Keys()
    keys.press(1, tick=max(1, tick_ms() - 5000))
    assert keys.robot.commands == []
    ((_, reason),) = await keys.told()
    assert reason is not None and reason.startswith("the key press is too old to move the robot")


async def test_what_a_press_was_under_way_for_is_taken_off_the_life_of_its_command() -> None:
    keys = Keys()
    mine = 5_000_000.0  # a clock of the client's own

    def press(late_ms: int) -> int | None:
        now = tick_ms()
        seen, at = max(1, now - late_ms - 10), mine + now - late_ms
        before = len(keys.robot.commands)
        keys.take(Jog(type="jog", hold=1, action=UP, tick=seen, at=at), keys.situate)
        sent = keys.robot.commands[before:]
        return sent[0].ttl_ms if sent else None

    prompt = press(0)
    assert prompt is not None and 230 <= prompt <= COMMAND_TTL_MS
    late = press(150)
    assert late is not None and late <= 130
    assert press(300) is None
    assert (await keys.told())[-1][1] is not None


def test_a_session_drives_by_keys_for_a_while_after_the_last_message() -> None:
    keys = Keys()
    assert not keys.drive(time.monotonic())
    keys.press(1)
    now = time.monotonic()
    assert keys.drive(now)
    assert not keys.drive(now + KEYS_S)
