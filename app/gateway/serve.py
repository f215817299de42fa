"""Running the server: the port first, then everything else, then one link."""

import asyncio
import contextlib
import errno
import gc
import logging
import signal
import socket
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import FrameType

import cv2
import uvicorn
import uvloop
from fastapi import FastAPI

from app import logs
from app.config import Settings
from app.errors import CannotStart
from app.gateway.app import create_app
from app.gateway.connection_table import Connection, ConnectionTable
from app.gateway.descriptors import current_shares, raise_limit
from app.gateway.given_token import with_given_token
from app.gateway.greeting import greet
from app.gateway.http_limits import HttpLimits
from app.gateway.http_protocol import LimitedHttp
from app.gateway.listener import Listener
from app.gateway.machine import parse_address
from app.gateway.tls import LocalAuthority
from app.gateway.tokens import TokenStore
from app.gateway.transport import check_transport, keep_certificate, local_authority
from app.private import keep_private, private_folder
from app.process_lock import ProcessLock

log = logging.getLogger(__name__)

LOCK_FILE = "server.lock"
"""In the data folder; held by the server that uses it."""
BACKLOG = 512
SOCKET_CEILING = 16 << 20
"""Bytes of a WebSocket message at which uvicorn itself cuts the connection. Far above our own
limit, so that a message over that is still read and the connection closed with 1009 in order:
closing while the rest of it arrives would reset the connection and lose the code."""
GRACE_S = 1
UNSENT_BYTES = 128 * 1024

LOG_LEVELS = {
    # uvicorn's own lines carry query strings, in which a token may stand; the guard logs.
    "uvicorn": logging.WARNING,
    "uvicorn.access": logging.CRITICAL,
    "websockets": logging.WARNING,
    "httpcore": logging.WARNING,
    "alembic": logging.WARNING,
}


def bind(settings: Settings) -> socket.socket:
    """A listening socket for the host and port of ``settings``.

    Raises:
        CannotStart: the port is busy or not allowed, or the address is not ours.
    """
    host, port = settings.host, settings.port
    try:
        found = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE | socket.AI_NUMERICSERV
        )
    except OSError as error:
        raise CannotStart(
            f"the address {host!r} is not known; give one of this machine with --host", host=host
        ) from error
    family, kind, protocol, _, address = found[0]
    listener = socket.socket(family, kind, protocol)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    if sys.platform == "linux":
        # Inherited by every connection: what a slow browser has not taken waits in our own slots,
        # where newer pictures replace it, and not by the megabyte in the kernel.
        listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, UNSENT_BYTES)
    try:
        listener.bind(address)
        listener.listen(BACKLOG)
    except OSError as error:
        listener.close()
        what = {
            errno.EADDRINUSE: f"port {port} on {host} is taken by another program; "
            "end it, or choose another with --port (0 picks a free one)",
            errno.EACCES: f"port {port} needs more rights than this user has; "
            "choose one above 1023 with --port",
            errno.EADDRNOTAVAIL: f"{host} is not an address of this machine; give one with --host",
        }.get(error.errno or 0, f"{host} port {port} cannot be used: {error.strerror}")
        raise CannotStart(what, host=host, port=port) from error
    listener.setblocking(False)
    return listener


class Server(uvicorn.Server):
    """uvicorn, with the order of starting and ending that a robot needs."""

    def __init__(self, config: uvicorn.Config, app: FastAPI, settings: Settings) -> None:
        super().__init__(config)
        self._app = app
        self._settings = settings
        self.table: ConnectionTable | None = None
        """Its connections, once it listens."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave the signals alone: :func:`serve` has them from before the start to the end."""
        yield

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen, by a listener that counts and limits."""
        await super().startup([])
        settings = self._settings.connections
        shares = current_shares(settings.max_strangers)
        log.debug("connections: %s", shares)
        table = self.table = ConnectionTable(*shares, settings.max_per_address)
        limits = HttpLimits.make(settings, table, self._app.state.gatekeeper)

        def protocol(connection: Connection) -> asyncio.Protocol:
            return LimitedHttp(
                connection=connection,
                limits=limits,
                # As uvicorn makes it for its own listeners.
                config=self.config,
                server_state=self.server_state,
                app_state=self.lifespan.state,
            )

        for listener in sockets or []:
            self.servers.append(
                Listener(  # type: ignore[arg-type]
                    listener, protocol, table, settings, self.config.ssl, self._is_proxy
                )
            )

    def _is_proxy(self, host: str) -> bool:
        address = parse_address(host) if self._settings.behind_proxy else None
        proxies = self._settings.proxy_addresses
        return address is not None and any(address in network for network in proxies)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End endless answers first, then as uvicorn does."""
        self._app.state.hub.closing.set()
        await super().shutdown(sockets)
        if self.table is not None:
            self.table.close()  # whoever has not read to the end


