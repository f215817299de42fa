"""How fast one client may send: a token bucket whose owner waits, so that TCP slows the sender."""


class Pace:
    """Lets ``burst`` messages through at once and ``rate`` a second in the long run.

    Args:
        rate: Messages a second.
        burst: Messages that may come at once.
    """

    def __init__(self, rate: float, burst: int) -> None:
        self._rate = rate
        self._burst = burst
        self._tokens = float(burst)
        self._at = float("-inf")

    def wait_s(self, now: float) -> float:
        """Take one message in at ``now`` (s, monotonic); how long to wait before the next, s."""
        self._tokens = min(self._burst, self._tokens + max(0.0, now - self._at) * self._rate) - 1
        self._at = now
        return max(0.0, -self._tokens / self._rate)
