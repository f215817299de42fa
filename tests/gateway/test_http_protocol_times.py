"""How long each phase of a connection may last: over real sockets, with short times."""

import contextlib
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.gateway.running import Running, StandIn, running, wait_for
from tests.gateway.strangers import OWN, code, connect, head, limited, over_tls, read, send, status

QUICK = {"begin_s": 3.0, "head_s": 0.3, "body_s": 0.3, "idle_s": 0.3, "unread_s": 0.3}


@contextmanager
def quick(folder: Path, node: StandIn, **values: Any) -> Iterator[Running]:
    """A server with short times."""
    with running(limited(folder, node.endpoint, **{**QUICK, **values})) as server:
        yield server


@pytest.mark.parametrize("secure", [False, True], ids=["HTTP", "HTTPS"])
def test_each_phase_ends_in_time(folder: Path, node: StandIn, secure: bool) -> None:
    settings, trust = limited(folder, node.endpoint, **QUICK), None
    if secure:
        settings, trust = over_tls(settings, folder)
    with running(settings) as server:
        begun = [b"", b"G", head(server), head(server, "GET /", OWN), b"\r\n\r\n"]
        begun += [head(server, "POST /signin", "Content-Length: 9", "") + b"token"]
        begun += [head(server, "POST /signin", "Transfer-Encoding: chunked", "") + b"4\r\nto"]
        begun += [head(server, "GET /", "") + head(server)]
        open_ones = [connect(server) for _ in range(3)]  # which never say anything
        waiting = [connect(server, trust) for _ in begun]
        for connection, first in zip(waiting, begun, strict=True):
            send(connection, [first])
        for connection in open_ones:
            assert read(connection) == b""
        answers = [read(connection) for connection in waiting]
        assert [status(answer) for answer in answers] == [0, 408, 408, 408, 408, 408, 408, 401]
        assert code(answers[1]) == "request_timeout"
        for connection in (*open_ones, *waiting):
            connection.close()
        wait_for(lambda: server.table is not None and len(server.table) == 0, "all to be closed")


def test_a_byte_now_and_then_is_not_enough(folder: Path, node: StandIn) -> None:
    with quick(folder, node) as server:
        for first in (head(server), head(server, "POST /signin", "Content-Length: 999", "")):
            with connect(server) as connection:

                def drip(first: bytes = first) -> Iterator[bytes]:
                    yield first
                    for _ in range(600):
                        time.sleep(0.05)
                        yield b"a"

                assert send(connection, drip()) < len(first) + 100
                assert status(read(connection)) in (0, 408)


def test_who_is_signed_in_has_longer_but_not_for_ever(folder: Path, node: StandIn) -> None:
    with quick(folder, node, transfer_s=1.5) as server, connect(server) as connection:
        upload = ["Content-Type: image/jpeg", "Content-Length: 100000"]
        send(connection, [head(server, "POST /api/recognise", OWN, *upload) + b"\r\n"])
        began = time.monotonic()
        assert status(read(connection)) == 408
        assert time.monotonic() - began > 1.0


@pytest.mark.parametrize("signed_in", [False, True])
def test_an_answer_that_is_not_read_ends_in_time(
    folder: Path, node: StandIn, signed_in: bool
) -> None:
    with quick(folder, node, transfer_s=0.5, idle_s=60) as server:
        lines = [OWN] if signed_in else ["Accept: text/html"]
        one = head(server, "GET /docs" if signed_in else "GET /", *lines) + b"\r\n"
        with connect(server) as connection:
            connection.settimeout(5)

            def asks() -> Iterator[bytes]:
                while True:
                    yield one

            # Its answers fill every buffer on the way; then it is cut off, and learns that.
            with contextlib.suppress(TimeoutError):
                send(connection, asks())
            wait_for(lambda: len(server.table) == 0, "the connection to be cut")


def test_who_closes_without_reading_is_gone(folder: Path, node: StandIn) -> None:
    with quick(folder, node) as server:
        for request in (b"nonsense\r\n\r\n", head(server, "GET /", "Connection: close") + b"\r\n"):
            with connect(server) as connection:
                send(connection, [request])
                wait_for(lambda: len(server.table) == 0, "the connection to be closed")


def test_idle_connections_of_who_is_signed_in_last_longer(folder: Path, node: StandIn) -> None:
    with (
        quick(folder, node, begin_s=60, head_s=60, keep_alive_s=60) as server,
        connect(server) as connection,
        connect(server) as stranger,
    ):
        for each, lines in ((connection, [OWN]), (stranger, [])):
            send(each, [head(server, "GET /api/health", *lines) + b"\r\n"])
        # Reads until the server closes.
        assert status(read(stranger)) == 200
        send(connection, [head(server, "GET /api/health", OWN, "Connection: close") + b"\r\n"])
        assert read(connection).count(b"HTTP/1.1 200 ") == 2