def make_server(
    app: FastAPI, settings: Settings, authority: LocalAuthority | None = None
) -> Server:
    """A uvicorn server for ``app``, ready for ``serve(sockets=[...])``."""
    # A file of the authority's holds both the certificate and its key.
    cert = settings.tls_cert if authority is None else authority.server_file
    key = settings.tls_key if authority is None else None
    config = uvicorn.Config(
        app,
        http="httptools",
        ws="websockets-sansio",
        lifespan="off",  # opened by run(), so that its errors reach the caller
        log_config=None,
        access_log=False,
        server_header=False,
        proxy_headers=False,
        ws_max_size=SOCKET_CEILING,
        ws_per_message_deflate=False,  # JPEG does not shrink, and bombs do not unpack
        ws_ping_interval=5.0,
        ws_ping_timeout=10.0,
        timeout_graceful_shutdown=GRACE_S,
        ssl_certfile=cert,
        ssl_keyfile=key,
    )
    return Server(config, app, settings)


class Signals:
    """SIGINT and SIGTERM end the server in order; a second SIGINT at once."""

    def __init__(self) -> None:
        self.ending = False
        self.server: Server | None = None

    def _handle(self, number: int, _frame: FrameType | None) -> None:
        server = self.server
        if server is not None:
            if self.ending and number == signal.SIGINT:
                server.force_exit = True
            server.should_exit = True
        self.ending = True

    @contextlib.contextmanager
    def caught(self) -> Iterator[None]:
        """Catch the signals meanwhile."""
        numbers = (signal.SIGINT, signal.SIGTERM)
        before = {number: signal.signal(number, self._handle) for number in numbers}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


async def _run(
    app: FastAPI,
    settings: Settings,
    authority: LocalAuthority | None,
    listener: socket.socket,
    told: Callable[[], None],
    signals: Signals,
) -> None:
    server = make_server(app, settings, authority)
    async with app.router.lifespan_context(app):
        if signals.ending:
            return
        signals.server = server
        server.config.load()
        keeping = None
        if server.config.ssl is not None:
            keeping = asyncio.create_task(keep_certificate(server.config.ssl, settings, authority))
        # What is loaded now stays: collections during the work need not look at it.
        gc.freeze()
        # What it keeps is written to disk.
        await asyncio.to_thread(told)
        try:
            await server.serve(sockets=[listener])
        finally:
            if keeping is not None:
                keeping.cancel()
                await asyncio.gather(keeping, return_exceptions=True)


def lock_data_folder(folder: Path) -> ProcessLock:
    """Keep every other server out of a data folder, and other users of the machine too.

    Two servers would share databases and the latch of the stop: a reset at one would delete what
    was stopped at the other.

    Raises:
        CannotStart: another server has it, or it cannot be had.
    """
    private_folder(folder)
    return ProcessLock(
        folder / LOCK_FILE,
        f"the data folder {folder}",
        "end that server first, or choose another folder with --data-dir",
    )


def serve(settings: Settings, remarks: Sequence[str] = ()) -> None:
    """Run the server until it is asked to end by SIGINT or SIGTERM. Main thread only.

    Prints one line on standard output once everything runs: the link that signs an operator in. On
    a terminal also one for observers, codes for phones, and how to trust the certificate.

    Args:
        settings: Of the server.
        remarks: What its log begins with, as warnings.

    Raises:
        CannotStart: the port, the data folder (also when another server has it), the page, the
            certificate, or the limit of open files.
        DatabaseBroken: the gesture database cannot be read.
    """
    for name, level in LOG_LEVELS.items():
        logging.getLogger(name).setLevel(level)
    # Two frames at once are better than one frame on two cores.
    cv2.setNumThreads(1)
    # Before anything is said: a server whose log nobody reads has to start, too.
    with logs.written_apart():
        for remark in remarks:
            log.warning(remark)
        keep_private()
        _serve(with_given_token(settings))


def _serve(settings: Settings) -> None:
    check_transport(settings)
    raise_limit()
    signals = Signals()
    with (
        contextlib.closing(lock_data_folder(settings.data_dir)),
        bind(settings) as listener,
        signals.caught(),
    ):
        port = int(listener.getsockname()[1])
        tokens = TokenStore.from_settings(settings)
        authority = local_authority(settings)
        app = create_app(
            settings, tokens=tokens, authority=authority, is_ending=lambda: signals.ending
        )

        def tell() -> None:
            greet(settings, port, tokens, authority)

        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            runner.run(_run(app, settings, authority, listener, tell, signals))
    # The interpreter would look through every object of the 3D and imaging libraries several
    # times before it ends, for seconds on a busy machine; there is nothing left to find.
    gc.freeze()
