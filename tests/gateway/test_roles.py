"""The table of who may do what, whole: route x sign-in x origin x host, and every message."""

import asyncio
import json
import re
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import APIRouter, FastAPI
from starlette.types import Receive, Scope, Send
from websockets.exceptions import ConnectionClosed

from app.config import Settings
from app.errors import CannotStart
from app.gateway.app import create_app
from app.gateway.auth import Gatekeeper
from app.gateway.guard import Guard
from app.gateway.messages import CLIENT_MESSAGES, parse_client_message
from app.gateway.page_secret import PAGE_PROTOCOL, PROTOCOL, page_secret, view_ticket
from app.gateway.roles import (
    FRAME,
    MESSAGES,
    PROOFS,
    ROUTES,
    WEBSOCKET,
    allows,
    check_messages,
    check_routes,
    find,
    may_send,
    routes_of,
)
from app.gateway.tokens import TokenStore, cookie_of, sha256
from tests.gateway.browser import NAME
from tests.gateway.conftest import draw
from tests.gateway.running import BEARER, TOKEN, Running, StandIn, wait_for

SAMPLES = {
    "{id}": "a1",
    "{name}": "wrist",
    "{version}": "1",
    "{sample}": "b2",
    "{view}": "0123456789abcdef",
    "{path:path}": "some/file.js",
}
DOCS = (Path(__file__).parents[2] / "docs" / "protocol.md").read_text()


def sample(path: str) -> str:
    for name, value in SAMPLES.items():
        path = path.replace(name, value)
    assert "{" not in path
    return path


# The table and the application


def test_the_table_holds_the_routes_of_the_application_and_no_others() -> None:
    routes = set(routes_of(create_app(Settings(), token="x" * 32).routes))
    below = {key for key in routes if "/static/media/" in key}
    assert len(below) == 2
    assert routes - below == set(ROUTES)


def test_an_application_with_a_route_that_is_not_in_the_table_is_not_made() -> None:
    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    app.add_api_route("/api/health", lambda: None)
    check_routes(app.routes)
    inner, outer = APIRouter(prefix="/inner"), APIRouter(prefix="/outer")
    inner.add_api_route("/secret", lambda: None, methods=["POST"])
    outer.include_router(inner)
    app.include_router(outer, prefix="/api")
    with pytest.raises(CannotStart, match="POST /api/outer/inner/secret"):
        check_routes(app.routes)
    with pytest.raises(CannotStart, match="cannot hold a route of kind"):
        check_routes([object()])


def test_every_message_is_in_the_table() -> None:
    check_messages(CLIENT_MESSAGES)
    assert set(MESSAGES) == {*CLIENT_MESSAGES, FRAME}
    with pytest.raises(CannotStart, match="fly"):
        check_messages(("stop", "fly"))


def test_what_is_not_in_the_table_nobody_may() -> None:
    assert not may_send("fly", "operator")
    assert find("GET", "/api/secret").access is None
    assert find("PUT", "/api/gestures").access is None
    assert find("GET", "/").access == "anyone"
    assert not allows("signed in", None)
    assert not allows("operator", "observer")


@pytest.mark.parametrize("key", ROUTES)
def test_each_row_is_found_by_a_path_of_its_own(key: str) -> None:
    method, path = key.split(" ")
    found = find(method, sample(path))
    assert found.access == ROUTES[key]
    if method != WEBSOCKET:
        assert method in found.methods


def test_everything_that_changes_or_moves_something_is_the_operators() -> None:
    open_to_observers = {
        key for key, access in ROUTES.items() if not key.startswith("GET") and access != "operator"
    }
    assert open_to_observers == {
        "POST /signin", "POST /api/sign-out", "POST /api/robots/{id}/stop",
        "HEAD /static/{path:path}",
        "WEBSOCKET /ws/camera/{name}", "WEBSOCKET /ws/operator", "WEBSOCKET /viser",
        "WEBSOCKET /viser/",
    }  # fmt: skip
    assert {kind for kind, access in MESSAGES.items() if access != "operator"} == {
        "stop", "view", "ping", "speed", "picture",
    }  # fmt: skip


