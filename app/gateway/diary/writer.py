"""A thread that writes events down, and forgets what it cannot write."""

import itertools
import logging
import queue
import threading
import time
from collections.abc import Callable
from typing import Any

from app.errors import FarhandError
from app.memory import EventStore, Finish, Kind, NewEvent, Picture
from app.memory.store import Item

log = logging.getLogger(__name__)

WAITING = 512
"""Items that may wait to be written; a disk that is slower than that loses the next ones."""
GATHER_S = 0.1
"""What comes within this time is written together."""
TELL_EVERY_S = 60.0
"""How often the log says that events are lost."""
SLEW_MS = 5000
"""A clock that is set back by less than this stands still meanwhile; by more it is believed."""
CLOSE_S = 3.0

WallClock = Callable[[], int]


def wall_ms() -> int:
    """Ms since 1970, UTC."""
    return time.time_ns() // 1_000_000


class Writer:
    """Takes events on the event loop and writes them on a thread of its own.

    Taking one never waits and never raises. What cannot be written, because the disk is full, slow
    or gone, is lost and counted (:attr:`lost`).

    Args:
        store: Where to; None: nowhere, everything is lost.
        written: Told the newest event's id, on the thread, whenever something was written.
        clock: ms since 1970, UTC.
    """

    def __init__(
        self,
        store: EventStore | None,
        written: Callable[[int], None] = lambda newest: None,
        clock: WallClock = wall_ms,
    ) -> None:
        self._store = store
        self._written = written
        self._clock = clock
        self._last_ms = 0
        self._began: dict[int, float] = {}
        self._tokens = itertools.count(1)
        self._queue: queue.Queue[Item | None] = queue.Queue(WAITING)
        self._overflown = 0
        self._unwritten = 0
        self._told_at = float("-inf")
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        if store is not None:
            self._thread = threading.Thread(target=self._run, name="timeline", daemon=True)
            self._thread.start()

    @property
    def lost(self) -> int:
        """Events that were never written."""
        return self._overflown + self._unwritten

    def record(
        self,
        kind: Kind,
        /,
        *,
        template: bytes | None = None,
        lasts: bool = False,
        ago_s: float = 0.0,
        **data: Any,
    ) -> int:
        """Something happens.

        Args:
            kind: What.
            template: 600 bytes, if a hand belongs to it.
            lasts: Whether :meth:`finish` will be called.
            ago_s: How long ago it began.
            **data: Words and numbers that say more, JSON-compatible.

        Returns:
            What names the event for :meth:`finish` and :meth:`picture`.
        """
        token = next(self._tokens)
        now = self._clock()
        # Network time nudges a clock back now and then; what follows did not happen before.
        if not self._last_ms - SLEW_MS < now < self._last_ms:
            self._last_ms = now
        if lasts:
            self._began[token] = time.monotonic() - ago_s
        at_ms = self._last_ms - round(ago_s * 1000)
        if not self._put(NewEvent(token, at_ms, kind, data, template)):
            self._overflown += 1
        return token

    def finish(self, token: int, **data: Any) -> None:
        """An event that lasts is over; ``data`` is added to what it holds."""
        began = self._began.pop(token, None)
        if began is not None:
            took_ms = round((time.monotonic() - began) * 1000)
            self._put(Finish(token, took_ms, data))

    def picture(self, token: int, jpeg: bytes) -> None:
        """What the robot looked like when an event began."""
        self._put(Picture(token, jpeg))

    def close(self) -> None:
        """Write what waits, and end. Not for the event loop."""
        self._ending.set()
        self._put(None)
        if self._thread is not None:
            self._thread.join(CLOSE_S)

    def _put(self, item: Item | None) -> bool:
        if self._store is None:
            return False
        try:
            self._queue.put_nowait(item)
        except queue.Full:
            return False
        return True

    def _run(self) -> None:
        while not (self._ending.is_set() and self._queue.empty()):
            items = [self._queue.get()]
            self._ending.wait(GATHER_S)
            while not self._queue.empty():
                items.append(self._queue.get())
            self._write([item for item in items if item is not None])

    def _write(self, items: list[Item]) -> None:
        if not items or self._store is None:
            return
        try:
            newest = self._store.write(items)
        except Exception as error:
            self._unwritten += sum(isinstance(item, NewEvent) for item in items)
            now = time.monotonic()
            if now - self._told_at >= TELL_EVERY_S:
                self._told_at = now
                known = isinstance(error, FarhandError)
                log.error("events are lost: %s", error, exc_info=None if known else error)
            return
        if newest is not None:
            self._written(newest)
