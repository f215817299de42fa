"""The stops that one session asks for: behind nothing else, and to the end."""

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

from app.errors import FarhandError

MAX_STOPS = 8
"""Stops of one session under way at once; one more would tell the robot nothing new."""


class Stops:
    """Stops the robot without waiting. Used on the event loop.

    Args:
        stop: Stops the robot, given a reason that a person reads and the source.
        count: Told the source of each stop.
        tell: Sends an ``error`` message.
    """

    def __init__(
        self,
        stop: Callable[[str, str], Coroutine[Any, Any, None]],
        count: Callable[[str], None],
        tell: Callable[[FarhandError], None],
    ) -> None:
        self._stop = stop
        self._count = count
        self._tell = tell
        self._under_way: set[asyncio.Task[None]] = set()

    def begin(self, reason: str, source: str) -> None:
        """Stop the robot, behind nothing else; goes on even if the session ends."""
        if len(self._under_way) >= MAX_STOPS:
            return
        task = asyncio.create_task(self._run(reason, source))
        self._under_way.add(task)
        task.add_done_callback(self._under_way.discard)

    async def _run(self, reason: str, source: str) -> None:
        self._count(source)
        try:
            await self._stop(reason, source)
        except FarhandError as error:
            self._tell(error)
