"""The page as a browser elsewhere gets it: over HTTPS, and below a path through a proxy."""

import asyncio
import contextlib
import ssl
import threading
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Page

from app.gateway.machine import machine_names
from app.gateway.tls import FOLDER, LocalAuthority
from tests.e2e.conftest import OpenPage
from tests.e2e.running import TOKEN, start_server, stop_server, wait_for

pytestmark = pytest.mark.e2e


def check_page(page: Page) -> None:
    """Everything arrives: messages, pictures, the 3D view; and the cookie is as it should be."""
    wait_for(page, "window.farhand?.robot?.mode === 'disarmed'")
    wait_for(page, "window.farhand.pictures.wrist > 2 && window.farhand.pictures.scene > 2")
    assert page.evaluate("window.isSecureContext")
    assert "token" not in page.url
    (cookie,) = page.context.cookies()
    assert cookie["name"].startswith("__Host-farhand_")
    assert (cookie["secure"], cookie["httpOnly"], cookie["sameSite"]) == (True, True, "Strict")
    assert page.evaluate("document.cookie") == ""
    page.wait_for_selector("#view-3d iframe, #show-3d")
    if page.is_visible("#show-3d"):
        page.click("#show-3d")
    page.frame_locator("#view-3d iframe").locator("canvas").first.wait_for()
    # Stopping is a request that changes something: its origin has to be ours.
    page.keyboard.press("Space")
    wait_for(page, "window.farhand.robot?.mode === 'stopped'")


@pytest.fixture
def elsewhere(tmp_path: Path) -> Iterator[str]:
    """Address of a server that other machines reach."""
    server = start_server(tmp_path, "--host", "0.0.0.0")
    yield f"https://localhost:{urlsplit(server.url).port}/"
    stop_server(server)


def test_over_https_with_the_certificate_made_here(elsewhere: str, open_page: OpenPage) -> None:
    check_page(open_page(f"{elsewhere}?token={TOKEN}", untrusted=True))


class TlsProxy:
    """Ends TLS and passes everything on as it is, as a proxy in front does."""

    def __init__(self, backend: int, context: ssl.SSLContext) -> None:
        self._backend = backend
        self._context = context
        self._loop = asyncio.new_event_loop()
        self._opened = threading.Event()
        self.port = 0
        self._thread = threading.Thread(target=self._run, name="proxy")
        self._thread.start()
        self._opened.wait(10)

    def _run(self) -> None:
        self._loop.run_until_complete(self._serve())
        self._loop.close()

    async def _serve(self) -> None:
        self._ending = asyncio.Event()
        server = await asyncio.start_server(self._carry, "127.0.0.1", 0, ssl=self._context)
        self.port = server.sockets[0].getsockname()[1]
        self._opened.set()
        await self._ending.wait()
        server.close()
        carrying = [task for task in asyncio.all_tasks() if task is not asyncio.current_task()]
        for task in carrying:
            task.cancel()
        await asyncio.gather(*carrying, return_exceptions=True)

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        there, here = await asyncio.open_connection("127.0.0.1", self._backend)
        with contextlib.suppress(OSError, asyncio.CancelledError):
            await asyncio.gather(_pump(reader, here), _pump(there, writer))
        for each in (here, writer):
            each.transport.abort()

    def close(self) -> None:
        self._loop.call_soon_threadsafe(self._ending.set)
        self._thread.join()


async def _pump(source: asyncio.StreamReader, sink: asyncio.StreamWriter) -> None:
    while data := await source.read(65536):
        sink.write(data)
        await sink.drain()
    raise ConnectionError("one side has ended")


@pytest.fixture
def proxied(tmp_path: Path) -> Iterator[str]:
    """Address of a server below a path, behind a proxy."""
    server = start_server(tmp_path, "--behind-proxy", "--root-path", "/arms/one")
    authority = LocalAuthority(tmp_path / "proxy" / FOLDER, machine_names)
    authority.prepare()
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(authority.server_file)
    port = urlsplit(server.url).port
    assert port is not None
    proxy = TlsProxy(port, context)
    yield f"https://localhost:{proxy.port}/arms/one/"
    proxy.close()
    stop_server(server)


def test_below_a_path_through_a_proxy(proxied: str, open_page: OpenPage) -> None:
    page = open_page(f"{proxied}?token={TOKEN}", untrusted=True)
    check_page(page)
    assert page.url == proxied
    page.goto(f"{proxied}trust")
    assert "Nothing to trust" in page.content()
