"""Token buckets: so many at once, so many a second in the long run. The clock is the caller's."""

from collections import OrderedDict

MAX_KEPT = 4096
"""Addresses; the one that was not heard of longest is forgotten first."""


class TokenBucket:
    """One bucket, full at first.

    Args:
        rate: Tokens a second.
        burst: Tokens it holds.
    """

    def __init__(self, rate: float, burst: float) -> None:
        self._rate = rate
        self._burst = max(1.0, burst)
        self._tokens = self._burst
        self._at = float("-inf")

    def take(self, now: float) -> bool:
        """Take a token, if there is one. ``now`` in s, monotonic."""
        self._fill(now)
        if self._tokens < 1.0:
            return False
        self._tokens -= 1.0
        return True

    def put_back(self) -> None:
        """Give one back that was taken."""
        self._tokens = min(self._burst, self._tokens + 1.0)

    def wait_s(self, now: float) -> float:
        """How long until there is a token, s."""
        self._fill(now)
        return max(0.0, (1.0 - self._tokens) / self._rate)

    def _fill(self, now: float) -> None:
        passed = max(0.0, now - self._at)
        self._tokens = min(self._burst, self._tokens + passed * self._rate)
        self._at = now


class RequestBuckets:
    """Requests of those who are not signed in: by address, and in all.

    Args:
        each: Requests a second from one address.
        together: From all addresses.
        burst_s: So many seconds' worth may come at once.
    """

    def __init__(self, each: float, together: float, burst_s: float) -> None:
        self._each = each
        self._burst_s = burst_s
        self._together = TokenBucket(together, together * burst_s)
        self._own: OrderedDict[str, TokenBucket] = OrderedDict()

    def take(self, address: str, now: float) -> bool:
        """Take a token of the address and one of all; both or neither."""
        own = self._own.get(address)
        if own is None:
            own = self._own[address] = TokenBucket(self._each, self._each * self._burst_s)
            if len(self._own) > MAX_KEPT:
                self._own.popitem(last=False)
        else:
            self._own.move_to_end(address)
        if not own.take(now):
            return False
        if not self._together.take(now):
            own.put_back()
            return False
        return True

    def put_back(self, address: str) -> None:
        """The request was of somebody who is signed in."""
        self._together.put_back()
        if (own := self._own.get(address)) is not None:
            own.put_back()
