"""What one request may be, and how long it may take: over real sockets."""

import contextlib
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest

from app.gateway.http_protocol import MAX_PIPELINED
from tests.gateway.running import BEARER, Running, StandIn, running
from tests.gateway.strangers import OWN, code, connect, head, limited, read, send, status

WEBSOCKET = (
    "Connection: Upgrade", "Upgrade: websocket", "Sec-WebSocket-Version: 13",
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==",
)  # fmt: skip


def ask(server: Running, *parts: bytes) -> bytes:
    """Send, and read until the server closes."""
    with connect(server) as connection:
        send(connection, parts)
        return read(connection)


# How much


@pytest.mark.parametrize("upgrade", [(), WEBSOCKET], ids=["request", "WebSocket"])
@pytest.mark.parametrize(
    ("start", "lines", "expected"),
    [
        ("GET /" + "a" * 8001, [], (414, "target_too_long")),
        ("GET /api/health?" + "a" * 8000, [], (414, "target_too_long")),
        ("GET /ws/operator", ["A: " + "a" * 8001], (431, "head_too_large")),
        ("GET /ws/operator", ["Cookie: a=" + "a" * 8001, OWN], (431, "head_too_large")),
        ("GET /ws/operator", ["A: b"] * 101, (431, "head_too_large")),
        ("GET /ws/operator", ["A: " + "a" * 7900] * 5, (431, "head_too_large")),
    ],
    ids=["path", "query", "header", "cookie", "headers", "in all"],
)
def test_a_head_over_a_limit_is_refused_in_words(
    lasting: Running,
    upgrade: tuple[str, ...],
    start: str,
    lines: list[str],
    expected: tuple[int, str],
) -> None:
    answer = ask(lasting, head(lasting, start, *upgrade, *lines) + b"\r\n")
    assert (status(answer), code(answer)) == expected
    assert b"Connection: close" in answer


def test_a_head_below_the_limits_is_read(lasting: Running) -> None:
    for lines in (["A: " + "a" * 7990], ["A: b"] * 97, ["A: " + "a" * 7900] * 3):
        request = head(lasting, "GET /api/health", OWN, "Connection: close", *lines)
        answer = ask(lasting, request + b"\r\n")
        assert status(answer) == 200
    cookie = {**BEARER, "Cookie": "a=" + "a" * 7900}
    lasting.socket("/ws/operator", additional_headers=cookie).close()


ENDLESS = {
    "headers": ("GET /", [], b"Name-%d: value\r\n"),
    "one header": ("GET /", ["A: b"], b"a" * 16),
    "target": ("GET /" + "a" * 100, None, b"a" * 16),
    "empty lines": (None, None, b"\r\n" * 8),
    "headers, signed in": ("GET /", [OWN], b"Name-%d: value\r\n"),
    "extensions of a chunk": (
        "POST /signin", ["Transfer-Encoding: chunked", "", "1;a=b"], b"c" * 16
    ),
    "trailers": ("POST /signin", ["Transfer-Encoding: chunked", "", "0"], b"Name-%d: value\r\n"),
    "trailers, signed in": (
        "POST /api/robots/puma/stop", [OWN, "Transfer-Encoding: chunked", "", "0"],
        b"Name-%d: value\r\n",
    ),
    "body": ("POST /signin", ["Content-Length: 100000000"], b"a" * 16),
    "body that nobody reads": ("GET /", ["Content-Length: 100000000", ""], b"a" * 16),
    "empty chunks": ("POST /signin", ["Transfer-Encoding: chunked", ""], b"1\r\na\r\n"),
}  # fmt: skip


@pytest.mark.parametrize("what", ENDLESS)
def test_what_has_no_end_is_refused_and_costs_no_memory(lasting: Running, what: str) -> None:
    start, lines, part = ENDLESS[what]
    first = b"\r\n" if start is None else head(lasting, start, *(lines or []))
    if start is not None and lines is None:
        first = f"{start}".encode()
    elif "one header" in what or "extensions" in what:
        first = first.removesuffix(b"\r\n")
    count = itertools.count()

    def parts() -> Iterator[bytes]:
        yield first
        for _ in range(24 * 16):  # 24 MB
            yield b"".join(part % next(count) if b"%d" in part else part for _ in range(4096))

    process = psutil.Process()
    most = before = process.memory_info().rss
    with connect(lasting) as connection:
        sent = 0
        for each in parts():
            if send(connection, [each]) == 0:
                break
            sent += len(each)
            most = max(most, process.memory_info().rss)
        read(connection)
    # What the kernel takes on both sides, and what is read on so that the answer is seen.
    assert sent < 12 << 20, f"{sent} bytes were taken"
    assert most - before < 40 << 20, f"{(most - before) >> 20} MiB more"


