"""A scripted operator: sends pictures over the operator WebSocket as the page does."""

import asyncio
import contextlib
import json
import time
from collections.abc import Awaitable, Callable, Iterable
from functools import partial
from typing import Any, Self

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from app.link.header import FrameHeader

ASK_AGAIN_S = 5.0
MAX_IN_FLIGHT = 2
"""Frames under way at once, as docs/protocol.md asks of a client."""


class Operator:
    """One signed-in session. Keeps what the server said; every message has a ``received`` time."""

    def __init__(self, url: str, token: str) -> None:
        self._url = url.replace("http", "ws", 1) + "/ws/operator"
        self._token = token
        self._socket: ClientConnection | None = None
        self._reader: asyncio.Task[None] | None = None
        self._changed = asyncio.Condition()
        self._sequence = 0
        self._in_flight: dict[int, float] = {}
        self.tick = 0
        self.frames: list[dict[str, Any]] = []
        self.gestures: list[dict[str, Any]] = []
        self.robot: dict[str, Any] = {}
        self.errors: list[dict[str, Any]] = []
        self.skipped = 0

    async def __aenter__(self) -> Self:
        self._socket = await connect(
            self._url,
            additional_headers={"Authorization": f"Bearer {self._token}"},
            max_size=1 << 20,
            compression=None,
        )
        self._reader = asyncio.create_task(self._read())
        return self

    async def __aexit__(self, *_: object) -> None:
        assert self._socket is not None and self._reader is not None
        await self._socket.close()
        await self._reader

    async def _read(self) -> None:
        assert self._socket is not None
        # A server that was killed says no farewell.
        with contextlib.suppress(ConnectionClosed):
            await self._read_all(self._socket)

    async def _read_all(self, socket: ClientConnection) -> None:
        async for raw in socket:
            message = json.loads(raw)
            message["received"] = time.monotonic()
            self.tick = max(self.tick, message.get("tick") or 0)
            match message["type"]:
                case "frame":
                    message["sent"] = self._in_flight.pop(message["seq"], None)
                    self.frames.append(message)
                case "gesture":
                    self.gestures.append(message)
                case "robot":
                    self.robot = message
                case "error":
                    self._in_flight.pop(message.get("seq"), None)
                    self.errors.append(message)
            async with self._changed:
                self._changed.notify_all()

    async def wait_for(self, condition: Callable[[], object], seconds: float = 20.0) -> None:
        """Wait until ``condition`` is true.

        Raises:
            TimeoutError: it did not become true.
        """
        async with asyncio.timeout(seconds), self._changed:
            await self._changed.wait_for(lambda: bool(condition()))

    async def say(self, kind: str, **fields: object) -> None:
        """Send a text message."""
        assert self._socket is not None
        await self._socket.send(json.dumps({"type": kind, **fields}))

    async def take_and_arm(self) -> None:
        """Take control and arm, and wait until the robot says so.

        On a busy machine a request can go unanswered, and control run out before it is armed: both
        are asked for again.

        Raises:
            TimeoutError: it was not armed within two minutes.
        """
        await self.wait_for(lambda: self.robot.get("mode") == "disarmed", 60)
        async with asyncio.timeout(60):
            while not self.robot.get("armed"):
                wanted = "armed" if self.robot.get("controller") else "controller"
                await self.say("arm" if wanted == "armed" else "take_control")
                with contextlib.suppress(TimeoutError):
                    await self.wait_for(partial(self._robot_says, wanted), ASK_AGAIN_S)

    def _robot_says(self, key: str) -> bool:
        return bool(self.robot.get(key))

    async def show(self, jpeg: bytes, *, flood: bool = False) -> int:
        """Send one picture, or skip it when two are under way. Returns its number, or -1.

        Args:
            jpeg: The picture.
            flood: Send it however many are under way, as no client should.
        """
        assert self._socket is not None
        now = time.monotonic()
        # A frame that was replaced by a newer one on the server is never answered.
        for number, sent in list(self._in_flight.items()):
            if now - sent > 0.5:
                del self._in_flight[number]
        if len(self._in_flight) >= MAX_IN_FLIGHT and not flood:
            self.skipped += 1
            return -1
        self._sequence += 1
        self._in_flight[self._sequence] = now
        header = FrameHeader(self._sequence, now * 1e3, self.tick)
        await self._socket.send(header.pack() + jpeg)
        return self._sequence

    async def play(
        self,
        pictures: Iterable[bytes],
        rate: float = 30.0,
        at_each: Callable[[int, int], Awaitable[None]] | None = None,
        *,
        until: Callable[[], object] = lambda: False,
        flood: bool = False,
    ) -> None:
        """Show pictures one after another.

        Args:
            pictures: JPEGs; may be without end.
            rate: How many a second.
            at_each: ``at_each(index, seq)`` is awaited after each.
            until: Ends before the pictures do when this is true.
            flood: Send each, however many are under way.
        """
        start = time.monotonic()
        for index, picture in enumerate(pictures):
            delay = start + index / rate - time.monotonic()
            if delay > 0:
                await asyncio.sleep(delay)
            if until():
                return
            number = await self.show(picture, flood=flood)
            if at_each is not None:
                await at_each(index, number)
