"""Who may come in, with real requests."""

import ipaddress
import logging
import socket
from pathlib import Path

import httpx
import pytest
from starlette.datastructures import Headers
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from app.config import Settings
from app.errors import NotAllowed, NotSignedIn, RequestError
from app.gateway.auth import Gatekeeper, Identity
from app.gateway.origin import is_loopback, same_host
from app.gateway.page_secret import page_secret
from app.gateway.serve import LOG_LEVELS
from app.gateway.throttle import TooManyGuesses
from app.gateway.tokens import GIVEN, TokenStore, sha256
from tests.gateway.browser import NAME, SignedIn
from tests.gateway.running import BEARER, TOKEN, Running

HTML = {"Accept": "text/html,*/*"}


def anonymous(server: Running, **headers: str) -> httpx.Client:
    return httpx.Client(base_url=server.url, headers=headers, trust_env=False, timeout=20)


def signed_in(server: Running) -> SignedIn:
    with anonymous(server) as client:
        return SignedIn.by(client.get("/", params={"token": TOKEN}))


# The gatekeeper


def headers(**values: str) -> Headers:
    return Headers({name.replace("_", "-"): value for name, value in values.items()})


@pytest.mark.parametrize(
    ("host", "loopback"),
    [
        ("127.0.0.1", True),
        ("127.8.8.8", True),
        ("::1", True),
        ("localhost", True),
        ("0.0.0.0", False),
        ("::", False),
        ("192.168.1.5", False),
        ("example.com", False),
    ],
)
def test_loopback(host: str, loopback: bool) -> None:
    assert is_loopback(host) is loopback


@pytest.mark.parametrize(
    ("origin", "host", "same"),
    [
        ("http://localhost:8000", "localhost:8000", True),
        ("http://LOCALHOST:8000", "localhost:8000", True),
        ("http://localhost", "localhost", True),
        ("https://farhand.example", "farhand.example", True),
        ("https://farhand.example", "farhand.example:443", True),
        ("http://[::1]:8000", "[::1]:8000", True),
        ("http://localhost:8001", "localhost:8000", False),
        ("http://127.0.0.1:8000", "localhost:8000", False),
        ("http://localhost.evil.example:8000", "localhost:8000", False),
        ("null", "localhost:8000", False),
        ("", "localhost:8000", False),
        ("file://", "", False),
        ("http://", "", False),
        ("http://localhost:99999", "localhost:8000", False),
        ("http://[bad", "[bad", False),
    ],
)
def test_same_host(origin: str, host: str, same: bool) -> None:
    assert same_host(origin, host) is same


OPERATOR = {
    "bearer": Identity(GIVEN, "operator", "bearer"),
    "cookie": Identity(GIVEN, "operator", "cookie"),
    "page": Identity(GIVEN, "operator", "page", NAME),
}
PAGE = f"{page_secret(sha256(TOKEN))}.{NAME}"


def gatekeeper(folder: Path, *, secure: bool = False, token: str = TOKEN) -> Gatekeeper:
    return Gatekeeper(TokenStore(folder / "tokens.json", token), secure=secure)


def test_the_cookie_neither_holds_nor_is_the_token(tmp_path: Path) -> None:
    cookie = gatekeeper(tmp_path).set_cookie_header(TOKEN)
    assert TOKEN not in cookie
    assert cookie.startswith("farhand_")
    assert cookie.endswith("; Path=/; HttpOnly; SameSite=Strict")
    secure = gatekeeper(tmp_path, secure=True).set_cookie_header(TOKEN)
    assert secure.startswith("__Host-farhand_")
    assert secure.endswith("; Path=/; HttpOnly; SameSite=Strict; Secure")
    assert "Domain" not in secure
    # Two servers on one machine, whose cookies browsers would mix.
    other = gatekeeper(tmp_path / "other").set_cookie_header(TOKEN)
    assert other.partition("=")[0] != cookie.partition("=")[0]


