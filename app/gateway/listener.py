"""The server's listener, for HTTP and HTTPS: accepts, counts, and hands connections on.

A connection that has said nothing costs a descriptor and a place in a table; only with its first
byte does it become one of uvicorn's. To HTTPS also who speaks plain HTTP is answered.
"""

import asyncio
import errno
import functools
import logging
import socket
import ssl
from collections.abc import Callable
from typing import Any

from app.config import ConnectionSettings
from app.gateway.begin_pace import BeginPace
from app.gateway.connection_table import CLOSE_S, PROXY, Connection, ConnectionTable
from app.gateway.machine import address_group
from app.gateway.plain_http import send_away

log = logging.getLogger(__name__)

HANDSHAKE = 0x16
"""First byte of TLS (RFC 8446 section 5.1: content type 22)."""
BATCH = 16
"""Connections accepted at once, before the event loop does something else."""
TROUBLE_S = 0.1
"""Pause where the system lets nothing be accepted."""
KNOWN_RATE = 4.0
"""So many times as fast begin connections of addresses from which somebody is signed in: who is
there already should not wait long behind others of their network."""
CHECKS = 20
"""The shortest of the times is kept to a part in this."""
GONE = (errno.ECONNABORTED, errno.EPROTO, errno.ENOTCONN, errno.ECONNRESET)

Protocol = Callable[[Connection], asyncio.Protocol]


class Listener:
    """Accepts connections; has of asyncio's server what uvicorn uses.

    Args:
        listener: Bound, listening, not blocking.
        protocol: Makes the protocol of one connection.
        table: Counts them.
        settings: Times and rates.
        context: Of an HTTPS server; what is loaded into it later holds for later connections.
        is_proxy: Whether an address is that of the proxy in front.
    """

    def __init__(
        self,
        listener: socket.socket,
        protocol: Protocol,
        table: ConnectionTable,
        settings: ConnectionSettings,
        context: ssl.SSLContext | None = None,
        is_proxy: Callable[[str], bool] = lambda _: False,
    ) -> None:
        self._listener = listener
        self._protocol = protocol
        self._table = table
        self._settings = settings
        self._context = context
        self._is_proxy = is_proxy
        self._loop = asyncio.get_running_loop()
        rate = settings.begins_per_s
        self._others = BeginPace(rate, rate)
        self._known = BeginPace(KNOWN_RATE * rate, KNOWN_RATE * rate)
        self._quiet: dict[Connection, socket.socket] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._again: asyncio.TimerHandle | None = None
        self._closed = False
        self._loop.add_reader(listener, self._accept)
        times = (settings.begin_s, settings.head_s, settings.body_s, settings.idle_s)
        self._period = min(0.5, *(each / CHECKS for each in (*times, settings.unread_s)))
        self._checking = asyncio.create_task(self._check(), name="connection deadlines")

    def close(self) -> None:
        """Accept nothing more; what has not said anything yet is closed."""
        if self._closed:
            return
        self._closed = True
        self._loop.remove_reader(self._listener)
        if self._again is not None:
            self._again.cancel()
        self._known.close()
        self._others.close()
        for connection in tuple(self._quiet):
            self._drop(connection)
        for task in self._tasks:
            task.cancel()

    async def wait_closed(self) -> None:
        """Wait until that is done."""
        self._checking.cancel()
        await asyncio.gather(self._checking, *self._tasks, return_exceptions=True)

    async def _check(self) -> None:
        while True:
            await asyncio.sleep(self._period)
            try:
                self._table.expire()
            except Exception:
                log.exception("what is late cannot be ended")

    def _accept(self) -> None:
        for _ in range(BATCH):
            try:
                accepted, peer = self._listener.accept()
            except BlockingIOError:
                return
            except OSError as error:
                if error.errno not in GONE:
                    self._pause(error)
                return
            host = str(peer[0])
            address = PROXY if self._is_proxy(host) else address_group(host)
            connection = self._table.admit(address, self._loop.time() + self._settings.begin_s)
            if connection is None:
                accepted.close()
                continue
            accepted.setblocking(False)
            accepted.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._quiet[connection] = accepted
            connection.end = connection.expire = functools.partial(self._drop, connection)
            self._loop.add_reader(accepted, self._begin, connection)

    def _pause(self, error: OSError) -> None:
        """The system gives no descriptor or memory: give some back, and try again soon."""
        made_room = self._table.make_room()
        log.warning(
            "a connection could not be accepted: %s%s",
            error,
            "; one of somebody who is not signed in was closed" if made_room else "",
        )
        self._loop.remove_reader(self._listener)

        def again() -> None:
            self._loop.add_reader(self._listener, self._accept)

        self._again = self._loop.call_later(TROUBLE_S, again)

    def _drop(self, connection: Connection) -> None:
        """End a connection that is not uvicorn's yet."""
        accepted = self._quiet.pop(connection, None)
        self._table.remove(connection)
        if accepted is not None:
            self._loop.remove_reader(accepted)
            accepted.close()

    def _begin(self, connection: Connection) -> None:
        """Look at the first byte, without taking it, and pass the connection on."""
        accepted = self._quiet[connection]
        try:
            first = accepted.recv(1, socket.MSG_PEEK)
        except BlockingIOError:
            return
        except OSError:
            first = b""
        if not first:
            self._drop(connection)
            return
        self._table.heard(connection)
        self._loop.remove_reader(accepted)
        if self._context is not None and first[0] != HANDSHAKE:
            go = functools.partial(self._answer_plain, connection)
        else:
            go = functools.partial(self._hand_on, connection)
        if connection.address == PROXY:
            go()  # many are behind it, and it has limits of its own
            return
        pace = self._known if self._table.is_known(connection.address) else self._others
        connection.pay_back = pace.put_back
        pace.begin(connection.address, lambda: connection in self._quiet, go)

    def _run(self, work: Any, connection: Connection) -> None:
        task = asyncio.create_task(work)

        def end() -> None:
            task.cancel()

        connection.end = connection.expire = end
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _hand_on(self, connection: Connection) -> None:
        accepted = self._quiet.pop(connection)
        self._run(self._connect(connection, accepted), connection)

    def _answer_plain(self, connection: Connection) -> None:
        self._run(self._send_away(connection), connection)

    async def _connect(self, connection: Connection, accepted: socket.socket) -> None:
        """Make it a connection of uvicorn's, which closes it from then on."""
        tls: dict[str, Any] = {}
        if self._context is not None:
            tls = {
                "ssl": self._context,
                "ssl_handshake_timeout": self._settings.begin_s,
                "ssl_shutdown_timeout": CLOSE_S,
            }
        try:
            await self._loop.connect_accepted_socket(
                lambda: self._protocol(connection), accepted, **tls
            )
        except (OSError, TimeoutError):
            # A handshake that failed: a browser that does not trust the certificate yet.
            log.debug("a connection ended before it began", exc_info=True)
            self._table.remove(connection)
            accepted.close()
        except asyncio.CancelledError:
            self._table.remove(connection)
            accepted.close()
            raise

    async def _send_away(self, connection: Connection) -> None:
        accepted = self._quiet[connection]
        try:
            await send_away(accepted)
        except OSError:
            log.debug("a connection ended before it was answered", exc_info=True)
        finally:
            self._quiet.pop(connection, None)
            self._table.remove(connection)
            accepted.close()
