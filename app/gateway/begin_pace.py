"""Connections begin in turn: a TLS handshake or a first request costs, and anybody may ask."""

import asyncio
import time
from collections import OrderedDict, deque
from collections.abc import Callable
from typing import NamedTuple

from app.gateway.token_bucket import TokenBucket


class _Waiting(NamedTuple):
    is_alive: Callable[[], bool]
    begin: Callable[[], None]


class BeginPace:
    """Begins connections at a rate; addresses that wait get theirs by turns.

    Args:
        rate: Connections a second, in the long run.
        burst: That many at once.
    """

    def __init__(self, rate: float, burst: float) -> None:
        self._bucket = TokenBucket(rate, burst)
        self._waiting: OrderedDict[str, deque[_Waiting]] = OrderedDict()
        self._timer: asyncio.TimerHandle | None = None

    def begin(self, address: str, is_alive: Callable[[], bool], begin: Callable[[], None]) -> None:
        """Call ``begin`` as soon as it is its turn, if ``is_alive`` then."""
        if not self._waiting and self._bucket.take(time.monotonic()):
            begin()
            return
        self._waiting.setdefault(address, deque()).append(_Waiting(is_alive, begin))
        self._wait()

    def put_back(self) -> None:
        """One that has begun turned out to be of somebody signed in, who is not counted."""
        self._bucket.put_back()

    def close(self) -> None:
        """Begin nothing more."""
        self._waiting.clear()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _wait(self) -> None:
        if self._timer is None and self._waiting:
            wait_s = self._bucket.wait_s(time.monotonic())
            self._timer = asyncio.get_running_loop().call_later(wait_s, self._go_on)

    def _go_on(self) -> None:
        self._timer = None
        while (waiting := self._next()) is not None:
            if not self._bucket.take(time.monotonic()):
                self._put_back(waiting)
                break
            waiting[1].begin()
        self._wait()

    def _next(self) -> tuple[str, _Waiting] | None:
        """Who is next and still there; their address goes behind the others."""
        while self._waiting:
            address, line = self._waiting.popitem(last=False)
            waiting = line.popleft()
            if line:
                self._waiting[address] = line
            if waiting.is_alive():
                return address, waiting
        return None

    def _put_back(self, waiting: tuple[str, _Waiting]) -> None:
        address, first = waiting
        line = self._waiting.setdefault(address, deque())
        line.appendleft(first)
        self._waiting.move_to_end(address, last=False)