def test_a_wrong_bearer_is_not_saved_by_a_good_cookie(tmp_path: Path) -> None:
    door = gatekeeper(tmp_path)
    cookie = door.set_cookie_header(TOKEN).partition(";")[0]
    assert door.identify(headers(cookie=cookie)) == OPERATOR["cookie"]
    assert door.identify(headers(cookie=cookie, authorization="Bearer no")) is None


@pytest.mark.parametrize(
    "value",
    ["Bearer", "Bearer ", "Basic dXNlcjpwYXNz", f"Basic {TOKEN}", TOKEN, f"Bearer {TOKEN}x"],
)
def test_other_authorizations_do_not_fit(tmp_path: Path, value: str) -> None:
    assert gatekeeper(tmp_path).identify(headers(authorization=value)) is None


def test_the_token_is_not_a_cookie_nor_the_cookie_a_token(tmp_path: Path) -> None:
    door = gatekeeper(tmp_path)
    name, _, value = door.set_cookie_header(TOKEN).partition(";")[0].partition("=")
    assert door.identify(headers(cookie=f"{name}={TOKEN}")) is None
    assert door.identify(headers(authorization=f"Bearer {value}")) is None


def test_cookies_need_our_origin_where_they_could_do_harm(tmp_path: Path) -> None:
    door = gatekeeper(tmp_path)
    cookie = door.set_cookie_header(TOKEN).partition(";")[0]
    host = "localhost:8000"
    both = {"cookie": cookie, "farhand_page": PAGE, "host": host}
    ours = headers(**both, origin=f"http://{host}")
    foreign = headers(**both, origin="https://evil.example")
    none = headers(**both)
    for method in ("POST", "PATCH", "DELETE", "PUT"):
        assert door.admit(ours, method, websocket=False) == OPERATOR["page"]
        for bad in (foreign, none):
            with pytest.raises(NotAllowed):
                door.admit(bad, method, websocket=False)
    assert door.admit(ours, "GET", websocket=True) == OPERATOR["page"]
    for bad in (foreign, none):
        with pytest.raises(NotAllowed):
            door.admit(bad, "GET", websocket=True)
        assert door.admit(bad, "GET", websocket=False) == OPERATOR["page"]
    # A program that knows the token comes from nowhere.
    bearer = headers(host=host, authorization=f"Bearer {TOKEN}", origin="https://evil.example")
    assert door.admit(bearer, "POST", websocket=False) == OPERATOR["bearer"]
    with pytest.raises(NotSignedIn):
        door.admit(headers(host=host), "GET", websocket=False)


def test_over_https_a_plain_page_of_the_same_name_is_foreign(tmp_path: Path) -> None:
    # Whoever sits between may answer plain HTTP in our name.
    door = gatekeeper(tmp_path, secure=True)
    cookie = door.set_cookie_header(TOKEN).partition(";")[0]
    host = "arm.example:8000"
    both = {"cookie": cookie, "farhand_page": PAGE, "host": host}
    good = headers(**both, origin=f"https://{host}")
    assert door.admit(good, "POST", websocket=False) == OPERATOR["page"]
    with pytest.raises(NotAllowed, match="http://arm"):
        door.admit(headers(**both, origin=f"http://{host}"), "POST", websocket=False)


def test_observers_may_not_what_operators_may(tmp_path: Path) -> None:
    door = gatekeeper(tmp_path)
    secret, token = TokenStore(tmp_path / "tokens.json").make("observer", "Anna")
    bearer = headers(authorization=f"Bearer {secret}")
    watching = Identity(token.id, "observer", "bearer")
    assert door.admit(bearer, "POST", websocket=False, access="signed in") == watching
    with pytest.raises(NotAllowed, match="needs an operator"):
        door.admit(bearer, "POST", websocket=False, access="operator")


