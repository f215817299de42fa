"""Another server on the same host: it is sent the cookie, and opens nothing with it."""

import json
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import httpx
import pytest
from playwright.sync_api import Page, expect
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from tests.e2e.conftest import OpenPage
from tests.e2e.running import TOKEN, Server, wait_for

pytestmark = pytest.mark.e2e

READY = "window.farhand?.robot?.mode === 'disarmed'"
READS = (
    "/api/session", "/api/robots", "/api/robots/puma", "/api/gestures", "/api/cameras/wrist.jpg",
    "/api/cameras/wrist.mjpeg", "/api/timeline", "/api/timeline.jsonl", "/metrics",
)  # fmt: skip
CHANGES = ("/api/robots/puma/stop", "/api/robots/puma/reset", "/api/sign-out")
SOCKETS = ("/ws/operator", "/ws/camera/wrist", "/viser", "/viser/?view=0123456789abcdef")

FOREIGN_PAGE = """
async (base) => {
    const found = {};
    const shown = (path) => new Promise((resolve) => {
        const image = new Image();
        image.onload = () => resolve(true);
        image.onerror = () => resolve(false);
        image.src = base + path;
    });
    const opened = (path, protocols) => new Promise((resolve) => {
        const socket = new WebSocket(base.replace("http", "ws") + path, protocols);
        socket.onopen = () => resolve(true);
        socket.onerror = () => resolve(false);
    });
    for (const path of ["/api/cameras/wrist.jpg", "/api/cameras/wrist.mjpeg"]) {
        found[path] = await shown(path);
    }
    for (const path of ["/ws/operator", "/ws/camera/wrist", "/viser?view=0123456789abcdef"]) {
        found[path] = await opened(path, ["farhand.v1"]);
    }
    for (const path of ["/api/robots/puma/reset", "/api/robots/puma/stop", "/api/sign-out"]) {
        for (const mode of ["no-cors", "cors"]) {
            const init = { method: "POST", credentials: "include", mode };
            await fetch(base + path, init).catch(() => {});
        }
    }
    for (let n = 0; n < 20; n += 1) await shown(`/?token=wrong-${n}`);
    found.kept = Object.keys(localStorage).length;
    return found;
}
"""


class Neighbour:
    """A server on another port: notes what browsers send it."""

    def __init__(self) -> None:
        self.requests: list[dict[str, str]] = []
        requests = self.requests

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                requests.append({name.lower(): value for name, value in self.headers.items()})
                body = b"<!doctype html><title>Neighbour</title><h1>Next door</h1>"
                self.send_response(200)
                self.send_header("Content-Type", "text/html")
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, format: str, *args: Any) -> None:
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}"
        self._thread = threading.Thread(target=self._server.serve_forever)
        self._thread.start()

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


@pytest.fixture
def neighbour() -> Iterator[Neighbour]:
    here = Neighbour()
    yield here
    here.close()


def open_signed_in(open_page: OpenPage, server: Server, **options: Any) -> Page:
    page = open_page(server.link, **options)
    wait_for(page, READY)
    return page


def another_tab(page: Page, url: str) -> Page:
    """Of the same browser, with the same cookies; opened by nobody."""
    with page.expect_popup() as opening:
        page.evaluate("() => { window.open('about:blank'); }")
    opening.value.goto(url)
    return opening.value


def test_what_another_port_is_sent_opens_nothing(
    one_server: Server, neighbour: Neighbour, open_page: OpenPage
) -> None:
    page = open_signed_in(open_page, one_server)
    with one_server.api() as api:
        before = api.get("/api/robots/puma").json()
        beside = another_tab(page, neighbour.url)
        # Browsers do send it: that is what all this is about.
        cookie = neighbour.requests[0]["cookie"]
        assert cookie.startswith("farhand_")
        assert "page" not in json.dumps(neighbour.requests)

        # Its page in the browser gets nothing shown, opened or changed, and locks nobody out.
        found = beside.evaluate(FOREIGN_PAGE, one_server.url)
        assert not any(found.values()), found

        # And the server behind it, which may say of itself what it likes.
        claims = {
            "Cookie": cookie,
            "Origin": one_server.url,
            "Sec-Fetch-Site": "same-origin",
            "Referer": f"{one_server.url}/",
        }
        with httpx.Client(base_url=one_server.url, headers=claims, trust_env=False) as thief:
            for path in READS:
                assert thief.get(path).status_code == 401, path
            for path in CHANGES:
                assert thief.post(path).status_code == 401, path
            gesture = api.get("/api/gestures").json()[0]["id"]
            assert thief.get(f"/api/gestures/{gesture}/template.png").status_code == 401
            assert thief.delete(f"/api/gestures/{gesture}").status_code == 401
            assert thief.get("/api/health").json() == {"status": "ok"}
            half = thief.get("/").text + thief.get("/static/core/sign-in.js").text
            assert page.evaluate("Object.values(localStorage).join()").split(".")[0] not in half
        for path in SOCKETS:
            with pytest.raises(InvalidStatus) as refused:
                connect(
                    one_server.url.replace("http", "ws") + path,
                    additional_headers={"Cookie": cookie},
                    origin=one_server.url,  # type: ignore[arg-type]
                    proxy=None,
                )
            assert refused.value.response.status_code == 401, path

        after = api.get("/api/robots/puma").json()
        assert (after["mode"], before["mode"]) == ("disarmed", "disarmed")
        # Somebody may still come by the link from here.
        with httpx.Client(base_url=one_server.url, trust_env=False) as other:
            assert other.get("/", params={"token": TOKEN}).status_code == 303
    # The page itself was not disturbed.
    page.reload()
    wait_for(page, READY)


def test_a_sign_in_lasts_over_reloads_and_tabs_and_ends_in_all_of_them(
    one_server: Server, open_page: OpenPage
) -> None:
    page = open_signed_in(open_page, one_server, allow_errors=True)
    assert page.url == f"{one_server.url}/"
    assert page.evaluate("history.length") <= 2
    page.reload()
    wait_for(page, READY)
    # Pictures have no header to show themselves by.
    wait_for(
        page, "[...document.querySelectorAll('#gesture-list img')].some((i) => i.naturalWidth)"
    )
    second = another_tab(page, one_server.url)
    wait_for(second, READY)

    second.click("#account-open")
    expect(second.locator("#account-role")).to_contain_text("operator")
    expect(second.locator("#account-token")).to_contain_text("given when started")
    second.click("#sign-out")
    second.wait_for_url("**/signin")
    assert page.context.cookies() == []
    kept = second.evaluate("Object.keys(localStorage)")
    assert not [name for name in kept if name.startswith("farhand-page")]
    wait_for(page, "window.farhand.state.connection.state === 'signed-out'")

    # The way back, from the page that was signed out: its form, sent by a real browser.
    page.click("#gone-retry")
    page.fill("#token", TOKEN)
    page.click("button")
    wait_for(page, READY)
    assert page.url == f"{one_server.url}/"


def test_a_link_on_another_page_asks_before_it_signs_in(
    one_server: Server, neighbour: Neighbour, open_page: OpenPage
) -> None:
    page = open_page(neighbour.url)
    page.evaluate(
        "(link) => document.body.append(Object.assign(document.createElement('a'), "
        "{ href: link, textContent: 'in', id: 'in' }))",
        one_server.link,
    )
    page.click("#in")
    button = page.get_by_role("button", name="Sign in")
    expect(button).to_be_visible()
    assert page.context.cookies() == []
    button.click()
    wait_for(page, READY)
    assert page.url == f"{one_server.url}/"