def test_the_table_is_documented() -> None:
    for key, access in ROUTES.items():
        assert f"| `{key}` | {access} |" in DOCS, key
    for kind, access in MESSAGES.items():
        assert f"| `{kind}` | {access} |" in DOCS, kind
    assert len(
        re.findall(r"^\| `[A-Z]+ /[^`]*` \| (anyone|signed in|operator) \|$", DOCS, re.M)
    ) == (len(ROUTES))


# Every cell, at the door itself


class Behind:
    """What is behind the door: counts who gets there."""

    def __init__(self) -> None:
        self.reached = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self.reached += 1
        if scope["type"] == "websocket":
            await send({"type": "websocket.accept"})
            return
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})


class Door:
    """A guard over HTTPS, with three tokens: an operator's, an observer's and a revoked one."""

    host = "arm.example:8000"

    def __init__(self, folder: Path) -> None:
        self.tokens = TokenStore(folder / "tokens.json")
        self.secrets: dict[str, str] = {
            "operator": self.tokens.make("operator", "").secret,
            "observer": self.tokens.make("observer", "").secret,
        }
        revoked = self.tokens.make("operator", "")
        self.tokens.revoke(revoked.token.id)
        self.secrets |= {"revoked": revoked.secret, "wrong": "wrong"}
        self.behind = Behind()
        self.gatekeeper = Gatekeeper(self.tokens, secure=True, hosts=lambda: ("arm.example",))
        self.guard = Guard(self.behind, self.gatekeeper)

    def ask(
        self, method: str, path: str, fields: dict[str, str], query: str = ""
    ) -> tuple[int, bytes, bool]:
        """Status, body, and whether the request got behind the door."""
        websocket = method == WEBSOCKET
        scope: dict[str, Any] = {
            "type": "websocket" if websocket else "http",
            "path": path,
            "query_string": query.encode(),
            "headers": [(name.encode(), value.encode()) for name, value in fields.items()],
            "client": ("10.0.0.9", 5),
            "extensions": {"websocket.http.response": {}},
        }
        if not websocket:
            scope["method"] = method
        sent: list[dict[str, Any]] = []

        async def send(message: Any) -> None:
            sent.append(message)

        async def receive() -> Any:
            return {"type": "http.request", "body": b""}

        before = self.behind.reached
        asyncio.run(self.guard(scope, receive, send))
        status = next((message["status"] for message in sent if "status" in message), 101)
        body = b"".join(message.get("body", b"") for message in sent)
        return status, body, self.behind.reached > before


WHO = ("nobody", "operator", "observer", "revoked", "wrong")
ORIGINS = {
    "none": None,
    "ours": "https://arm.example:8000",
    "another port": "https://arm.example:8001",
    "plain": "http://arm.example:8000",
    "foreign": "https://evil.example",
    "null": "null",
}
HOSTS = {"ours": "arm.example:8000", "foreign": "evil.example:8000", "none": None}


HOW = ("bearer", "cookie", "cookie and ticket", "cookie and page")
"""The last is a browser; what is on another port of its host gets no more than the second."""


def cells() -> Iterator[tuple[str, str, str, str, str]]:
    for key, who, how, origin, host in product(ROUTES, WHO, HOW, ORIGINS, HOSTS):
        if who != "nobody" or how == "cookie":
            yield key, who, how, origin, host


def expected(key: str, who: str, how: str, origin: str, host: str) -> int | None:
    """What the answer has to be; None: let in. Written down apart from the code under test."""
    method, _ = key.split(" ")
    if host != "ours":
        return 400
    if ROUTES[key] == "anyone":
        return None
    if how != "bearer" and who != "nobody" and method not in ("GET", "HEAD") and origin != "ours":
        return 403  # not looked at
    if who not in ("operator", "observer"):
        return 401
    opened = {
        "bearer": True,
        "cookie": key in OPEN_BY_COOKIE,
        "cookie and ticket": key in (*OPEN_BY_COOKIE, *OPEN_BY_TICKET),
        "cookie and page": True,
    }
    if not opened[how]:
        return 401
    return 403 if ROUTES[key] == "operator" and who == "observer" else None


