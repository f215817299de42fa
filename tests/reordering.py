"""A link on which messages to the server overtake one another and are lost.

TCP lets none do so within a connection; what relays messages one by one may. The server must not
take an older picture for news, nor lose its head where one is missing.
"""

import asyncio
import contextlib
import random
import threading
from typing import Self

from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

_SLOTS_S = (0.0, 0.02, 0.05, 0.09)
"""What a message may be held up for: up to about three frames of a webcam."""


class Reordering:
    """Relays WebSockets to a server on loopback; runs in a thread of its own.

    Args:
        port: Of the server.
        lost: Part of the pictures that do not arrive. Text always does.
        seed: Of what happens to which message.

    Attributes:
        overtaken: How many messages arrived after one that was sent later.
        dropped: How many were lost.
    """

    def __init__(self, port: int, *, lost: float = 0.05, seed: int = 0) -> None:
        self._target = port
        self._lost = lost
        self._random = random.Random(seed)
        self.overtaken = self.dropped = 0
        self._loop = asyncio.new_event_loop()
        self._ending = asyncio.Event()
        ready = threading.Event()
        self._thread = threading.Thread(
            target=lambda: self._loop.run_until_complete(self._serve(ready)), daemon=True
        )
        self.port = 0
        self._thread.start()
        ready.wait(30)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._ending.set)
        self._thread.join(30)
        self._loop.close()

    async def _serve(self, ready: threading.Event) -> None:
        async with serve(self._relay, "127.0.0.1", 0, max_size=None, compression=None) as server:
            self.port = server.sockets[0].getsockname()[1]
            ready.set()
            await self._ending.wait()

    async def _relay(self, client: ServerConnection) -> None:
        assert client.request is not None
        token = client.request.headers["Authorization"]
        async with connect(
            f"ws://127.0.0.1:{self._target}{client.request.path}",
            additional_headers={"Authorization": token},
            max_size=None,
            compression=None,
        ) as server:

            async def down() -> None:
                async for message in server:
                    await client.send(message)

            with contextlib.suppress(ConnectionClosed):
                downwards = asyncio.create_task(down())
                try:
                    async with asyncio.TaskGroup() as under_way:
                        await self._up(client, server, under_way)
                finally:
                    downwards.cancel()

    async def _up(
        self, client: ServerConnection, server: ClientConnection, under_way: asyncio.TaskGroup
    ) -> None:
        newest = -1

        async def arrive(number: int, message: str | bytes, after: float) -> None:
            nonlocal newest
            await asyncio.sleep(after)
            self.overtaken += number < newest
            newest = max(newest, number)
            with contextlib.suppress(ConnectionClosed):
                await server.send(message)

        number = 0
        async for message in client:
            if isinstance(message, bytes) and self._random.random() < self._lost:
                self.dropped += 1
                continue
            under_way.create_task(arrive(number, message, self._random.choice(_SLOTS_S)))
            number += 1
