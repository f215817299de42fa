"""The HTTPS listener, over real sockets."""

import asyncio
import contextlib
import socket
import ssl
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from app.gateway import front
from app.gateway.front import SecureFront
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

    def __init__(self, port: int, trust: ssl.SSLContext, server: SecureFront) -> None:
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


@pytest.fixture
async def running(tmp_path: Path) -> AsyncIterator[Running]:
    authority = LocalAuthority(tmp_path / "tls", machine_names)
    authority.prepare()
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(authority.server_file)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.setblocking(False)
        trust = ssl.create_default_context(cadata=authority.public.pem.decode())
        made: list[Echo] = []

        def protocol() -> Echo:
            made.append(Echo())
            return made[-1]

        server = SecureFront(listener, context, protocol)
        yield Running(listener.getsockname()[1], trust, server)
        server.close()
        await server.wait_closed()
        for each in made:
            if hasattr(each, "transport"):
                each.transport.close()
        await asyncio.sleep(0)


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


async def test_who_says_nothing_or_nonsense_hinders_nobody(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    silent = [running.connect() for _ in range(5)]
    assert await running.echo(b"hello") == b"hello"
    for connection in silent:
        connection.close()
    monkeypatch.setattr(front, "BEGIN_S", 0.05)
    for data in (
        b"", b"GET / HTTP/1.1\r\n", b"\x16\x03\x01 no handshake", b"\x00" * 5000, b"x" * 10_000
    ):  # fmt: skip
        answer = await running.plain(data)
        assert answer == b"" or answer.startswith(b"HTTP/1.1 400 ")
    monkeypatch.undo()
    assert await running.echo(b"hello") == b"hello"


async def test_there_is_a_limit_of_those_who_wait(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(front, "MAX_WAITING", 0)
    assert await running.plain(b"GET / HTTP/1.1\r\n\r\n") == b""
    monkeypatch.setattr(front, "MAX_WAITING", 10)
    assert await running.echo(b"hello") == b"hello"


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
