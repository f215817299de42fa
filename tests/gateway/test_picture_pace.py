"""How much one viewer is sent, on a link that is played."""

import asyncio
import json

import pytest

from app.gateway import picture_pace
from app.gateway.picture_pace import LEVELS, STEADY_S, PicturePace, Shown, acknowledged

WAY_S = 0.15


class Link:
    """Pictures one after another over a link; each is acknowledged ``WAY_S`` and a queue later."""

    def __init__(self) -> None:
        self.pace = PicturePace()
        self.now = 100.0
        self.sequence = 0

    def show(self, queue_s: float = 0.0, times: int = 1) -> None:
        for _ in range(times):
            self.sequence += 1
            self.pace.sent(self.sequence, self.now)
            self.now += WAY_S + queue_s
            self.pace.acknowledge(Shown(self.sequence), self.now)

    def show_for(self, seconds: float, queue_s: float = 0.0) -> None:
        until = self.now + seconds
        while self.now < until:
            self.show(queue_s)

    def burst(self, queue_s: float) -> None:
        """Four that are under way together."""
        start, sequences = self.now, range(self.sequence + 1, self.sequence + 5)
        for sequence in sequences:
            self.pace.sent(sequence, start)
        for sequence in sequences:
            self.now = start + WAY_S + queue_s + sequence / 1e5
            self.pace.acknowledge(Shown(sequence), self.now)
        self.sequence += 4


def test_levels_ask_less_and_less_of_the_link() -> None:
    load = [each.rate_hz * each.scale**2 * (each.quality or 100) for each in LEVELS]
    assert load == sorted(set(load), reverse=True)
    assert all(each.under_way >= 1 for each in LEVELS)


def test_a_long_way_without_a_queue_costs_nothing() -> None:
    link = Link()
    link.show(times=200)
    assert link.pace.level == 0


def test_one_late_acknowledgement_changes_nothing_and_a_queue_lowers_the_level() -> None:
    link = Link()
    link.show(times=20)
    link.show(queue_s=0.5)
    link.show()
    assert link.pace.level == 0
    link.show(queue_s=0.2, times=2)
    assert link.pace.level == 1
    link.show(queue_s=0.2, times=100)
    assert link.pace.level == len(LEVELS) - 1


def test_pictures_under_way_together_are_held_up_by_one_thing() -> None:
    link = Link()
    link.show(times=5)
    link.burst(0.3)
    assert link.pace.level == 0
    link.show()
    link.burst(0.3)
    link.burst(0.3)
    # Those sent before the change do not judge the new level.
    assert link.pace.level == 1


def test_one_that_is_held_up_now_and_then_is_no_reason_to_stay_low() -> None:
    link = Link()
    link.show(times=5)
    link.show(queue_s=0.2, times=2)
    for _ in range(2):
        link.show(times=19)
        link.show(queue_s=0.2)
    assert link.pace.level == 0
    link.show(queue_s=0.2, times=2)
    for _ in range(20):
        link.show(times=3)
        link.show(queue_s=0.06)
    assert link.pace.level == 1


def test_it_goes_up_a_step_at_a_time_once_the_queue_is_gone() -> None:
    link = Link()
    link.show(times=5)
    link.show(queue_s=0.2, times=4)
    assert link.pace.level == 2
    link.show_for(STEADY_S - 0.5)
    assert link.pace.level == 2
    link.show_for(1)
    assert link.pace.level == 1
    link.show_for(STEADY_S + 0.5)
    assert link.pace.level == 0


def test_a_level_that_proves_too_much_is_tried_ever_more_rarely() -> None:
    link = Link()
    link.show(times=5)
    link.show(queue_s=0.2, times=2)
    waits = []
    for _ in range(3):
        began = link.now
        while link.pace.level:
            link.show()
        waits.append(link.now - began)
        # What is only being tried is given up at the first that is late; what was left is not.
        link.show(queue_s=0.2)
        assert link.pace.level == 1
        link.show(queue_s=0.2)
        assert link.pace.level == 1
        link.show()
    assert waits[1] > 1.5 * waits[0]
    assert waits[2] > 1.5 * waits[1]


def test_a_way_that_became_longer_is_known_after_a_minute() -> None:
    link = Link()
    link.show(times=20)
    link.show_for(0.5 * picture_pace.WINDOW_S, queue_s=0.3)  # another way, not a queue
    assert link.pace.level == len(LEVELS) - 1
    link.show_for(2 * picture_pace.WINDOW_S + STEADY_S, queue_s=0.3)
    assert link.pace.level < len(LEVELS) - 1


async def test_only_so_many_are_under_way_and_an_acknowledgement_answers_for_those_before() -> None:
    pace = PicturePace()
    loop = asyncio.get_running_loop()
    for sequence in range(LEVELS[0].under_way):
        pace.sent(sequence, loop.time())
    turn = asyncio.create_task(pace.turn())
    for stranger in (77, -1, 2**40):
        pace.acknowledge(Shown(stranger), loop.time())
    done, _ = await asyncio.wait((turn,), timeout=0.2)
    assert not done
    pace.acknowledge(Shown(LEVELS[0].under_way - 1), loop.time())
    await asyncio.wait_for(turn, 10)
    for sequence in range(10, 9 + LEVELS[0].under_way):
        pace.sent(sequence, loop.time())
        await asyncio.wait_for(pace.turn(), 10)


async def test_a_camera_that_starts_anew_leaves_nothing_under_way() -> None:
    pace = PicturePace()
    loop = asyncio.get_running_loop()
    for sequence in (5000, 5001, 1, 2):
        pace.sent(sequence, loop.time())
    pace.acknowledge(Shown(2), loop.time())
    for sequence in (3, 4, 5):
        pace.sent(sequence, loop.time())
    await asyncio.wait_for(pace.turn(), 10)


@pytest.mark.parametrize(
    "text",
    [
        None,
        "",
        "hello",
        "[]",
        "7",
        "null",
        '{"type":"shown"}',
        '{"type":"shown","seq":"7"}',
        '{"type":"shown","seq":7.0}',
        '{"type":"shown","seq":true}',
        '{"type":"shown","seq":null}',
        '{"type":"seen","seq":7}',
        '{"seq":7}',
        '{"type":"shown","seq":7,"most":"15"}',
        '{"type":"shown","seq":7,"most":null}',
        "[" * 64,
        json.dumps({"type": "shown", "seq": 7, "more": "x" * 64}),
    ],
)
def test_what_is_no_acknowledgement_is_none(text: str | None) -> None:
    assert acknowledged(text) is None


@pytest.mark.parametrize(
    ("more", "wanted"),
    [
        ("", 30), (',"most":15', 15), (',"most":7.5', 7.5), (',"most":0', 1), (',"most":-3', 1),
        (',"most":99', 30), (',"most":1e999', 30), (',"most":NaN', 30),
    ],
)  # fmt: skip
def test_an_acknowledgement_is_read(more: str, wanted: float) -> None:
    assert acknowledged(f'{{"type":"shown","seq":4294967295{more}}}') == (4294967295, wanted)


async def test_a_viewer_that_wants_fewer_gets_fewer() -> None:
    pace = PicturePace()
    now = asyncio.get_running_loop().time()
    sent = []
    for sequence in range(60):  # a camera's pictures, 30 a second
        now += 1 / 30
        if now >= pace.due:
            pace.sent(sequence, now)
            pace.acknowledge(Shown(sequence, 15 if sequence < 30 else 30), now)
            sent.append(sequence)
    assert 14 <= sum(sequence < 30 for sequence in sent) <= 17
    assert 28 <= sum(sequence >= 30 for sequence in sent) <= 30
