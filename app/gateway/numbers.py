"""Clocks and counters of the gateway."""

import itertools
import time


def tick_ms() -> int:
    """The server tick: ms on this machine's monotonic clock."""
    return time.monotonic_ns() // 1_000_000


class Counter:
    """Rising numbers, each given once. Safe to use from any thread.

    Starts at the server tick, so that the numbers keep rising when the gateway starts again
    beside a robot node that kept running.
    """

    def __init__(self) -> None:
        self._numbers = itertools.count(tick_ms())

    def next(self) -> int:
        """The next number."""
        return next(self._numbers)


def newer(sequence: int, than: int | None) -> bool:
    """Whether a 32-bit sequence number comes after another, across the wrap at 2**32 (RFC 1982)."""
    return than is None or 0 < ((sequence - than) & 0xFFFFFFFF) < 0x80000000
