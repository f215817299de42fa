"""What waits to be sent to one browser. Bounded; a slow browser never makes anybody wait."""

import asyncio
from collections import OrderedDict
from typing import Any

from app.gateway.messages import NEWEST_WINS, encode

CAPACITY = 256
"""Messages that must be kept. A browser that is so far behind does not come back."""


class Outbox:
    """An ordered set of messages. Used on the event loop only.

    A message whose type is in :data:`~app.gateway.messages.NEWEST_WINS` replaces one of its type
    that still waits; all others are kept until :data:`CAPACITY` is reached.
    """

    def __init__(self) -> None:
        self._waiting: OrderedDict[str | int, str] = OrderedDict()
        self._ready = asyncio.Event()
        self._count = 0
        self.replaced = 0
        self.overflowed = False

    def put(self, message: dict[str, Any]) -> None:
        """Add a message, to be sent after those that wait."""
        self.put_text(message["type"], encode(message))

    def put_text(self, kind: str, text: str) -> None:
        """Add a message that is JSON already."""
        key: str | int
        if kind in NEWEST_WINS:
            key = kind
            if self._waiting.pop(key, None) is not None:
                self.replaced += 1
        else:
            self._count += 1
            key = self._count
        if len(self._waiting) >= CAPACITY:
            self.overflowed = True
        else:
            self._waiting[key] = text
        self._ready.set()

    def __len__(self) -> int:
        return len(self._waiting)

    async def get(self) -> str | None:
        """Wait for the next message; None once the browser is too far behind."""
        while not self._waiting and not self.overflowed:
            self._ready.clear()
            await self._ready.wait()
        if self.overflowed:
            return None
        return self._waiting.popitem(last=False)[1]