def test_what_follows_a_body_is_no_header(folder: Path, node: StandIn) -> None:
    """Else somebody behind a proxy could say there where they come from."""
    seen: list[list[tuple[bytes, bytes]]] = []
    with running(limited(folder, node.endpoint)) as server:
        first = head(server, "POST /api/robots/puma/stop", OWN, "Connection: close")
        request = first + b"Transfer-Encoding: chunked\r\n\r\n0\r\nX-Forwarded-For: 1.2.3.4\r\n\r\n"
        server.http.get("/api/health")
        guard = server.app.middleware_stack.app
        inner = guard.app

        async def look(scope: Any, receive: Any, send: Any) -> None:
            with contextlib.suppress(Exception):
                while (await receive()).get("more_body"):
                    pass
            seen.append(list(scope["headers"]))
            await inner(scope, receive, send)

        guard.app = look
        ask(server, request)
    assert seen and b"x-forwarded-for" not in dict(seen[0])


def test_requests_that_wait_on_one_connection_are_few(lasting: Running) -> None:
    stop = head(lasting, "GET /api/health", OWN) + b"\r\n"
    with connect(lasting) as connection:
        send(connection, [stop * 10_000])
        answer = read(connection)
    assert answer.count(b"HTTP/1.1 ") <= MAX_PIPELINED + 1
    # A few are answered in order.
    with connect(lasting) as connection:
        last = head(lasting, "GET /api/health", OWN, "Connection: close") + b"\r\n"
        send(connection, [stop * 5 + last])
        assert read(connection).count(b"HTTP/1.1 200 ") == 6


def test_nothing_is_taken_on_a_websocket_that_was_not_let_in(lasting: Running) -> None:
    request = head(lasting, "GET /ws/operator", *WEBSOCKET) + b"\r\n"
    frame = b"\x82\xff" + (1 << 24).to_bytes(8, "big") + bytes(4)
    with connect(lasting) as connection:
        sent = send(connection, [request, frame, *[bytes(65536)] * 400])
        assert sent < 12 << 20
        assert status(read(connection)) in (0, 401)


@pytest.mark.parametrize(
    "request_line",
    [
        b"nonsense\r\n\r\n", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n",
        b"CONNECT a:1 HTTP/1.1\r\nHost: a\r\n\r\n", b"GET /\xff HTTP/1.1\r\nHost: a\r\n\r\n",
    ],
)  # fmt: skip
def test_what_is_no_request_is_told_so(lasting: Running, request_line: bytes) -> None:
    answer = ask(lasting, request_line)
    assert (status(answer), code(answer)) == (400, "bad_request")


def test_another_protocol_is_not_spoken_and_the_request_is_answered(lasting: Running) -> None:
    lines = ("Connection: Upgrade", "Upgrade: h2c", OWN)
    assert status(ask(lasting, head(lasting, "GET /api/health", *lines) + b"\r\n")) == 200
    old = head(lasting, "GET /api/health", OWN).replace(b"HTTP/1.1", b"HTTP/1.0") + b"\r\n"
    assert status(ask(lasting, old)) == 200


# How many


def test_strangers_ask_at_a_rate_and_who_is_signed_in_as_often_as_they_like(
    folder: Path, node: StandIn
) -> None:
    values = {"requests_per_s": 1, "all_requests_per_s": 2, "burst_s": 5}
    with running(limited(folder, node.endpoint, **values)) as server:
        for lines in ((), ("Cookie: a=b",), ("Authorization: Bearer guess",)):
            answers = [
                ask(server, head(server, "GET /api/robots", "Connection: close", *lines) + b"\r\n")
                for _ in range(20)
            ]
            assert status(answers[-1]) == 429
            assert b"retry-after: 1\r\n" in answers[-1].lower() or lines
            assert b"connection: close\r\n" in answers[-1].lower()
        assert [server.http.get("/api/robots").status_code for _ in range(50)] == [200] * 50
        # Also when they are told that they may not.
        assert {server.http.get("/api/nothing").status_code for _ in range(50)} == {404}
        with server.operator():
            pass
        # Somebody elsewhere has a share of their own, as long as all together leave one.
        with connect(server, source="127.0.0.2") as connection:
            send(connection, [head(server, "GET /api/health", "Connection: close") + b"\r\n"])
            assert status(read(connection)) == 200


def test_behind_a_proxy_those_behind_it_are_counted(folder: Path, node: StandIn) -> None:
    values = {"requests_per_s": 1, "burst_s": 3, "max_per_address": 2, "max_strangers": 20}
    settings = limited(folder, node.endpoint, **values).model_copy(update={"behind_proxy": True})
    with running(settings) as server:
        silent = [connect(server) for _ in range(10)]

        def get(client: str) -> int:
            lines = (f"X-Forwarded-For: {client}", "Connection: close")
            return status(ask(server, head(server, "GET /api/health", *lines) + b"\r\n"))

        assert [get("192.0.2.1") for _ in range(5)][-1] == 429
        assert get("192.0.2.2") == 200
        assert len(server.table) == 10
        for connection in silent:
            connection.close()
