"""Strangers take all they can get; whoever is signed in stops, connects, and gets a new node."""

import contextlib
import resource
import socket
import ssl
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import psutil
import pytest
from websockets.sync.client import connect

from app.gateway.machine import machine_names
from app.gateway.tls import LocalAuthority
from tests.e2e.running import TOKEN, Server, start_server, stop_server
from tests.gateway.running import Operator, wait_for

FILES = 1024
"""Files that the server may open: what most systems give a program by themselves."""
STRANGERS = 1300
SOURCES = ("127.0.0.1", "127.0.0.2", "127.0.0.3")
PATIENCE_S = 60.0
BEARER = {"Authorization": f"Bearer {TOKEN}"}


@pytest.fixture
def many_files() -> Iterator[None]:
    """This process may open as many as it needs."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard != resource.RLIM_INFINITY and hard < 2 * STRANGERS:
        pytest.skip(f"only {hard} files may be opened here")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, 2 * STRANGERS), hard))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def strangers(port: int, first: bytes) -> list[socket.socket]:
    """Connections that send ``first`` and no more, as many as are let in."""
    found = []
    for number in range(STRANGERS):
        source = (SOURCES[number % len(SOURCES)], 0)
        with contextlib.suppress(OSError):
            connection = socket.create_connection(("127.0.0.1", port), 2, source_address=source)
            found.append(connection)
            connection.sendall(first)
        if number % 100 == 99:
            time.sleep(0.05)  # the system's own queue is no part of this
    return found


@pytest.mark.parametrize("first", [b"", b"G"], ids=["silent", "begun"])
@pytest.mark.parametrize("secure", [False, True], ids=["HTTP", "HTTPS"])
def test_what_a_stop_needs_is_kept(
    tmp_path: Path, many_files: None, secure: bool, first: bytes
) -> None:
    options: list[str] = []
    trust: ssl.SSLContext | None = None
    if secure:
        authority = LocalAuthority(tmp_path / "tls", machine_names)
        authority.prepare()
        file = str(authority.server_file)
        options = ["--tls-cert", file, "--tls-key", file]
        trust = ssl.create_default_context(cadata=authority.public.pem.decode())
        first = first and b"\x16"
    server = start_server(tmp_path, *options, files=FILES)
    held: list[socket.socket] = []
    try:
        port = int(server.url.rpartition(":")[2])
        gateway = psutil.Process(server.process.pid)
        wait_for(lambda: robot(server, trust)["online"], "the robot to speak", PATIENCE_S)
        held = strangers(port, first)
        assert len(held) > 500

        with api(server, trust) as client:
            assert client.post("/api/robots/puma/stop").json()["mode"] == "stopped"
        with operator(server, trust) as session:
            assert session.next("robot", mode="stopped")["online"]

        before = robot(server, trust)["restarts"]
        server.node().kill()
        wait_for(
            lambda: (now := robot(server, trust))["restarts"] > before and now["online"],
            "a new node",
            PATIENCE_S,
        )
        assert robot(server, trust)["mode"] == "stopped"
        assert gateway.num_fds() < FILES - 100
        # Those who were there hold no more than they may, and the last of them are still there.
        assert gateway.num_fds() > 150
    finally:
        for connection in held:
            connection.close()
        stop_server(server)


def api(server: Server, trust: ssl.SSLContext | None) -> httpx.Client:
    return httpx.Client(
        base_url=server.url.replace("127.0.0.1", "localhost"),
        headers=BEARER,
        timeout=5,
        trust_env=False,
        verify=trust or False,
    )


def robot(server: Server, trust: ssl.SSLContext | None) -> dict[str, object]:
    """What is known of the robot, over a connection of its own."""
    with api(server, trust) as client:
        found: dict[str, object] = client.get("/api/robots").json()[0]
        return found


def operator(server: Server, trust: ssl.SSLContext | None) -> Operator:
    """A new session."""
    url = server.url.replace("http", "ws", 1).replace("127.0.0.1", "localhost")
    return Operator(
        connect(
            f"{url}/ws/operator", additional_headers=BEARER, ssl=trust, proxy=None, open_timeout=5
        )
    )
