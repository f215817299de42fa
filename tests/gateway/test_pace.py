import pytest

from app.gateway.pace import Pace


def test_a_burst_passes_and_then_the_rate_holds() -> None:
    pace = Pace(rate=100, burst=5)
    assert [pace.wait_s(10.0) for _ in range(5)] == [0.0] * 5
    assert pace.wait_s(10.0) == pytest.approx(0.01)
    assert pace.wait_s(10.0) == pytest.approx(0.02)


def test_who_keeps_to_the_rate_never_waits() -> None:
    pace = Pace(rate=100, burst=5)
    assert max(pace.wait_s(number / 99) for number in range(1000)) == 0.0


def test_a_pause_gives_no_more_than_one_burst() -> None:
    pace = Pace(rate=100, burst=5)
    pace.wait_s(0.0)
    assert [pace.wait_s(1000.0) for _ in range(6)][4:] == [0.0, pytest.approx(0.01)]


def test_a_flood_is_read_at_the_rate() -> None:
    pace, now, read = Pace(rate=100, burst=5), 0.0, 0
    while now < 10:
        read += 1
        now += pace.wait_s(now)
    assert read == pytest.approx(1005, abs=2)
