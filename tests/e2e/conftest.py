"""A real server, a real robot node and a real browser with a fake webcam."""

import itertools
import os
import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import (
    Browser,
    ConsoleMessage,
    Page,
    Playwright,
    expect,
    sync_playwright,
)

from tests.e2e.running import (
    BASE_ARGUMENTS,
    PATIENCE_S,
    STATIC,
    Server,
    start_server,
    stop_server,
)

expect.set_options(timeout=PATIENCE_S * 1e3)

ARTIFACTS = Path(__file__).parents[2] / "test-artifacts"


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    running = start_server(tmp_path)
    yield running
    stop_server(running)


@pytest.fixture(scope="module")
def one_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server for all tests of a file; see :func:`tests.e2e.running.put_at_rest`."""
    running = start_server(tmp_path_factory.mktemp("server"))
    yield running
    stop_server(running)


@pytest.fixture(scope="module")
def playwright() -> Iterator[Playwright]:
    """Ends with its module: while it runs, this thread has an event loop, and others must not."""
    with sync_playwright() as instance:
        yield instance


@pytest.fixture(scope="session")
def chromium() -> str:
    """Path of the installed Chromium; where CI asks for a browser, missing it is a failure."""
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None:
        reason = "no Chromium on this machine (Debian: apt-get install chromium)"
        if os.environ.get("FARHAND_REQUIRE_BROWSER"):
            pytest.fail(reason)
        pytest.skip(reason)
    return path


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: Any) -> None:
        pass


@contextmanager
def page_of_modules(playwright: Playwright, chromium: str) -> Iterator[Page]:
    """An HTML page (the server's "not found") of the same origin as the modules."""
    handler = partial(_Quiet, directory=str(STATIC.parent))
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    browser = playwright.chromium.launch(executable_path=chromium, args=list(BASE_ARGUMENTS))
    page = browser.new_page()
    page.goto(f"http://127.0.0.1:{server.server_address[1]}/none")
    yield page
    browser.close()
    server.shutdown()
    server.server_close()
    thread.join()


@pytest.fixture(scope="module")
def modules(playwright: Playwright, chromium: str) -> Iterator[Page]:
    """The page's modules by themselves; for more than one file see units/."""
    with page_of_modules(playwright, chromium) as page:
        yield page


class Browsers:
    """Browsers that were started, for one page after another: each page is a profile of its own.

    One that shows a page is given to no other, so that two people have two browsers.
    """

    def __init__(self, playwright: Playwright, path: str) -> None:
        self._playwright = playwright
        self._path = path
        self._idle: dict[tuple[str, ...], list[Browser]] = {}

    def take(self, *arguments: str) -> Browser:
        """One that was started with these arguments."""
        idle = self._idle.setdefault(arguments, [])
        while idle:
            if (browser := idle.pop()).is_connected():
                return browser
        return self._playwright.chromium.launch(
            executable_path=self._path, args=[*BASE_ARGUMENTS, *arguments]
        )

    def give_back(self, browser: Browser, *arguments: str) -> None:
        if browser.is_connected():
            for context in browser.contexts:
                context.close()
            self._idle[arguments].append(browser)

    def close(self) -> None:
        for browser in itertools.chain.from_iterable(self._idle.values()):
            browser.close()


@pytest.fixture(scope="module")
def browsers(playwright: Playwright, chromium: str) -> Iterator[Browsers]:
    started = Browsers(playwright, chromium)
    yield started
    started.close()


OpenPage = Callable[..., Page]


@pytest.fixture
def open_page(browsers: Browsers, request: pytest.FixtureRequest) -> Iterator[OpenPage]:
    """Open a page in a fresh profile: ``open_page(url, webcam=video, width=1280)``.

    Console errors and uncaught exceptions fail the test, unless ``allow_errors`` is given. When
    the test fails, a screenshot and the page's HTML stay in test-artifacts/.
    """
    opened: list[tuple[Browser, tuple[str, ...], Page]] = []
    errors: list[str] = []

    def open_(
        url: str,
        *,
        webcam: Path | None = None,
        camera_allowed: bool = True,
        width: int = 1280,
        height: int = 800,
        allow_errors: bool = False,
        untrusted: bool = False,
    ) -> Page:
        arguments: list[str] = []
        if webcam is not None:
            arguments.append(f"--use-file-for-fake-video-capture={webcam}")
        if untrusted:
            arguments.append("--ignore-certificate-errors")
        if camera_allowed:
            arguments.append("--use-fake-ui-for-media-stream")
        browser = browsers.take(*arguments)
        page = browser.new_page(viewport={"width": width, "height": height})
        page.set_default_timeout(PATIENCE_S * 1e3)
        opened.append((browser, tuple(arguments), page))
        if not allow_errors:

            def on_console(message: ConsoleMessage) -> None:
                # viser's own page is not ours to mend.
                if message.type == "error" and "/viser/" not in message.location.get("url", ""):
                    errors.append(f"{message.text} ({message.location.get('url')})")

            page.on("console", on_console)
            page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(url)
        return page

    yield open_
    failed = getattr(request.node, "call_failed", False)
    for number, (browser, arguments, page) in enumerate(opened):
        if failed and not page.is_closed() and browser.is_connected():
            ARTIFACTS.mkdir(exist_ok=True)
            name = f"{request.node.name}-{number}"
            page.screenshot(path=ARTIFACTS / f"{name}.png")
            (ARTIFACTS / f"{name}.html").write_text(page.content())
        browsers.give_back(browser, *arguments)
    assert not errors, errors


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    outcome = yield
    report = outcome.get_result()  # type: ignore[attr-defined]
    if report.when == "call":
        item.call_failed = report.failed  # type: ignore[attr-defined]
