"""Raw connections of those who are not signed in, to a server that runs."""

import contextlib
import json
import socket
import ssl
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from app.config import ConnectionSettings, Settings
from app.gateway.machine import machine_names
from app.gateway.tls import LocalAuthority
from tests.gateway.running import MANY, TOKEN, Running, settings_for

WAIT_S = 30.0
OWN = f"Authorization: Bearer {TOKEN}"
"""A header of somebody signed in."""


def limited(folder: Path, endpoint: str, **values: Any) -> Settings:
    """Settings of a server with these limits of connections, and no other rates."""
    connections = ConnectionSettings(**{**MANY.model_dump(), **values})
    return settings_for(folder, endpoint).model_copy(update={"connections": connections})


def over_tls(settings: Settings, folder: Path) -> tuple[Settings, ssl.SSLContext]:
    """The same server over HTTPS, and whom to trust."""
    authority = LocalAuthority(folder / "tls", machine_names)
    authority.prepare()
    file = authority.server_file
    trust = ssl.create_default_context(cadata=authority.public.pem.decode())
    return settings.model_copy(update={"tls_cert": file, "tls_key": file}), trust


def connect(
    server: Running, trust: ssl.SSLContext | None = None, source: str | None = None
) -> socket.socket:
    """A connection; ``source`` is the address that it comes from."""
    plain = socket.create_connection(
        ("127.0.0.1", server.port), WAIT_S, source_address=None if source is None else (source, 0)
    )
    return plain if trust is None else trust.wrap_socket(plain, server_hostname="localhost")


def read(connection: socket.socket) -> bytes:
    """All that comes until the other side closes."""
    answer = b""
    with contextlib.suppress(ConnectionError, ssl.SSLError):
        while part := connection.recv(65536):
            answer += part
    return answer


def send(connection: socket.socket, parts: Iterable[bytes]) -> int:
    """Send until the other side has had enough; how many bytes it took."""
    sent = 0
    with contextlib.suppress(ConnectionError, ssl.SSLError):
        for part in parts:
            connection.sendall(part)
            sent += len(part)
    return sent


def head(server: Running, start: str = "GET /api/health", *lines: str) -> bytes:
    """A request's head, without the empty line that ends it."""
    return "\r\n".join([f"{start} HTTP/1.1", f"Host: {server.host}", *lines, ""]).encode()


def status(answer: bytes) -> int:
    """The status of the first answer; 0 for none."""
    return int(answer.split(b" ", 2)[1]) if answer.startswith(b"HTTP/1.") else 0


def code(answer: bytes) -> str:
    """The code of an error."""
    body = answer.partition(b"\r\n\r\n")[2]
    return str(json.loads(body)["error"]["code"])
