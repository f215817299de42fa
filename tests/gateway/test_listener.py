"""The listener, over real sockets."""

import asyncio
import contextlib
import socket
import ssl
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from app.config import ConnectionSettings
from app.gateway.connection_table import Connection, ConnectionTable
from app.gateway.listener import Listener
from app.gateway.machine import machine_names
from app.gateway.tls import LocalAuthority


class Echo(asyncio.Protocol):
    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = transport

    def data_received(self, data: bytes) -> None:
        assert isinstance(self.transport, asyncio.Transport)
        self.transport.write(data)


class Running:
    """A front, and clients that speak to it from threads."""

    def __init__(self, port: int, trust: ssl.SSLContext, server: Listener) -> None:
        self.port = port
        self.trust = trust
        self.server = server

    def connect(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.port), timeout=10)

    async def plain(self, data: bytes) -> bytes:
        """Send, and read until the other side closes."""

        def talk() -> bytes:
            answer = b""
            with self.connect() as connection, contextlib.suppress(ConnectionError):
                connection.sendall(data)
                while part := connection.recv(4096):
                    answer += part
            return answer

        return await asyncio.to_thread(talk)

    async def echo(self, data: bytes) -> bytes:
        """Over TLS."""

        def talk() -> bytes:
            answer = b""
            with (
                self.connect() as connection,
                self.trust.wrap_socket(connection, server_hostname="localhost") as secure,
            ):
                secure.sendall(data)
                while len(answer) < len(data):
                    answer += secure.recv(4096)
            return answer

        return await asyncio.to_thread(talk)


@asynccontextmanager
async def listening(folder: Path, **values: Any) -> AsyncIterator[Running]:
    """An HTTPS listener with these settings."""
    authority = LocalAuthority(folder / "tls", machine_names)
    authority.prepare()
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(authority.server_file)
    settings = ConnectionSettings(**values)
    table = ConnectionTable(100, settings.max_strangers, settings.max_per_address)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.setblocking(False)
        trust = ssl.create_default_context(cadata=authority.public.pem.decode())
        made: list[Echo] = []

        def protocol(_: Connection) -> Echo:
            made.append(Echo())
            return made[-1]

        server = Listener(listener, protocol, table, settings, context)
        yield Running(listener.getsockname()[1], trust, server)
        server.close()
        await server.wait_closed()
        for each in made:
            if hasattr(each, "transport"):
                each.transport.close()
        await asyncio.sleep(0)


@pytest.fixture
async def running(tmp_path: Path) -> AsyncIterator[Running]:
    async with listening(tmp_path) as here:
        yield here


async def test_tls_reaches_the_server_from_its_first_byte_on(running: Running) -> None:
    assert await running.echo(b"hello" * 1000) == b"hello" * 1000


@pytest.mark.parametrize(
    ("head", "told"),
    [
        (b"GET /?token=secret HTTP/1.1\r\nHost: arm.local:8000\r\n\r\n", "https://arm.local:8000/"),
        (b"POST / HTTP/1.1\r\nA: b\r\nhost:[::1]:8000\r\n\r\n", "https://[::1]:8000/"),
        (b"GET / HTTP/1.1\r\nHost: <script>\r\n\r\n", "https:// and this address"),
        (b"GET / HTTP/1.0\r\n\r\n", "https:// and this address"),
    ],
)
async def test_plain_http_is_told_where_to_go(running: Running, head: bytes, told: str) -> None:
    answer = (await running.plain(head)).decode()
    assert answer.startswith("HTTP/1.1 400 ")
    assert told in answer
    assert "secret" not in answer and "<script>" not in answer
    length = int(answer.split("Content-Length: ")[1].split("\r\n")[0])
    assert len(answer.partition("\r\n\r\n")[2].encode()) == length


async def test_who_says_nothing_or_nonsense_hinders_nobody(running: Running) -> None:
    silent = [running.connect() for _ in range(5)]
    assert await running.echo(b"hello") == b"hello"
    for connection in silent:
        connection.close()


@pytest.mark.parametrize(
    "data",
    [b"", b"GET / HTTP/1.1\r\n", b"\x16\x03\x01 no handshake", b"\x00" * 5000, b"x" * 10_000],
)
async def test_what_does_not_begin_ends_in_time(tmp_path: Path, data: bytes) -> None:
    async with listening(tmp_path, begin_s=0.1) as here:
        answer = await here.plain(data)
        assert answer == b"" or answer.startswith(b"HTTP/1.1 400 ")


async def test_one_more_than_there_may_be_closes_the_oldest(tmp_path: Path) -> None:
    async with listening(tmp_path, max_strangers=8, max_per_address=8) as here:
        silent = [here.connect() for _ in range(8)]
        assert await here.echo(b"hello") == b"hello"
        assert await asyncio.to_thread(silent[0].recv, 1) == b""
        silent[1].settimeout(0.05)
        with pytest.raises(TimeoutError):
            await asyncio.to_thread(silent[1].recv, 1)
        for connection in silent:
            connection.close()


async def test_connections_begin_in_turn_and_all_get_theirs(tmp_path: Path) -> None:
    async with listening(tmp_path, begins_per_s=20) as here:
        began = time.monotonic()
        answers = await asyncio.gather(*(here.echo(b"hello") for _ in range(30)))
        assert answers == [b"hello"] * 30
        # Twenty at once; ten more take half a second at the least.
        assert time.monotonic() - began > 0.4


async def test_closing_accepts_nothing_more_and_ends_who_waits(running: Running) -> None:
    waiting = running.connect()
    await running.echo(b"the one before was accepted")
    running.server.close()
    await running.server.wait_closed()
    with waiting:
        assert await asyncio.to_thread(waiting.recv, 1) == b""
    with running.connect() as connection:
        connection.settimeout(0.2)
        # The system takes it; nobody answers.
        connection.sendall(b"GET / HTTP/1.1\r\n\r\n")
        with pytest.raises(TimeoutError):
            await asyncio.to_thread(connection.recv, 1)
