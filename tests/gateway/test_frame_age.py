"""How old a frame is: the arithmetic of the promise, on clocks that no test waits for."""

from collections.abc import Iterable, Iterator

import pytest

from app.gateway.frame_age import DRIFT, SPARE_MS, WAY_MS, Age, FrameAge
from app.link.messages import COMMAND_TTL_MS
from app.robot.controller import DT, RAMP_S

PROMISE_MS = 500
RAMP_MS = (RAMP_S + DT) * 1000
FAR = 987_654.0
"""ms; the sender's clock minus ours: nobody knows it."""


def test_the_newest_tick_seen_bounds_the_age() -> None:
    age = FrameAge(500)
    assert age(10_000, 5.0, 10_020) == Age(10, COMMAND_TTL_MS)
    assert age(10_020, 505.0, 10_520).stale is None
    told = age(10_000, 506.0, 10_521).stale
    assert told == (
        "the frame is too old to move the robot: its sender had seen nothing newer than 521 ms "
        "ago, at most 500 ms are allowed"
    )
    ahead = age(10_602, 7.0, 10_601).stale
    assert ahead == "the frame names a server tick that has not come yet"


def test_without_a_tick_a_burst_after_a_stall_is_too_old() -> None:
    age = FrameAge(500)
    for count in range(30):
        assert age(0, 1000.0 + 33 * count, 70_000 + 33 * count + count % 5).stale is None
    burst = [age(0, 2000.0 + 33 * count, 73_000) for count in range(60)]
    assert burst[0].stale == (
        "the frame is too old to move the robot: it came 2000 ms later than others did, at most "
        "280 ms are allowed"
    )
    prompt = [each.stale is None for each in burst].index(True)
    assert 2000 - 33 * prompt < COMMAND_TTL_MS + SPARE_MS, "captured less than a life ago"
    assert 2000 - 33 * (prompt - 1) >= COMMAND_TTL_MS + SPARE_MS


def test_a_frame_that_tells_no_time_at_all_moves_nothing() -> None:
    age = FrameAge(500)
    age(0, 0.0, 100)
    told = age(0, 0.0, 133).stale
    assert told is not None and told.startswith("the frame's age is not known")


class Way:
    """A sender, and what is between: frames every 33 ms; ticks come down every 50 ms."""

    def __init__(self, up_ms: float, down_ms: float, *, drift: float = 0.0) -> None:
        self.age = FrameAge(500)
        self.up, self.down, self.drift = up_ms, down_ms, drift
        self.now = 100_000.0

    def send(self, queue_ms: float = 0.0, *, clock: bool = True) -> tuple[float, Age]:
        """One frame; returns what it was under way for in truth, ms, and what is known."""
        self.now += 33.0
        seen = (self.now - self.down) // 50 * 50
        arrives = self.now + self.up + queue_ms
        captured = FAR + self.now * (1 + self.drift) if clock else 0.0
        return self.up + queue_ms, self.age(int(seen), captured, round(arrives))

    def settle(self, *, clock: bool = True) -> None:
        for _ in range(60):
            self.send(clock=clock)


def queue_that_grows() -> Iterator[float]:
    """A link that carries less than is sent: what waits grows up to 400 ms, and drains."""
    yield from (25.0 * step for step in range(16))
    yield from (400.0 - 40.0 * step for step in range(11))


def stands_after_ms(true_ms: float, age: Age) -> float:
    """From when a frame was sent to standstill, if it was the last; 0: it moves nothing."""
    return 0.0 if age.stale else true_ms + age.life_ms + RAMP_MS


@pytest.mark.parametrize(("up", "down"), [(1, 1), (25, 25), (50, 50), (75, 75)])
def test_the_arm_stands_500_ms_after_the_last_frame_was_sent_however_long_it_waited(
    up: float, down: float
) -> None:
    way = Way(up, down)
    way.settle()
    for queue in queue_that_grows():
        assert stands_after_ms(*way.send(queue)) <= PROMISE_MS + max(0.0, up - WAY_MS)


@pytest.mark.parametrize(("up", "down"), [(90, 10), (10, 90)])
def test_a_way_up_that_is_slower_than_down_costs_half_the_difference(
    up: float, down: float
) -> None:
    way = Way(up, down)
    way.settle()
    for queue in queue_that_grows():
        assert stands_after_ms(*way.send(queue)) <= PROMISE_MS + max(0.0, (up - down) / 2)


@pytest.mark.parametrize(("up", "down"), [(0, 0), (25, 25), (50, 50), (75, 75), (20, 80)])
def test_who_is_far_away_drives_as_before(up: float, down: float) -> None:
    """Nearly all that a command lives is left, up to 150 ms there and back and beyond."""
    way = Way(up, down)
    way.settle()
    for _ in range(60):
        true, age = way.send()
        assert age.stale is None
        assert age.life_ms >= COMMAND_TTL_MS - 22
        assert age.known_ms <= max(true, (up + down) / 2) + 2


def test_a_queue_on_the_way_down_makes_no_frame_old() -> None:
    way = Way(20, 20)
    way.settle()
    way.down = 300
    _, age = way.send()
    assert age.known_ms <= 22


@pytest.mark.parametrize("drift", [-1e-4, 1e-4])
def test_clocks_that_run_apart_make_no_frame_old(drift: float) -> None:
    assert abs(drift) < DRIFT
    way = Way(10, 10, drift=drift)
    way.settle()
    for _ in range(20_000):  # eleven minutes
        way.now += 0.0
        _, age = way.send()
    assert abs(age.known_ms - 10) <= 3


def test_a_queue_that_stands_for_a_minute_is_still_known() -> None:
    way = Way(10, 10)
    way.settle()
    for _ in range(1800):
        true, age = way.send(200.0)
    assert true - age.known_ms <= 60_000 * DRIFT + 2


def test_a_capture_clock_that_stood_still_makes_nobody_old_for_long() -> None:
    way = Way(10, 10)
    way.settle()
    way.now += 3_600_000.0
    held: Iterable[Age] = (
        way.age(int(way.now - 40 + 33 * n), FAR + n, round(way.now + 33 * n)) for n in range(1, 4)
    )
    assert all(age.stale is None and age.known_ms <= 40 for age in held)


def test_without_a_clock_of_the_sender_all_that_is_not_known_counts_as_age() -> None:
    way = Way(20, 20)
    way.settle(clock=False)
    for queue in queue_that_grows():
        true, age = way.send(queue, clock=False)
        assert stands_after_ms(true, age) <= PROMISE_MS
    true, age = way.send(clock=False)
    assert age.life_ms >= 250 - 90
