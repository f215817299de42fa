"""Running the server: the port first, then everything else, then one link."""

import asyncio
import contextlib
import errno
import gc
import logging
import logging.config
import signal
import socket
import ssl
import sys
from collections.abc import Iterator
from types import FrameType
from typing import Any

import cv2
import uvicorn
import uvloop
from fastapi import FastAPI

from app.config import Settings
from app.errors import CannotStart
from app.gateway.app import create_app
from app.gateway.auth import is_loopback, load_token

log = logging.getLogger(__name__)

BACKLOG = 128
SOCKET_CEILING = 16 << 20
"""Bytes of a WebSocket message at which uvicorn itself cuts the connection. Far above our own
limit, so that a message over that is still read and the connection closed with 1009 in order:
closing while the rest of it arrives would reset the connection and lose the code."""
GRACE_S = 1
UNSENT_BYTES = 128 * 1024

LOG_CONFIG: dict[str, Any] = {
    "version": 1,
    "disable_existing_loggers": False,
    "formatters": {"line": {"format": "%(asctime)s %(levelname)s %(message)s"}},
    "handlers": {
        "stderr": {
            "class": "logging.StreamHandler",
            "formatter": "line",
            "stream": "ext://sys.stderr",
        }
    },
    "loggers": {
        # uvicorn's own lines carry query strings, in which a token may stand; the guard logs.
        "uvicorn": {"level": "WARNING", "handlers": ["stderr"], "propagate": False},
        "uvicorn.access": {"level": "CRITICAL", "propagate": False},
        "websockets": {"level": "WARNING"},
        "httpx": {"level": "WARNING"},
        "httpcore": {"level": "WARNING"},
        "alembic": {"level": "WARNING"},
    },
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


def check_transport(settings: Settings) -> None:
    """Refuse to serve plain HTTP to other machines, and half or broken certificates.

    Raises:
        CannotStart: with what to give instead.
    """
    cert, key = settings.tls_cert, settings.tls_key
    if (cert is None) != (key is None):
        raise CannotStart("HTTPS needs both --tls-cert and --tls-key")
    if cert is None:
        if not is_loopback(settings.host) and not settings.behind_proxy:
            raise CannotStart(
                f"{settings.host} is reached by other machines, and browsers allow no camera "
                "without HTTPS: give --tls-cert and --tls-key, or --behind-proxy if a proxy in "
                "front serves HTTPS, or listen on 127.0.0.1",
                host=settings.host,
            )
        return
    assert key is not None
    try:
        ssl.create_default_context(ssl.Purpose.CLIENT_AUTH).load_cert_chain(cert, key)
    except (OSError, ssl.SSLError) as error:
        raise CannotStart(
            f"the certificate {cert} with the key {key} cannot be used: {error}"
        ) from error


def link(settings: Settings, port: int, token: str) -> str:
    """The address that signs a browser in."""
    scheme = "http" if settings.tls_cert is None else "https"
    host = settings.host
    if host in ("0.0.0.0", "::", ""):
        host = socket.gethostname() or "localhost"
    if ":" in host:
        host = f"[{host}]"
    return f"{scheme}://{host}:{port}/?token={token}"


class Server(uvicorn.Server):
    """uvicorn, with the order of starting and ending that a robot needs."""

    def __init__(self, config: uvicorn.Config, app: FastAPI) -> None:
        super().__init__(config)
        self._app = app

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave the signals alone: :func:`serve` has them from before the start to the end."""
        yield

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End endless answers first, then as uvicorn does."""
        self._app.state.hub.closing.set()
        await super().shutdown(sockets)


def make_server(app: FastAPI, settings: Settings) -> Server:
    """A uvicorn server for ``app``, ready for ``serve(sockets=[...])``."""
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
        timeout_keep_alive=30,
        ssl_certfile=settings.tls_cert,
        ssl_keyfile=settings.tls_key,
    )
    return Server(config, app)


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
    app: FastAPI, settings: Settings, listener: socket.socket, told: str, signals: Signals
) -> None:
    server = make_server(app, settings)
    async with app.router.lifespan_context(app):
        if signals.ending:
            return
        signals.server = server
        # What is loaded now stays: collections during the work need not look at it.
        gc.freeze()
        sys.stdout.write(f"{told}\n")
        sys.stdout.flush()
        await server.serve(sockets=[listener])


def serve(settings: Settings) -> None:
    """Run the server until it is asked to end by SIGINT or SIGTERM. Main thread only.

    Prints one line on standard output once everything runs: the link that signs a browser in.

    Raises:
        CannotStart: the port, the data folder, the page or the certificate.
        DatabaseBroken: the gesture database cannot be read.
    """
    logging.config.dictConfig(LOG_CONFIG)
    # Two frames at once are better than one frame on two cores.
    cv2.setNumThreads(1)
    check_transport(settings)
    signals = Signals()
    with bind(settings) as listener, signals.caught():
        port = int(listener.getsockname()[1])
        token = load_token(settings)
        app = create_app(settings, token=token, is_ending=lambda: signals.ending)
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            runner.run(_run(app, settings, listener, link(settings, port, token), signals))
    # The interpreter would look through every object of the 3D and imaging libraries several
    # times before it ends, for seconds on a busy machine; there is nothing left to find.
    gc.freeze()