def at(tmp_path: Path, **settings: object) -> Gatekeeper:
    given = Settings(data_dir=tmp_path, **settings)  # type: ignore[arg-type]
    return Gatekeeper.from_settings(given, TokenStore(tmp_path / "tokens.json", TOKEN))


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8000", "", "127.0.0.1.evil.example"]
)
def test_foreign_hosts_are_refused_on_loopback(tmp_path: Path, host: str) -> None:
    door = at(tmp_path, host="127.0.0.1")
    with pytest.raises(RequestError, match="does not answer for the host"):
        door.check_host(headers(host=host))
    for good in ("localhost:1", "127.0.0.1:8000", "[::1]:9", "LocalHost"):
        door.check_host(headers(host=good))


def test_two_host_headers_are_refused(tmp_path: Path) -> None:
    twice = Headers(raw=[(b"host", b"localhost"), (b"host", b"evil.example")])
    with pytest.raises(RequestError):
        at(tmp_path, host="127.0.0.1").check_host(twice)


def test_off_loopback_any_host_unless_named_or_certified(tmp_path: Path) -> None:
    proxied = {"host": "0.0.0.0", "behind_proxy": True}
    at(tmp_path, **proxied).check_host(headers(host="a.example"))
    door = at(tmp_path, **proxied, gateway={"allowed_hosts": ["farhand.example"]})
    door.check_host(headers(host="farhand.example:443"))
    with pytest.raises(RequestError):
        door.check_host(headers(host="a.example"))
    certified = Gatekeeper.from_settings(
        Settings(host="0.0.0.0"), TokenStore(tmp_path / "tokens.json"), lambda: ("arm", "10.0.0.7")
    )
    certified.check_host(headers(host="10.0.0.7:8000"))
    with pytest.raises(RequestError):
        certified.check_host(headers(host="a.example"))


# Behind a proxy


def scope(peer: str | None, *forwarded: str) -> dict[str, object]:
    fields = [(b"x-forwarded-for", value.encode()) for value in forwarded]
    return {"type": "http", "client": peer and (peer, 1), "headers": fields}


def test_without_a_proxy_nobody_says_where_a_request_comes_from(tmp_path: Path) -> None:
    assert at(tmp_path).client(scope("10.0.0.9", "1.2.3.4")) == "10.0.0.9"


def test_only_the_proxy_is_answered_and_believed(tmp_path: Path) -> None:
    door = at(tmp_path, behind_proxy=True)
    assert door.client(scope("127.0.0.1", "203.0.113.9")) == "203.0.113.9"
    assert door.client(scope("::ffff:127.0.0.1", "203.0.113.9")) == "203.0.113.9"
    # What stands further left is what the client claims of itself.
    assert door.client(scope("127.0.0.1", "6.6.6.6, 203.0.113.9")) == "203.0.113.9"
    assert door.client(scope("127.0.0.1", "6.6.6.6", "203.0.113.9")) == "203.0.113.9"
    assert door.client(scope("127.0.0.1")) == "127.0.0.1"
    assert door.client(scope("127.0.0.1", "203.0.113.9:51000")) == "203.0.113.9"
    assert door.client(scope("127.0.0.1", "[2001:db8::7]:51000")) == "2001:db8::7"
    for stranger in ("192.168.1.5", "203.0.113.9", None, "unix"):
        with pytest.raises(NotAllowed, match="--proxy-address") as refused:
            door.client(scope(stranger, "127.0.0.1"))
        assert refused.value.code == "not_through_proxy"


def test_the_proxy_may_be_elsewhere(tmp_path: Path) -> None:
    networks = (ipaddress.ip_network("172.16.0.0/12"),)
    door = at(tmp_path, behind_proxy=True, proxy_addresses=networks)
    assert door.client(scope("172.17.0.1", "203.0.113.9")) == "203.0.113.9"
    with pytest.raises(NotAllowed):
        door.client(scope("127.0.0.1"))


# Over HTTP


