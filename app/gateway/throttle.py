"""Guessing is slowed: a few wrong tokens from one address, and many from all, then 429."""

import time
from collections import OrderedDict
from collections.abc import Callable

from app.errors import RequestError
from app.gateway.machine import address_group

ADDRESS_TRIES = 5
PAUSE_S = 60.0
"""So long without a guess and an address may try again."""
ALL_TRIES = 200
ALL_REFILL_S = 0.2
"""Of all addresses together: one more try after so long."""
MAX_KEPT = 4096
"""Addresses; whoever has more of them than that meets the limit for all."""


class TooManyGuesses(RequestError):
    """Too many wrong tokens were sent."""

    default_code = "too_many_guesses"
    status = 429


class _Own:
    """Wrong tokens of one address, as hashes, at most :data:`ADDRESS_TRIES`.

    A pause forgets them; guessing on makes the pause longer.
    """

    def __init__(self) -> None:
        self.wrong: set[str] = set()
        self.last = 0.0


class Throttle:
    """Counts wrong tokens, by address and in all.

    Asked before a token is looked at, so that a blocked address learns nothing. Who is signed in is
    never asked: cookies are not counted, and a bearer that was right once from an address stays so.

    Args:
        clock: Seconds that only rise.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._left = float(ALL_TRIES)
        self._refilled = clock()
        self._addresses: OrderedDict[str, _Own] = OrderedDict()
        self._known: OrderedDict[tuple[str, str], None] = OrderedDict()
        self.wrong = 0
        """Wrong tokens so far; the same from the same address once."""

    def check(self, address: str, digest: str) -> None:
        """Refuse an address that has guessed too often.

        The same wrong token once more is no guess: a program that was not told of its end goes on
        with it, and learns what it knew.

        Raises:
            TooManyGuesses: with the seconds to wait.
        """
        now = self._clock()
        self._left = min(ALL_TRIES, self._left + (now - self._refilled) / ALL_REFILL_S)
        self._refilled = now
        own = self._addresses.get(address_group(address))
        if own is not None:
            if digest in own.wrong:
                return
            if now - own.last >= PAUSE_S:
                own.wrong.clear()
            if len(own.wrong) >= ADDRESS_TRIES:
                own.last = now
                raise _too_many(int(PAUSE_S))
        if self._left < 1.0:
            raise _too_many(1)

    def failed(self, address: str, digest: str) -> None:
        """The token with this hash was wrong, from ``address``."""
        group = address_group(address)
        own = self._addresses.pop(group, None) or _Own()
        self._addresses[group] = own
        if digest in own.wrong:
            return
        own.wrong.add(digest)
        self.wrong += 1
        own.last = self._clock()
        self._left = max(0.0, self._left - 1.0)
        if len(self._addresses) > MAX_KEPT:
            self._addresses.popitem(last=False)

    def succeeded(self, address: str, digest: str) -> None:
        """The token with this hash was right, from ``address``."""
        key = (address_group(address), digest)
        self._known.pop(key, None)
        self._known[key] = None
        if len(self._known) > MAX_KEPT:
            self._known.popitem(last=False)

    def knows(self, address: str, digest: str) -> bool:
        """Whether this very token was right from this address before."""
        return (address_group(address), digest) in self._known


def _too_many(seconds: int) -> TooManyGuesses:
    return TooManyGuesses(
        f"too many wrong tokens were sent; wait {seconds} s", retry_after_s=seconds
    )
