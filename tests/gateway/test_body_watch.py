"""Bodies: rights are judged again when they are complete, and they have a time limit."""

import json
import socket
from pathlib import Path
from typing import Any

import pytest

from app.gateway.tokens import TokenStore
from tests.gateway.running import Running, StandIn, running, settings_for, wait_for


class Slow:
    """A request whose body is sent in parts."""

    def __init__(
        self, server: Running, method: str, path: str, body: bytes, **headers: str
    ) -> None:
        self._rest = body
        self.socket = socket.create_connection(("127.0.0.1", server.port), 30)
        lines = [f"{method} {path} HTTP/1.1", f"Host: {server.host}"]
        lines += [f"{name.replace('_', '-')}: {value}" for name, value in headers.items()]
        lines += [f"Content-Length: {len(body)}", "", ""]
        self.socket.sendall("\r\n".join(lines).encode())

    def send(self, count: int | None = None) -> None:
        part, self._rest = self._rest[:count], b"" if count is None else self._rest[count:]
        self.socket.sendall(part)

    def answer(self) -> tuple[int, dict[str, Any]]:
        """Status and body; the connection is closed."""
        with self.socket, self.socket.makefile("rb") as file:
            status = int(file.readline().split()[1])
            length = 0
            while (line := file.readline()) != b"\r\n":
                name, _, value = line.partition(b":")
                if name.lower() == b"content-length":
                    length = int(value)
            return status, json.loads(file.read(length) or b"{}")


def gesture(server: Running) -> dict[str, Any]:
    found: dict[str, Any] = server.http.get("/api/gestures").json()[0]
    return found


@pytest.mark.parametrize("method", ["PATCH", "POST"])
def test_a_token_revoked_while_its_body_was_on_the_way_changes_nothing(
    server: Running, folder: Path, method: str
) -> None:
    tokens = TokenStore(folder / "data" / "tokens.json")
    made = tokens.make("operator", "guest")
    before = server.http.get("/api/gestures").json()
    galleries = server.http.get("/api/galleries").json()
    path = f"/api/gestures/{before[0]['id']}" if method == "PATCH" else "/api/galleries"
    body = b'{"name": "revoked"}'
    bearer = {"Authorization": f"Bearer {made.secret}", "Content_Type": "application/json"}
    request = Slow(server, method, path, body, **bearer)
    request.send(5)
    # It has been let in, and waits for the rest.
    guest = {"Authorization": f"Bearer {made.secret}"}
    assert server.http.get("/api/gestures", headers=guest).status_code == 200
    tokens.revoke(made.token.id)
    wait_for(
        lambda: server.http.get("/api/gestures", headers=guest).status_code == 401, "it to be known"
    )
    request.send()
    status, answer = request.answer()
    assert (status, answer["error"]["code"]) == (401, "not_signed_in")
    assert "nothing was changed" in answer["error"]["message"]
    assert server.http.get("/api/gestures").json() == before
    assert server.http.get("/api/galleries").json() == galleries


def test_a_body_that_is_whole_is_taken_while_the_token_lives(server: Running, folder: Path) -> None:
    made = TokenStore(folder / "data" / "tokens.json").make("operator", "guest")
    bearer = {"Authorization": f"Bearer {made.secret}", "Content_Type": "application/json"}
    request = Slow(server, "POST", "/api/galleries", b'{"name": "Ann"}', **bearer)
    request.send(5)
    request.send()
    assert request.answer()[0] == 201


def test_a_body_that_takes_too_long_is_refused_and_changes_nothing(
    node: StandIn, folder: Path
) -> None:
    with running(settings_for(folder, node.endpoint, body_s=1.0)) as server:
        before = gesture(server)
        bearer = {"Authorization": server.http.headers["authorization"]}
        bearer["Content_Type"] = "application/json"
        path = f"/api/gestures/{before['id']}"
        request = Slow(server, "PATCH", path, b'{"name": "too late"}', **bearer)
        request.send(5)
        status, answer = request.answer()
        assert (status, answer["error"]["code"]) == (408, "body_too_slow")
        assert gesture(server) == before
        # A stranger's, too.
        form = {"Content_Type": "application/x-www-form-urlencoded"}
        request = Slow(server, "POST", "/signin", b"token=x", **form)
        assert request.answer()[0] == 408