def test_everything_but_the_door_needs_the_token(server: Running) -> None:
    with anonymous(server) as client:
        for path in (
            "/api/gestures",
            "/api/robots",
            "/api/robots/puma",
            "/api/cameras",
            "/api/cameras/wrist.jpg",
            "/api/cameras/wrist.mjpeg",
            "/metrics",
            "/openapi.json",
            "/docs",
            "/viser/",
            "/static/app.js",
            "/nothing",
            "/api/gestures/",
        ):
            answer = client.get(path)
            assert answer.status_code == 401, path
            assert answer.json()["error"]["code"] == "not_signed_in"
            assert answer.headers["www-authenticate"].startswith("Bearer")
        for path in ("/api/robots/puma/stop", "/api/robots/puma/reset", "/api/recognise"):
            assert client.post(path).status_code == 401
        assert client.get("/api/health").json() == {"status": "ok"}


def test_bearer_opens_everything(server: Running) -> None:
    assert server.http.get("/api/gestures").status_code == 200
    assert server.http.get("/metrics").status_code == 200
    assert server.http.get("/api/health").json()["robots"][0]["id"] == "puma"
    with anonymous(server, Authorization="Bearer wrong") as client:
        assert client.get("/api/gestures").status_code == 401


def test_the_link_signs_a_browser_in(server: Running) -> None:
    with anonymous(server, **HTML) as client:
        answer = client.get("/", params={"token": TOKEN})
        page = SignedIn.by(answer)
        assert answer.headers["location"].partition("#")[0] == "/"
        assert TOKEN not in answer.headers["set-cookie"] + answer.headers["location"]
        shown = client.get("/")
        assert shown.status_code == 200
        assert shown.headers["content-type"].startswith("text/html")
        client.headers["Farhand-Page"] = page.headers()["Farhand-Page"]
        assert client.get("/api/gestures").status_code == 200
        assert client.post("/api/robots/puma/stop").status_code == 403
        ours = {"Origin": server.url}
        assert client.post("/api/robots/puma/stop", headers=ours).status_code == 200
        foreign = client.post("/api/robots/puma/stop", headers={"Origin": "https://evil.example"})
        assert foreign.status_code == 403
        assert foreign.json()["error"]["code"] == "foreign_origin"


def test_a_signed_out_browser_sees_a_field_for_the_token(server: Running) -> None:
    with anonymous(server, **HTML) as client:
        page = client.get("/")
        assert page.status_code == 401
        assert 'name="token"' in page.text
        assert "script-src" not in page.headers["content-security-policy"]
        wrong = client.post("/signin", data={"token": "wrong"})
        assert wrong.status_code == 401
        assert "not one of this server" in wrong.text
        right = client.post("/signin", data={"token": f" {TOKEN} "})
        assert right.status_code == 303
        assert client.get("/").status_code == 200
        assert client.post("/signin", content=b"x" * 10_000).status_code == 401
    with anonymous(server) as client:
        assert client.get("/").json()["error"]["code"] == "not_signed_in"
        assert client.get("/", params={"token": "wrong"}).status_code == 401


def test_a_link_on_another_site_needs_one_reload(server: Running) -> None:
    # SameSite=Strict: the browser sends no cookie on this first request, but does on the next.
    with anonymous(server, **HTML, **{"Sec-Fetch-Site": "cross-site"}) as client:
        page = client.get("/")
        assert 'http-equiv="refresh"' in page.text
        assert 'name="token"' not in page.text


def test_a_foreign_host_is_refused(lasting: Running) -> None:
    with anonymous(lasting, Host="evil.example", **BEARER) as client:
        answer = client.get("/api/health")
        assert answer.status_code == 400
        assert answer.json()["error"]["code"] == "host_refused"


def test_every_answer_has_the_security_headers(lasting: Running) -> None:
    for path in ("/", "/api/gestures", "/nothing", "/static/app.js", "/docs"):
        answer = lasting.http.get(path)
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert answer.headers["referrer-policy"] == "no-referrer"
        policy = answer.headers["content-security-policy"]
        assert "frame-ancestors 'self'" in policy
        assert "unsafe" not in policy
        assert "http:" not in policy


# WebSockets


