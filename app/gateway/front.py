"""The listener of an HTTPS server: who speaks plain HTTP to it is told where to go.

asyncio's own ends such a connection without a word, and a browser in which somebody types the
address without ``https://`` then shows nothing but "connection reset".
"""

import asyncio
import contextlib
import logging
import re
import socket
import ssl
from collections.abc import Callable

log = logging.getLogger(__name__)

BEGIN_S = 10.0
"""A connection that says nothing, and one that does not finish its handshake, end after this."""
MAX_WAITING = 256
"""Connections that have not begun."""
HANDSHAKE = 0x16
"""First byte of TLS (RFC 8446 section 5.1: content type 22)."""
MAX_HEAD = 4096
_HOST = re.compile(rb"\r\nhost:[ \t]*([a-z0-9.:\[\]-]{1,255})[ \t]*\r\n", re.IGNORECASE)


class SecureFront:
    """Accepts connections; hands those that begin with TLS to the server, and answers the others.

    Has of asyncio's server what uvicorn uses: :meth:`close` and :meth:`wait_closed`.

    Args:
        listener: Bound, listening, not blocking.
        context: Of the server; what is loaded into it later holds for later connections.
        protocol: Makes the protocol of one connection.
    """

    def __init__(
        self,
        listener: socket.socket,
        context: ssl.SSLContext,
        protocol: Callable[[], asyncio.Protocol],
    ) -> None:
        self._listener = listener
        self._context = context
        self._protocol = protocol
        self._connections: set[asyncio.Task[None]] = set()
        self._accepting = asyncio.create_task(self._accept(), name="accept")

    def close(self) -> None:
        """Accept nothing more; what has not said anything yet is closed."""
        self._accepting.cancel()
        for connection in self._connections:
            connection.cancel()

    async def wait_closed(self) -> None:
        """Wait until that is done."""
        await asyncio.gather(self._accepting, *self._connections, return_exceptions=True)

    async def _accept(self) -> None:
        loop = asyncio.get_running_loop()
        while True:
            try:
                connection, _ = await loop.sock_accept(self._listener)
            except OSError as error:
                # Too many open files, or a connection that was gone before it was accepted.
                log.warning("a connection could not be accepted: %s", error)
                await asyncio.sleep(0.1)
                continue
            if len(self._connections) >= MAX_WAITING:
                connection.close()
                continue
            task = asyncio.create_task(self._begin(connection))
            self._connections.add(task)
            task.add_done_callback(self._connections.discard)

    async def _begin(self, connection: socket.socket) -> None:
        """Look at the first byte, without taking it, and pass the connection on."""
        passed_on = False
        try:
            connection.setblocking(False)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            async with asyncio.timeout(BEGIN_S):
                first = await _peek(connection)
                if first and first[0] != HANDSHAKE:
                    await _send_away(connection)
            if first and first[0] == HANDSHAKE:
                passed_on = True
                await asyncio.get_running_loop().connect_accepted_socket(
                    self._protocol,
                    connection,
                    ssl=self._context,
                    ssl_handshake_timeout=BEGIN_S,
                )
        except (OSError, TimeoutError):
            # A handshake that failed: a browser that does not trust the certificate yet.
            log.debug("a connection ended before it began", exc_info=True)
        finally:
            if not passed_on:
                connection.close()


async def _peek(connection: socket.socket) -> bytes:
    """The first byte that has come, left where it is; empty when the other side is gone."""
    loop = asyncio.get_running_loop()
    while True:
        try:
            return connection.recv(1, socket.MSG_PEEK)
        except BlockingIOError:
            ready = asyncio.Event()
            loop.add_reader(connection, ready.set)
            try:
                await ready.wait()
            finally:
                loop.remove_reader(connection)


async def _send_away(connection: socket.socket) -> None:
    """Say in plain HTTP that this is HTTPS, and where. Nothing of what was asked is looked at."""
    loop = asyncio.get_running_loop()
    head = b""
    while b"\r\n\r\n" not in head and len(head) < MAX_HEAD:
        part = await loop.sock_recv(connection, MAX_HEAD)
        if not part:
            return
        head += part
    found = _HOST.search(head.partition(b"\r\n\r\n")[0] + b"\r\n")
    place = f"https://{found[1].decode()}/" if found else "https:// and this address"
    told = f'<a href="{place}">{place}</a>' if found else place
    body = (
        '<!doctype html><html lang="en"><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width"><title>Farhand: HTTPS</title>'
        f"<h1>This server speaks HTTPS alone</h1><p>Open {told}</p></html>\n"
    ).encode()
    answer = (
        b"HTTP/1.1 400 Bad Request\r\nContent-Type: text/html; charset=utf-8\r\n"
        b"Content-Security-Policy: default-src 'none'; frame-ancestors 'none'\r\n"
        b"Cache-Control: no-store\r\nConnection: close\r\n"
        b"Content-Length: %d\r\n\r\n" % len(body)
    )
    await loop.sock_sendall(connection, answer + body)
    with contextlib.suppress(OSError):
        connection.shutdown(socket.SHUT_WR)
