"""A slow link: a TCP proxy with a delay and a rate each way, that can be cut and restored."""

import asyncio
import socket
import time

from tests.proxy import Proxy

_CHUNK = 1460
"""Bytes; what one packet carries, so that connections share the link packet by packet."""
_BUFFER = 32 * 1024
"""Bytes that wait before the link, as in a router; then the senders have to wait."""
_SOCKET_BUFFER = 16 * 1024


class _Way:
    """One direction, which all connections share."""

    def __init__(self, delay_s: float, rate: float) -> None:
        self._delay = delay_s
        self._rate = rate
        self._free_at = 0.0
        self.carried = 0

    def carry(self, size: int) -> float:
        """Take ``size`` bytes; when they arrive, s, monotonic."""
        self.carried += size
        self._free_at = max(self._free_at, time.monotonic()) + size / self._rate
        return self._free_at + self._delay

    def burden(self, seconds: float) -> None:
        """Somebody else's bytes are before ours, for so long."""
        self._free_at = max(self._free_at, time.monotonic()) + seconds

    def full_for(self) -> float:
        """Seconds until there is room in the buffer."""
        return self._free_at - _BUFFER / self._rate - time.monotonic()


class SlowLink(Proxy):
    """A proxy with a delay and a rate. ``hold()`` cuts it, ``forward()`` restores it.

    While it is cut nothing arrives and nothing is closed, new connections included; a sender feels
    it only when the sockets' buffers are full, which are small here.

    Args:
        port: Where the connections go on to, on loopback.
        delay_s: One way, s.
        rate: Bytes a second, each way, over all connections.
    """

    _limit = _CHUNK

    def __init__(self, port: int, *, delay_s: float, rate: float) -> None:
        self._way_up = _Way(delay_s, rate)
        self._way_down = _Way(delay_s, rate)
        super().__init__(port)

    @property
    def carried(self) -> tuple[int, int]:
        """Bytes so far, up to the server and down to the client."""
        return self._way_up.carried, self._way_down.carried

    def queue_up(self, seconds: float) -> None:
        """What is sent up from now on waits for so long behind what somebody else sends."""
        self._loop.call_soon_threadsafe(self._way_up.burden, seconds)

    async def _pump(
        self, source: asyncio.StreamReader, sink: asyncio.StreamWriter, gate: asyncio.Event
    ) -> None:
        way = self._way_up if gate is self._up else self._way_down
        # The sink of one direction is the source of the other.
        end: socket.socket = sink.get_extra_info("socket")
        end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _SOCKET_BUFFER)
        travelling: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()

        async def read() -> None:
            data = b"-"
            while data:
                await gate.wait()
                try:
                    data = await source.read(_CHUNK)
                except OSError:
                    data = b""
                travelling.put_nowait((way.carry(len(data)), data))
                await asyncio.sleep(way.full_for())

        reading = asyncio.create_task(read())
        try:
            while True:
                arrives, data = await travelling.get()
                await asyncio.sleep(arrives - time.monotonic())
                await gate.wait()
                if not data:
                    break
                sink.write(data)
                await sink.drain()
            if sink.can_write_eof():
                sink.write_eof()
        except OSError:
            sink.close()
        finally:
            reading.cancel()
            await asyncio.gather(reading, return_exceptions=True)
