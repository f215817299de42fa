"""A real server, a real robot node and a real browser with a fake webcam."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx
import psutil
import pytest
from playwright.sync_api import Browser, ConsoleMessage, Page, Playwright, sync_playwright

ARTIFACTS = Path(__file__).parents[2] / "test-artifacts"
TOKEN = "end-to-end-token-0123456789abcdef"
BASE_ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-fake-device-for-media-stream",
]


@dataclass
class Server:
    """A running ``python -m app serve``."""

    process: subprocess.Popen[str]
    url: str
    link: str
    data_dir: Path
    log: Path

    def api(self) -> httpx.Client:
        return httpx.Client(
            base_url=self.url, headers={"Authorization": f"Bearer {TOKEN}"}, timeout=20
        )

    def node(self) -> psutil.Process:
        """The robot node, a child of the gateway."""
        for child in psutil.Process(self.process.pid).children():
            if "camera" not in " ".join(child.cmdline()):
                return child
        raise AssertionError("the gateway has no robot node")


def start_server(folder: Path, *options: str) -> Server:
    """Start a server on a free port and wait for its link."""
    log = folder / "server.log"
    with log.open("a") as stderr:
        process = subprocess.Popen(
            [
                sys.executable, "-m", "app", "serve", "--port", "0",
                "--data-dir", str(folder / "data"), "--token", TOKEN, *options,
            ],
            stdout=subprocess.PIPE,
            stderr=stderr,
            text=True,
            cwd=Path(__file__).parents[2],
        )  # fmt: skip
    assert process.stdout is not None
    for line in process.stdout:
        found = re.search(r"(https?://[^/\s]+)/\?token=\S+", line)
        if found:
            return Server(process, found[1], found[0], folder / "data", log)
    raise AssertionError(f"the server printed no link:\n{log.read_text()}")


def stop_server(server: Server) -> None:
    server.process.terminate()
    try:
        server.process.wait(20)
    except subprocess.TimeoutExpired:
        server.process.kill()
        raise
    finally:
        assert server.process.stdout is not None
        server.process.stdout.close()


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    running = start_server(tmp_path)
    yield running
    stop_server(running)


@pytest.fixture(scope="session")
def playwright() -> Iterator[Playwright]:
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


OpenPage = Callable[..., Page]


@pytest.fixture
def open_page(
    playwright: Playwright, chromium: str, request: pytest.FixtureRequest
) -> Iterator[OpenPage]:
    """Open a page in a fresh browser: ``open_page(url, webcam=video, width=1280)``.

    Console errors and uncaught exceptions fail the test, unless ``allow_errors`` is given. When
    the test fails, a screenshot and the page's HTML stay in test-artifacts/.
    """
    opened: list[tuple[Browser, Page]] = []
    errors: list[str] = []

    def open_(
        url: str,
        *,
        webcam: Path | None = None,
        camera_allowed: bool = True,
        width: int = 1280,
        height: int = 800,
        allow_errors: bool = False,
    ) -> Page:
        arguments = list(BASE_ARGUMENTS)
        if webcam is not None:
            arguments.append(f"--use-file-for-fake-video-capture={webcam}")
        if camera_allowed:
            arguments.append("--use-fake-ui-for-media-stream")
        browser = playwright.chromium.launch(executable_path=chromium, args=arguments)
        page = browser.new_page(viewport={"width": width, "height": height})
        opened.append((browser, page))
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
    for number, (browser, page) in enumerate(opened):
        if failed and not page.is_closed() and browser.is_connected():
            ARTIFACTS.mkdir(exist_ok=True)
            name = f"{request.node.name}-{number}"
            page.screenshot(path=ARTIFACTS / f"{name}.png")
            (ARTIFACTS / f"{name}.html").write_text(page.content())
        browser.close()
    assert not errors, errors


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    outcome = yield
    report = outcome.get_result()  # type: ignore[attr-defined]
    if report.when == "call":
        item.call_failed = report.failed  # type: ignore[attr-defined]
