"""Who may come in, with real requests."""

import os
import socket
import stat
from pathlib import Path

import httpx
import pytest
from pydantic import SecretStr
from starlette.datastructures import Headers
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from app.config import Settings
from app.errors import CannotStart, NotAllowed, NotSignedIn, RequestError
from app.gateway.auth import Gatekeeper, is_loopback, load_token, same_host
from app.gateway.serve import LOG_CONFIG
from tests.gateway.running import BEARER, TOKEN, Running

HTML = {"Accept": "text/html,*/*"}


def anonymous(server: Running, **headers: str) -> httpx.Client:
    return httpx.Client(base_url=server.url, headers=headers, trust_env=False, timeout=20)


def cookie_of(server: Running) -> str:
    with anonymous(server) as client:
        answer = client.get("/", params={"token": TOKEN})
        assert answer.status_code == 303
        return answer.headers["set-cookie"].partition(";")[0]


# The token


def test_a_token_is_made_once_and_kept_private(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path / "new" / "data")
    token = load_token(settings)
    assert len(token) >= 22
    assert load_token(settings) == token
    path = settings.data_dir / "token"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert path.read_text().strip() == token


def test_two_data_folders_have_two_tokens(tmp_path: Path) -> None:
    first = load_token(Settings(data_dir=tmp_path / "a"))
    assert load_token(Settings(data_dir=tmp_path / "b")) != first


def test_a_token_file_that_is_cut_short_is_made_anew(tmp_path: Path) -> None:
    (tmp_path / "token").write_text("abc\n")
    token = load_token(Settings(data_dir=tmp_path))
    assert len(token) == 43
    assert (tmp_path / "token").read_text() == token + "\n"


def test_a_token_file_open_to_others_is_closed(tmp_path: Path) -> None:
    path = tmp_path / "token"
    path.write_text("x" * 43)
    path.chmod(0o644)
    assert load_token(Settings(data_dir=tmp_path)) == "x" * 43
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_a_given_token_is_used_and_not_written(tmp_path: Path) -> None:
    assert load_token(Settings(data_dir=tmp_path, token=SecretStr("secret"))) == "secret"
    assert not (tmp_path / "token").exists()


@pytest.mark.parametrize("token", ["", "two words", "grün", "tab\t"])
def test_a_token_that_cannot_be_sent_is_refused(tmp_path: Path, token: str) -> None:
    with pytest.raises(CannotStart, match="printable ASCII without spaces"):
        load_token(Settings(data_dir=tmp_path, token=SecretStr(token)))


def test_a_data_folder_that_cannot_be_made_is_one_clear_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(CannotStart, match="choose another --data-dir or give --token"):
        load_token(Settings(data_dir=tmp_path / "file" / "data"))


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


def test_the_cookie_neither_holds_nor_is_the_token() -> None:
    gatekeeper = Gatekeeper(TOKEN, secure=False)
    cookie = gatekeeper.set_cookie_header()
    assert TOKEN not in cookie
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    assert "Path=/" in cookie
    assert "Secure" not in cookie
    assert "Secure" in Gatekeeper(TOKEN, secure=True).set_cookie_header()
    name = cookie.partition("=")[0]
    assert Gatekeeper("another token", secure=False).cookie_name != name


def test_a_wrong_bearer_is_not_saved_by_a_good_cookie() -> None:
    gatekeeper = Gatekeeper(TOKEN, secure=False)
    cookie = gatekeeper.set_cookie_header().partition(";")[0]
    assert gatekeeper.credential(headers(cookie=cookie)) == "cookie"
    assert gatekeeper.credential(headers(cookie=cookie, authorization="Bearer no")) is None


@pytest.mark.parametrize(
    "value",
    ["Bearer", "Bearer ", "Basic dXNlcjpwYXNz", f"Basic {TOKEN}", TOKEN, f"Bearer {TOKEN}x"],
)
def test_other_authorizations_do_not_fit(value: str) -> None:
    assert Gatekeeper(TOKEN, secure=False).credential(headers(authorization=value)) is None


