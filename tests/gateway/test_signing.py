"""Signing in and out, and what a page that is not this server's gets of it."""

import re
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from app.gateway.page_secret import PAGE_HEADER
from app.gateway.pages import own_path
from app.gateway.tokens import TokenStore
from tests.gateway.browser import NAME, SignedIn
from tests.gateway.running import BEARER, TOKEN, Running, StandIn, wait_for

HTML = {"Accept": "text/html,*/*"}
LINK = {"Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}
PICTURE = {"Sec-Fetch-Mode": "no-cors", "Sec-Fetch-Dest": "image"}


def client(server: Running, **headers: str) -> httpx.Client:
    return httpx.Client(base_url=server.url, headers=headers, trust_env=False, timeout=20)


def sign_in(server: Running, token: str = TOKEN) -> SignedIn:
    with client(server) as http:
        return SignedIn.by(http.get("/", params={"token": token}))


def made(server: Running, role: Any = "operator", name: str = "Anna") -> str:
    return TokenStore(server.hub.settings.data_dir / "tokens.json").make(role, name).secret


# The cookie, which every port of the host gets


READS = (
    "/api/session", "/api/robots", "/api/robots/puma", "/api/gestures", "/api/galleries",
    "/api/cameras", "/api/cameras/wrist.jpg", "/api/cameras/wrist.mjpeg", "/api/timeline",
    "/api/timeline.jsonl", "/api/timeline/1/picture.jpg", "/metrics",
)  # fmt: skip


def test_the_cookie_alone_opens_nothing_but_the_pages_own_files(
    server: Running, node: StandIn
) -> None:
    stolen = sign_in(server).stolen
    gesture = server.http.get("/api/gestures").json()[0]["id"]
    # Whoever replays it from a program says of itself what a page of ours would.
    with client(server, **stolen, Origin=server.url, **{"Sec-Fetch-Site": "same-origin"}) as http:
        for path in (*READS, f"/api/gestures/{gesture}/template.png"):
            assert http.get(path).status_code == 401, path
        assert http.get("/api/health").json() == {"status": "ok"}
        for method, path in (
            ("POST", "/api/robots/puma/stop"),
            ("POST", "/api/robots/puma/reset"),
            ("POST", "/api/sign-out"),
            ("DELETE", f"/api/gestures/{gesture}"),
        ):
            assert http.request(method, path).status_code == 401, path
        for path in ("/", "/static/app.js", "/docs", "/openapi.json"):
            assert http.get(path).status_code == 200, path
    for path in ("/ws/operator", "/ws/camera/wrist", "/viser", "/viser?ticket=" + "0" * 81):
        with pytest.raises(InvalidStatus) as refused:
            server.socket(path, additional_headers=stolen, origin=server.url)
        assert refused.value.response.status_code == 401, path
    assert node.requests == node.stops == []
    assert server.http.get(f"/api/gestures/{gesture}").status_code == 200


def test_the_page_opens_everything_and_its_half_nothing_without_the_cookie(
    server: Running,
) -> None:
    page = sign_in(server)
    with client(server, **page.headers()) as http:
        assert http.get("/api/session").json()["role"] == "operator"
        assert http.get("/api/cameras").status_code == 200
        assert http.get("/metrics").status_code == 200
    with server.socket("/ws/operator", **page.socket(), origin=server.url) as socket:
        assert socket.subprotocol == "farhand.v1"
    with client(server, **{PAGE_HEADER: page.headers()[PAGE_HEADER]}) as http:
        assert http.get("/api/session").status_code == 401


def test_another_tokens_half_does_not_fit(server: Running) -> None:
    mine, other = sign_in(server), sign_in(server, made(server))
    mixed = SignedIn(mine.cookie, other.half, other.ticket)
    with client(server, **mixed.headers()) as http:
        assert http.get("/api/robots").status_code == 401
    with client(server, **mine.stolen) as http:
        proof = {PAGE_HEADER: f"{mine.ticket}.{NAME}"}
        assert http.get("/api/robots", headers=proof).status_code == 401


def test_a_ticket_opens_pictures_and_nothing_else(server: Running) -> None:
    page = sign_in(server)
    gesture = server.http.get("/api/gestures").json()[0]["id"]
    picture = f"/api/gestures/{gesture}/template.png"
    with client(server, **page.stolen) as http:
        assert http.get(picture, params=page.query()).status_code == 200
        assert http.get(picture, params={"ticket": f"{page.half}.{NAME}"}).status_code == 401
        for path in ("/api/robots", "/api/cameras/wrist.jpg", "/api/timeline"):
            assert http.get(path, params=page.query()).status_code == 401, path
    with client(server) as http:
        assert http.get(picture, params=page.query()).status_code == 401


# Links and forms on other pages


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_a_link_on_another_page_asks_first_and_is_no_guess(server: Running, site: str) -> None:
    with client(server, **HTML, **LINK, **{"Sec-Fetch-Site": site}) as http:
        for number in range(20):
            asked = http.get("/", params={"token": f'wrong-{number}"><b>'})
            assert asked.status_code == 200
            assert "set-cookie" not in asked.headers
            assert f'value="wrong-{number}&quot;&gt;&lt;b&gt;"' in asked.text
            assert "frame-ancestors 'self'" in asked.headers["content-security-policy"]
        assert "set-cookie" not in http.get("/", params={"token": TOKEN}).headers
    # The button is ours, and nobody's tries were used up.
    own = {"Origin": server.url, "Sec-Fetch-Site": "same-origin"}
    with client(server, **own) as http:
        assert http.post("/signin", data={"token": TOKEN}).status_code == 303


@pytest.mark.parametrize("site", ["cross-site", "same-site", "same-origin", "none"])
def test_pictures_on_a_foreign_page_lock_nobody_out(server: Running, site: str) -> None:
    with client(server, **PICTURE, **{"Sec-Fetch-Site": site}) as http:
        for number in range(20):
            refused = http.get("/", params={"token": f"wrong-{number}"})
            assert refused.status_code == 403
            assert refused.json()["error"]["code"] == "foreign_origin"
    sign_in(server)


@pytest.mark.parametrize(
    "fields",
    [
        {"Origin": "https://evil.example"},
        {"Origin": "http://127.0.0.1:1"},
        {"Origin": "null"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ],
    ids=str,
)
def test_a_foreign_page_signs_nobody_in(server: Running, fields: dict[str, str]) -> None:
    with client(server, **fields) as http:
        for token in (TOKEN, *(f"wrong-{number}" for number in range(20))):
            refused = http.post("/signin", data={"token": token})
            assert (refused.status_code, "set-cookie" in refused.headers) == (403, False)
    sign_in(server)


def test_a_browser_sends_our_own_form_with_its_origin(server: Running) -> None:
    # Under the policy "no-referrer" it would be "null".
    with client(server, **HTML) as http:
        for path in ("/signin", "/"):
            assert http.get(path).headers["referrer-policy"] == "strict-origin"


# Guessing


def test_of_many_cookies_one_is_looked_at(server: Running) -> None:
    page = sign_in(server)
    name = page.cookie.partition("=")[0]
    guesses = "; ".join(f"{name}=guess-{number}" for number in range(150))
    proof = page.headers()[PAGE_HEADER]
    with client(server, **{PAGE_HEADER: proof}) as http:
        answer = http.get("/api/robots", headers={"Cookie": f"{guesses}; {page.cookie}"})
        assert answer.status_code == 401
        fields = [("Cookie", f"{name}=guess-{number}") for number in range(50)]
        answer = http.get("/api/robots", headers=[*fields, ("Cookie", page.cookie)])
        assert answer.status_code == 401
    # That was one guess, the same twice: four are left, of whatever kind.
    with client(server) as http:
        told = [
            http.get("/", params={"token": f"wrong-{number}"}).status_code for number in range(5)
        ]
    assert told == [401] * 4 + [429]


def test_cookies_are_guesses_and_the_same_again_is_none(server: Running) -> None:
    name = sign_in(server).cookie.partition("=")[0]
    person = made(server)
    with client(server) as http:
        # An old cookie, sent over and over by a page that was left open.
        for _ in range(50):
            old = {"Cookie": f"{name}=old"}
            assert http.get("/api/robots", headers=old).status_code == 401
        assert http.get("/", params={"token": "wrong"}).status_code == 401
        for number in range(20):
            http.get("/api/robots", headers={"Cookie": f"{name}=guess-{number}"})
        assert http.get("/", params={"token": "wrong-too"}).status_code == 429
        # What was made here nobody guesses: it gets in all the same.
        page = SignedIn.by(http.get("/", params={"token": person}))
        assert http.get("/api/robots", headers=page.headers()).status_code == 200
        bearer = {"Authorization": f"Bearer {made(server, 'observer')}"}
        assert http.get("/api/robots", headers=bearer).status_code == 200
        # And a page that asks is not told "too many": it may have an old cookie.
        assert http.get("/", headers={**HTML, "Cookie": f"{name}=new"}).status_code == 401


# Who one is, and out


def test_who_is_signed_in(server: Running) -> None:
    with client(server, **sign_in(server, made(server, "observer", "Ünal")).headers()) as http:
        found = http.get("/api/session").json()
    assert (found["role"], found["name"], found["expires"]) == ("observer", "Ünal", None)
    assert re.fullmatch(r"[0-9a-f]{8}", found["token"])
    assert server.http.get("/api/session").json()["token"] == "given"


def test_signing_out_ends_what_this_browser_has_open_and_no_other(
    server: Running, node: StandIn
) -> None:
    page, own = sign_in(server), {"origin": server.url}
    other = "fedcba9876543210"
    driving = server.operator(**page.socket(), **own)
    driving.send("take_control")
    driving.next("robot", controller=driving.hello["session"])
    kept = server.operator(**page.socket(other), **own)
    program = server.operator()
    with client(server, **page.headers(), Origin=server.url) as http:
        answer = http.post("/api/sign-out")
        assert answer.status_code == 204
        cookie = answer.headers["set-cookie"]
        assert cookie.startswith(f"{page.cookie.partition('=')[0]}=; Path=/;")
        assert "; Max-Age=0" in cookie
    with pytest.raises(ConnectionClosed):
        while True:
            driving.receive()
    # Who drove does not any more, and so the arm stands.
    wait_for(lambda: node.holder is None, "control to be given back")
    for open_still in (kept, program):
        open_still.send("ping", t=1.0)
        open_still.next("pong", t=1.0)
        open_still.close()


# Where a browser is sent


@pytest.mark.parametrize(
    "path",
    [
        "//evil.example",
        "/%5Cevil.example",
        "/%5C%5Cevil.example",
        "///evil.example/a",
        "/%09/evil.example",
    ],
)
def test_nobody_is_sent_to_another_host(server: Running, path: str) -> None:
    for site in ("cross-site", "same-site"):
        with client(server, **HTML, **{"Sec-Fetch-Site": site}) as http:
            answer = http.get(f"{server.url}{path}")
            assert answer.status_code in (401, 404)
            (target,) = re.findall(r'content="0;url=([^"]*)"', answer.text)
            assert re.match(r"/(?![/\\])", target), target
            assert "\\" not in target
    with client(server, **BEARER) as http:
        for ending in ("", "/"):
            assert "location" not in http.get(f"{server.url}{path}{ending}").headers


def test_paths_stay_on_the_server() -> None:
    assert own_path("/") == "/"
    assert own_path("/arms/one/viser/") == "/arms/one/viser/"
    assert own_path("//evil") == own_path("/\\/\\evil") == "/evil"
    assert own_path("/a b\r\n\\") == "/a%20b%0D%0A%5C"


def test_the_framework_makes_no_redirects_of_its_own(server: Running) -> None:
    # It would put the Host header into them.
    for path in ("/api/robots/", "/docs/", "/viser", "/static/media", "/trust/"):
        answer = server.http.get(path)
        assert answer.headers.get("location") in (None, "/viser/"), path


def test_the_page_says_nothing_of_where_its_half_comes_from(server: Running) -> None:
    """What holds the fragment together is in two files of two languages."""
    script = Path(__file__).parents[2] / "app" / "static" / "core" / "sign-in.js"
    pattern = re.search(r"const HALF = /(.+)/;", script.read_text())
    assert pattern is not None
    page = sign_in(server)
    assert re.fullmatch(pattern[1], f"#page={page.half}.{page.ticket}")
