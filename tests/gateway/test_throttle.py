"""Guessing is slowed; nobody who is signed in is."""

import pytest

from app.gateway.throttle import ALL_TRIES, MAX_KEPT, PAUSE_S, Throttle, TooManyGuesses


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def throttle(clock: Clock) -> Throttle:
    return Throttle(clock)


def fail(throttle: Throttle, address: str, times: int) -> None:
    """So many different wrong tokens."""
    for number in range(times):
        throttle.check(address, f"wrong {number}")
        throttle.failed(address, f"wrong {number}")


def test_the_sixth_guess_is_refused(throttle: Throttle) -> None:
    fail(throttle, "10.0.0.1", 5)
    with pytest.raises(TooManyGuesses, match="wait 60 s") as refused:
        throttle.check("10.0.0.1", "another")
    assert refused.value.detail == {"retry_after_s": 60}
    throttle.check("10.0.0.2", "another")


def test_the_same_wrong_token_again_is_no_guess(throttle: Throttle) -> None:
    for _ in range(100):
        throttle.check("10.0.0.1", "old")
        throttle.failed("10.0.0.1", "old")
    fail(throttle, "10.0.0.1", 4)
    with pytest.raises(TooManyGuesses):
        throttle.check("10.0.0.1", "another")
    throttle.check("10.0.0.1", "old")


def test_a_pause_forgets_and_guessing_on_does_not(throttle: Throttle, clock: Clock) -> None:
    fail(throttle, "10.0.0.1", 5)
    for _ in range(10):
        clock.now += PAUSE_S - 1
        with pytest.raises(TooManyGuesses):
            throttle.check("10.0.0.1", "another")
    clock.now += PAUSE_S
    fail(throttle, "10.0.0.1", 5)


def test_all_addresses_together_have_a_limit(throttle: Throttle, clock: Clock) -> None:
    for number in range(ALL_TRIES):
        fail(throttle, f"10.0.{number // 250}.{number % 250}", 1)
    with pytest.raises(TooManyGuesses):
        throttle.check("192.168.0.1", "another")
    clock.now += 1.0
    throttle.check("192.168.0.1", "another")


def test_one_customer_of_ipv6_is_one_address(throttle: Throttle) -> None:
    for number in range(5):
        throttle.failed(f"2001:db8:1:2::{number + 1:x}", f"wrong {number}")
    with pytest.raises(TooManyGuesses):
        throttle.check("2001:db8:1:2:ffff::1", "another")
    throttle.check("2001:db8:1:3::1", "another")
    fail(throttle, "10.0.0.1", 5)
    with pytest.raises(TooManyGuesses):
        throttle.check("::ffff:10.0.0.1", "another")


def test_what_was_right_is_known_from_there_alone(throttle: Throttle) -> None:
    throttle.succeeded("10.0.0.1", "digest")
    assert throttle.knows("10.0.0.1", "digest")
    assert not throttle.knows("10.0.0.2", "digest")
    assert not throttle.knows("10.0.0.1", "another")


def test_memory_is_bounded(throttle: Throttle) -> None:
    for number in range(MAX_KEPT + 10):
        throttle.failed(f"10.{number >> 16}.{number >> 8 & 255}.{number & 255}", "wrong")
        throttle.succeeded("10.0.0.1", str(number))
    assert len(throttle._addresses) == MAX_KEPT
    assert len(throttle._known) == MAX_KEPT
