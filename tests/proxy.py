"""A TCP proxy that can stop forwarding without closing, as a network does that swallows packets."""

import asyncio
import contextlib
import threading
from typing import Self


class Proxy:
    """Listens on a free port of loopback and forwards to another; runs in a thread of its own.

    While it holds, it goes on reading, so that the sender notices nothing. :meth:`forward` lets
    all that was delayed through at once, in order.

    Args:
        port: Where the connections go on to, on loopback.
    """

    _limit = 1 << 16
    """Bytes that a reader keeps, about."""

    def __init__(self, port: int) -> None:
        self._target = port
        self._up = asyncio.Event()
        self._down = asyncio.Event()
        self._up.set()
        self._down.set()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="proxy", daemon=True)
        self._thread.start()
        self._pumps: set[asyncio.Task[None]] = set()
        self._server = asyncio.run_coroutine_threadsafe(self._listen(), self._loop).result()
        self.port: int = self._server.sockets[0].getsockname()[1]

    def hold(self, *, up: bool = True, down: bool = True) -> None:
        """Forward nothing from now on: ``up`` to the server, ``down`` to the client."""

        async def close_gates() -> None:
            if up:
                self._up.clear()
            if down:
                self._down.clear()

        asyncio.run_coroutine_threadsafe(close_gates(), self._loop).result()

    def forward(self) -> None:
        """Forward everything that waits, and what comes after it."""
        for gate in (self._up, self._down):
            self._loop.call_soon_threadsafe(gate.set)

    def close(self) -> None:
        """End all connections."""
        asyncio.run_coroutine_threadsafe(self._end(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    async def _listen(self) -> asyncio.Server:
        return await asyncio.start_server(self._connected, "127.0.0.1", 0, limit=self._limit)

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._pumps.add(task)
        task.add_done_callback(self._pumps.discard)
        with contextlib.closing(writer.transport), contextlib.suppress(OSError):
            there, back = await asyncio.open_connection(
                "127.0.0.1", self._target, limit=self._limit
            )
            with contextlib.closing(back.transport):
                await asyncio.gather(
                    self._pump(reader, back, self._up), self._pump(there, writer, self._down)
                )

    async def _pump(
        self, source: asyncio.StreamReader, sink: asyncio.StreamWriter, gate: asyncio.Event
    ) -> None:
        waiting: asyncio.Queue[bytes] = asyncio.Queue()

        async def read() -> None:
            data = b"-"
            while data:
                try:
                    data = await source.read(1 << 16)
                except OSError:
                    data = b""
                waiting.put_nowait(data)

        reading = asyncio.create_task(read())
        try:
            while data := await waiting.get():
                await gate.wait()
                sink.write(data)
                await sink.drain()
            await gate.wait()
            if sink.can_write_eof():
                sink.write_eof()
        except OSError:
            sink.close()
        finally:
            reading.cancel()
            await asyncio.gather(reading, return_exceptions=True)

    async def _end(self) -> None:
        self._server.close()
        for pump in tuple(self._pumps):
            pump.cancel()
        await asyncio.gather(*self._pumps, return_exceptions=True)
        await asyncio.sleep(0)  # transports that were closed end in the loop's next turn
