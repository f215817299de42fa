"""Counting what is bad, so that a client that sends nothing else is turned away."""

from collections.abc import Callable

from app.errors import FarhandError
from app.gateway.closing import CLOSE_BAD, Closing
from app.gateway.metrics import Metrics


class BadMessages:
    """The bad messages of one session in a row. Used on the event loop.

    Args:
        limit: So many in a row end the session.
        metrics: Counts them for the whole server.
        tell: Sends an ``error`` message; with the number of the frame it is about.
    """

    def __init__(
        self, limit: int, metrics: Metrics, tell: Callable[[FarhandError, int | None], None]
    ) -> None:
        self._limit = limit
        self._metrics = metrics
        self._tell = tell
        self._last = 0
        self._in_a_row = 0

    def bad(self, error: FarhandError, seq: int | None, arrival: int) -> None:
        """A message was bad: say so.

        Args:
            error: What is wrong with it.
            seq: Number of the frame, if it was one and had a number.
            arrival: Number of the message within its session.

        Raises:
            Closing: there were too many in a row.
        """
        self._metrics.bad_messages.labels(error.code).inc()
        if seq is not None:
            self._metrics.frames.labels("refused").inc()
        error.detail.pop("seq", None)
        self._tell(error, seq)
        self._last = max(self._last, arrival)
        self._in_a_row += 1
        if self._in_a_row >= self._limit:
            raise Closing(CLOSE_BAD, f"{self._limit} bad messages in a row")

    def good(self, arrival: int) -> None:
        """A message was good. One that a bad message overtook says nothing about those after it."""
        if arrival > self._last:
            self._in_a_row = 0