OPEN_BY_COOKIE = {
    "GET /", "GET /static/{path:path}", "HEAD /static/{path:path}", "GET /docs",
    "GET /openapi.json", "GET /viser", "GET /viser/",
}  # fmt: skip
"""The page's own files."""
OPEN_BY_TICKET = {
    "GET /api/gestures/{id}/template.png", "GET /api/timeline/{id}/picture.jpg",
    "GET /api/timeline/{id}/template.png", "WEBSOCKET /viser", "WEBSOCKET /viser/",
}  # fmt: skip


def show_page(fields: dict[str, str], method: str, proof: str) -> None:
    if method == WEBSOCKET:
        fields["sec-websocket-protocol"] = f"{PROTOCOL}, {PAGE_PROTOCOL}{proof}"
    else:
        fields["farhand-page"] = proof


def test_what_opens_by_less_than_the_page_is_written_down_twice() -> None:
    assert {key for key, proof in PROOFS.items() if proof == "cookie"} == OPEN_BY_COOKIE
    assert {key for key, proof in PROOFS.items() if proof == "ticket"} == OPEN_BY_TICKET
    assert PROOFS.keys() <= ROUTES.keys()


def test_every_cell(tmp_path: Path) -> None:
    door = Door(tmp_path)
    count = 0
    for key, who, how, origin, host in cells():
        method, path = key.split(" ")
        fields: dict[str, str] = {}
        if HOSTS[host] is not None:
            fields["host"] = HOSTS[host] or ""
        if ORIGINS[origin] is not None:
            fields["origin"] = ORIGINS[origin] or ""
        if who != "nobody" and how == "bearer":
            fields["authorization"] = f"Bearer {door.secrets[who]}"
        elif who != "nobody":
            fields["cookie"] = f"{door.gatekeeper.cookie_name}={cookie_of(door.secrets[who])}"
        digest = sha256(door.secrets.get(who, ""))
        if how == "cookie and page":
            show_page(fields, method, f"{page_secret(digest)}.{NAME}")
        query = f"ticket={view_ticket(digest)}.{NAME}" if how == "cookie and ticket" else ""
        status, body, reached = door.ask(method, sample(path), fields, query)
        wanted = expected(key, who, how, origin, host)
        cell = (key, who, how, origin, host, status, body)
        assert reached is (wanted is None), cell
        if wanted is not None:
            assert status == wanted, cell
            # One shape, and nothing in it that is not for strangers.
            assert set(json.loads(body)) == {"error"}, cell
            for secret in door.secrets.values():
                assert len(secret) < 20 or secret.encode() not in body, cell
        count += 1
    assert count == len(ROUTES) * 17 * len(ORIGINS) * len(HOSTS)


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/api/secret", 404),
        ("GET", "/static", 404),
        ("PUT", "/api/gestures", 405),
        ("TRACE", "/", 405),
        ("POST", "/static/app.js", 405),
        (WEBSOCKET, "/ws/secret", 404),
        (WEBSOCKET, "/api/gestures", 404),
    ],
)
def test_what_the_table_does_not_have_never_gets_behind_the_door(
    tmp_path: Path, method: str, path: str, status: int
) -> None:
    door = Door(tmp_path)
    fields = {"host": door.host}
    assert door.ask(method, path, fields)[0] == 401
    fields["authorization"] = f"Bearer {door.secrets['operator']}"
    answer = door.ask(method, path, fields)
    assert (answer[0], answer[2]) == (status, False)


# With a real server


@pytest.fixture
def observer(server: Running) -> dict[str, str]:
    tokens = TokenStore(server.hub.settings.data_dir / "tokens.json")
    return {"Authorization": f"Bearer {tokens.make('observer', 'Anna').secret}"}


