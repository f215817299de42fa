"""As much is done as may be done at once: the one error for it, and threads that are bounded."""

import asyncio
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any, TypeVar

from app.errors import RequestError

T = TypeVar("T")

RETRY_AFTER_S = 2
"""What a client is told to wait."""


class Busy(RequestError):
    """As much of this kind of work is done at once as may be."""

    default_code = "busy"
    status = 429

    def __init__(self, message: str, **detail: Any) -> None:
        super().__init__(message, **{"retry_after_s": RETRY_AFTER_S, **detail})


class BoundedThreads:
    """Threads for what waits: for the database, a disk, the robot. Used on the event loop.

    Args:
        name: Of the threads.
        threads: So many.
        waiting: Calls that may wait for a thread; one more is refused.
    """

    def __init__(self, name: str, threads: int, waiting: int) -> None:
        self._name = name
        self._most = threads + waiting
        self._threads = ThreadPoolExecutor(threads, name)
        self._under_way = 0
        self._lock = threading.Lock()

    async def __call__(self, function: Callable[..., T], *arguments: Any, **keywords: Any) -> T:
        """Call it on a thread.

        Raises:
            Busy: too many calls wait already.
        """
        with self._lock:
            if self._under_way >= self._most:
                raise Busy(f"too many requests wait ({self._name}); try again in a moment")
            self._under_way += 1
        try:
            future = self._threads.submit(function, *arguments, **keywords)
        except BaseException:
            self._ended(None)
            raise
        future.add_done_callback(self._ended)
        return await asyncio.wrap_future(future)

    def _ended(self, _future: Any) -> None:
        with self._lock:
            self._under_way -= 1

    def close(self) -> None:
        """Take no more calls; those under way go on to their end."""
        self._threads.shutdown(wait=False, cancel_futures=True)


class Slots:
    """At most so many of something at once. Used on the event loop.

    Args:
        most: So many.
        full: What is said when all are taken.
    """

    def __init__(self, most: int, full: str) -> None:
        self._most = most
        self._full = full
        self._taken = 0

    def check(self) -> None:
        """Do nothing if one is free.

        Raises:
            Busy: all are taken.
        """
        if self._taken >= self._most:
            raise Busy(self._full)

    @contextmanager
    def one(self) -> Iterator[None]:
        """Take one for as long as this lasts.

        Raises:
            Busy: all are taken.
        """
        self.check()
        self._taken += 1
        try:
            yield
        finally:
            self._taken -= 1
