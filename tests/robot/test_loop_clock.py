import time

from app.robot.loop_clock import LoopClock

TRIES = 5
"""In each of them something else may want the processor just then."""


def test_it_keeps_its_rate_and_says_how_late_it_was() -> None:
    clock = LoopClock(0.005)
    began = time.monotonic()
    for _ in range(40):
        clock.wait()
    assert time.monotonic() - began >= 0.199
    assert clock.state().rate_hz > 20


def test_a_short_delay_is_caught_up_and_counted() -> None:
    waited = []
    for _ in range(TRIES):
        clock = LoopClock(0.005)
        clock.wait()
        time.sleep(0.03)
        began = time.monotonic()
        clock.wait()
        waited.append(time.monotonic() - began)
        assert clock.state().late_max_ms >= 20
    assert min(waited) < 0.02


def test_a_long_delay_is_let_go() -> None:
    waited = []
    for _ in range(TRIES):
        clock = LoopClock(0.005)
        time.sleep(0.2)
        clock.wait()
        began = time.monotonic()
        clock.wait()
        waited.append(time.monotonic() - began)
    assert max(waited) >= 0.003


def test_before_the_first_cycles_there_is_nothing_to_say() -> None:
    assert LoopClock(0.005).state().rate_hz == 0.0


def test_cycles_that_begin_late_or_never_are_counted() -> None:
    clock = LoopClock(0.005)
    clock.wait()
    clock.wait()
    before = clock.state()
    time.sleep(0.2)  # so far behind that the loop lets these cycles go
    clock.wait()
    after = clock.state()
    assert after.late - before.late >= 30
    assert after.cycles - before.cycles >= after.late - before.late