@pytest.mark.parametrize("path", ["/ws/operator", "/ws/camera/wrist", "/viser"])
@pytest.mark.parametrize(
    ("sent", "origin", "status"),
    [
        ("nothing", None, 401),
        ("wrong bearer", None, 401),
        ("cookie", None, 403),
        ("cookie", "https://evil.example", 403),
        ("cookie", "null", 403),
    ],
)
def test_websockets_are_refused_before_they_open(
    lasting: Running, path: str, sent: str, origin: str | None, status: int
) -> None:
    values = {
        "nothing": {},
        "wrong bearer": {"Authorization": "Bearer wrong"},
        "cookie": signed_in(lasting).headers(),
    }[sent]
    with pytest.raises(InvalidStatus) as refused:
        lasting.socket(path, additional_headers=values, origin=origin)
    assert refused.value.response.status_code == status
    assert b'"error"' in refused.value.response.body


def test_a_cookie_with_our_origin_opens_a_websocket(lasting: Running) -> None:
    with lasting.operator(**signed_in(lasting).socket(), origin=lasting.url) as operator:
        assert operator.hello["type"] == "hello"


def test_a_websocket_for_a_foreign_host_is_refused(lasting: Running) -> None:
    with (
        socket.create_connection(("127.0.0.1", lasting.port)) as sock,
        pytest.raises(InvalidStatus) as refused,
    ):
        connect("ws://evil.example/ws/operator", sock=sock, additional_headers=BEARER, proxy=None)
    assert refused.value.response.status_code == 400


def test_no_secret_reaches_the_log(server: Running, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level("DEBUG"), anonymous(server) as client:
        client.get("/", params={"token": TOKEN})
        client.get("/api/gestures", headers=BEARER)
        server.operator().close()
    # uvicorn and the clients of this test tell headers at their lower levels.
    assert LOG_LEVELS["uvicorn"] == logging.WARNING
    ours = [record for record in caplog.records if record.name.startswith("app.")]
    assert any(record.name == "app.gateway.access" for record in ours)
    assert not any(TOKEN in record.getMessage() for record in ours)


def test_a_bearer_that_is_wrong_too_often_is_not_looked_at(tmp_path: Path) -> None:
    door = gatekeeper(tmp_path)
    right = headers(authorization=f"Bearer {TOKEN}")
    wrong = [headers(authorization=f"Bearer wrong-{number}") for number in range(6)]
    assert door.identify(right, "10.0.0.1") is not None
    for guess in wrong[:5]:
        assert door.identify(guess, "10.0.0.1") is None
    with pytest.raises(TooManyGuesses):
        door.identify(wrong[5], "10.0.0.1")
    # Who was right there before, and who comes from elsewhere, is let in.
    assert door.identify(right, "10.0.0.1") is not None
    assert door.identify(right, "10.0.0.2") is not None
    # A guesser whose sixth guess is right learns nothing.
    for guess in wrong[:5]:
        door.identify(guess, "10.0.0.3")
    with pytest.raises(TooManyGuesses):
        door.identify(right, "10.0.0.3")


def test_guesses_are_refused_from_the_sixth_and_disturb_nobody(server: Running) -> None:
    page = signed_in(server)
    with server.operator(**page.socket(), origin=server.url) as operator:
        with anonymous(server) as client:
            answers = [
                client.get("/api/robots", headers={"Authorization": f"Bearer guess-{number}"})
                for number in range(300)
            ]
            answers += [client.get("/", params={"token": f"link-{n}"}) for n in range(100)]
            answers += [client.post("/signin", data={"token": f"form-{n}"}) for n in range(100)]
        assert [answer.status_code for answer in answers] == [401] * 5 + [429] * 495
        assert all(a.json()["error"]["code"] == "too_many_guesses" for a in answers[5:])
        assert answers[5].headers["retry-after"] == "60"
        operator.next("robot")
        operator.send("ping", t=1.0)
        operator.next("pong", t=1.0)
        # With the token that was right here before, and with the cookie.
        assert server.http.get("/api/robots").status_code == 200
        with anonymous(server, **page.headers()) as client:
            assert client.get("/api/robots").status_code == 200
    with anonymous(server, **HTML) as client:
        page = client.post("/signin", data={"token": "guess"})
        assert page.status_code == 429
        assert "too many wrong tokens" in page.text