def test_an_observer_sees_everything_and_moves_nothing(
    server: Running, node: StandIn, observer: dict[str, str]
) -> None:
    with httpx.Client(base_url=server.url, headers=observer, trust_env=False) as client:
        gesture = client.get("/api/gestures").json()[0]["id"]
        assert client.get("/").status_code == 200
        assert client.get("/metrics").status_code == 200
        assert client.get("/api/health").json()["robots"]
        wait_for(lambda: client.get("/api/timeline").json()["events"], "an event to be written")
        for method, path in (
            ("DELETE", f"/api/gestures/{gesture}"),
            ("PATCH", f"/api/gestures/{gesture}"),
            ("POST", "/api/gestures"),
            ("POST", "/api/robots/puma/reset"),
            ("PATCH", "/api/galleries/shared/settings"),
        ):
            refused = client.request(method, path, json={})
            assert refused.status_code == 403
            assert refused.json()["error"]["code"] == "not_allowed"
    with server.operator(additional_headers=observer) as watching:
        assert watching.hello["role"] == "observer"
        assert watching.hello["session"].startswith("observer-")
        watching.next("robot")
        for kind in ("take_control", "release_control", "arm", "disarm", "reset"):
            watching.send(kind)
            assert watching.next("error")["code"] == "not_allowed"
        seq = watching.frame(draw("stop"))
        assert watching.next("error", seq=seq)["code"] == "not_allowed"
        watching.send("view", detail=True)
        watching.send("ping", t=2.0)
        watching.next("pong", t=2.0)
        assert node.requests == []
        assert node.commands == []
        assert node.stops == []
        watching.send("stop")
        watching.next("robot", mode="stopped")
    assert len(node.stops) == 1


def test_an_observer_stops_the_robot_over_rest(
    server: Running, node: StandIn, observer: dict[str, str]
) -> None:
    assert (
        httpx.post(f"{server.url}/api/robots/puma/stop", headers=observer, trust_env=False).json()[
            "mode"
        ]
        == "stopped"
    )


def test_an_operators_role_is_told(server: Running) -> None:
    with server.operator() as operator:
        assert operator.hello["role"] == "operator"


def test_what_is_open_ends_with_its_token(server: Running, node: StandIn) -> None:
    tokens = TokenStore(server.hub.settings.data_dir / "tokens.json")
    made = tokens.make("operator", "tablet")
    bearer = {"Authorization": f"Bearer {made.secret}"}
    kept = server.operator()
    operator = server.operator(additional_headers=bearer)
    operator.send("take_control")
    operator.next("robot", controller=operator.hello["session"])
    camera = server.socket("/ws/camera/wrist", additional_headers=bearer)
    with (
        httpx.Client(base_url=server.url, headers=bearer, trust_env=False) as client,
        client.stream("GET", "/api/cameras/wrist.mjpeg") as endless,
    ):
        assert endless.status_code == 200
        tokens.revoke(made.token.id)
        for socket in (operator.socket, camera):
            with pytest.raises(ConnectionClosed) as closed:
                while True:
                    socket.recv(timeout=10)
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1008
            assert "opens nothing any more" in closed.value.rcvd.reason
        # Ends in order: no error of a connection that broke.
        for _ in endless.iter_raw():
            pass
    # Control was given back, and nobody else noticed.
    wait_for(lambda: node.holder is None, "control to be given back")
    kept.next("robot")
    kept.close()
    assert httpx.get(f"{server.url}/api/robots", headers=bearer, trust_env=False).status_code == 401
    assert httpx.get(f"{server.url}/api/robots", headers=BEARER, trust_env=False).status_code == 200
    assert TOKEN not in (server.hub.settings.data_dir / "tokens.json").read_text()


def test_messages_of_the_table_are_messages() -> None:
    with_values = {FRAME, "view", "ping", "speed", "picture", "hand_over", "use_gallery", "jog"}
    for kind in set(MESSAGES) - with_values:
        assert parse_client_message(json.dumps({"type": kind})).type == kind