def test_cookies_need_our_origin_where_they_could_do_harm() -> None:
    gatekeeper = Gatekeeper(TOKEN, secure=False)
    cookie = gatekeeper.set_cookie_header().partition(";")[0]
    host = "localhost:8000"
    ours = headers(cookie=cookie, host=host, origin=f"http://{host}")
    foreign = headers(cookie=cookie, host=host, origin="https://evil.example")
    none = headers(cookie=cookie, host=host)
    for method in ("POST", "PATCH", "DELETE", "PUT"):
        assert gatekeeper.admit(ours, method, websocket=False) == "cookie"
        for bad in (foreign, none):
            with pytest.raises(NotAllowed):
                gatekeeper.admit(bad, method, websocket=False)
    assert gatekeeper.admit(ours, "GET", websocket=True) == "cookie"
    for bad in (foreign, none):
        with pytest.raises(NotAllowed):
            gatekeeper.admit(bad, "GET", websocket=True)
        assert gatekeeper.admit(bad, "GET", websocket=False) == "cookie"
    # A program that knows the token comes from nowhere.
    bearer = headers(host=host, authorization=f"Bearer {TOKEN}", origin="https://evil.example")
    assert gatekeeper.admit(bearer, "POST", websocket=False) == "bearer"
    with pytest.raises(NotSignedIn):
        gatekeeper.admit(headers(host=host), "GET", websocket=False)


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8000", "", "127.0.0.1.evil.example"]
)
def test_foreign_hosts_are_refused_on_loopback(host: str) -> None:
    gatekeeper = Gatekeeper.from_settings(Settings(host="127.0.0.1"), TOKEN)
    with pytest.raises(RequestError, match="does not answer for the host"):
        gatekeeper.check_host(headers(host=host))
    for good in ("localhost:1", "127.0.0.1:8000", "[::1]:9", "LocalHost"):
        gatekeeper.check_host(headers(host=good))


def test_off_loopback_any_host_unless_named() -> None:
    Gatekeeper.from_settings(Settings(host="0.0.0.0"), TOKEN).check_host(headers(host="a.example"))
    settings = Settings(host="0.0.0.0", gateway={"allowed_hosts": ["farhand.example"]})
    gatekeeper = Gatekeeper.from_settings(settings, TOKEN)
    gatekeeper.check_host(headers(host="farhand.example:443"))
    with pytest.raises(RequestError):
        gatekeeper.check_host(headers(host="a.example"))


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
        assert answer.status_code == 303
        assert answer.headers["location"] == "/"
        assert TOKEN not in answer.headers["set-cookie"]
        page = client.get("/")
        assert page.status_code == 200
        assert page.headers["content-type"].startswith("text/html")
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
        assert "not the one of this server" in wrong.text
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


def test_a_foreign_host_is_refused(server: Running) -> None:
    with anonymous(server, Host="evil.example", **BEARER) as client:
        answer = client.get("/api/health")
        assert answer.status_code == 400
        assert answer.json()["error"]["code"] == "host_refused"


def test_every_answer_has_the_security_headers(server: Running) -> None:
    for path in ("/", "/api/gestures", "/nothing", "/static/app.js", "/docs"):
        answer = server.http.get(path)
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
    server: Running, path: str, sent: str, origin: str | None, status: int
) -> None:
    values = {
        "nothing": {},
        "wrong bearer": {"Authorization": "Bearer wrong"},
        "cookie": {"Cookie": cookie_of(server)},
    }[sent]
    with pytest.raises(InvalidStatus) as refused:
        server.socket(path, additional_headers=values, origin=origin)
    assert refused.value.response.status_code == status
    assert b'"error"' in refused.value.response.body


def test_a_cookie_with_our_origin_opens_a_websocket(server: Running) -> None:
    cookie = {"Cookie": cookie_of(server)}
    with server.operator(additional_headers=cookie, origin=server.url) as operator:
        assert operator.hello["type"] == "hello"


def test_a_websocket_for_a_foreign_host_is_refused(server: Running) -> None:
    with (
        socket.create_connection(("127.0.0.1", server.port)) as sock,
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
    assert LOG_CONFIG["loggers"]["uvicorn"]["level"] == "WARNING"
    ours = [record for record in caplog.records if record.name.startswith("app.")]
    assert any(record.name == "app.gateway.access" for record in ours)
    assert not any(TOKEN in record.getMessage() for record in ours)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_token_file_without_rights_is_one_clear_error(tmp_path: Path) -> None:
    (tmp_path / "token").write_text("x" * 43)
    (tmp_path / "token").chmod(0)
    with pytest.raises(CannotStart, match="cannot be used"):
        load_token(Settings(data_dir=tmp_path))
