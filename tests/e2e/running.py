"""A real server with its robot node, for the browser tests and the benchmarks."""

import re
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import psutil
from playwright.sync_api import Page

ROOT = Path(__file__).parents[2]
STATIC = ROOT / "app" / "static"
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


PATIENCE_S = 120.0
"""How long a page or a server is waited for; a slow machine may take its time."""

AT_HOME = 0.02
"""rad; the brakes let the arm sink by less."""


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
            base_url=self.url, headers={"Authorization": f"Bearer {TOKEN}"}, timeout=60
        )

    def node(self) -> psutil.Process:
        """The robot node, a child of the gateway."""
        for child in psutil.Process(self.process.pid).children():
            if "--endpoint" in child.cmdline():
                return child
        raise AssertionError("the gateway has no robot node")

    def endpoint(self) -> str:
        """The Zenoh endpoint that the robot node listens on."""
        words = self.node().cmdline()
        return words[words.index("--endpoint") + 1]


def start_server(
    folder: Path,
    *options: str,
    cwd: Path = ROOT,
    env: dict[str, str] | None = None,
    stderr: int | None = None,
    files: int | None = None,
) -> Server:
    """Start a server on a free port and wait for its link.

    Args:
        folder: For its data and log.
        *options: Of the command line.
        cwd: Where it runs.
        env: Its environment.
        stderr: What it logs to, if not to a file.
        files: How many it may open.
    """

    def limit() -> None:
        if files is not None:
            resource.setrlimit(resource.RLIMIT_NOFILE, (files, files))

    log = folder / "server.log"
    with log.open("a") as file:
        process = subprocess.Popen(
            [
                sys.executable, "-m", "app", "serve", "--port", "0",
                "--data-dir", str(folder / "data"), "--token", TOKEN, *options,
            ],
            stdout=subprocess.PIPE,
            stderr=file if stderr is None else stderr,
            text=True,
            cwd=cwd,
            env=env,
            preexec_fn=None if files is None else limit,
        )  # fmt: skip
    assert process.stdout is not None
    for line in process.stdout:
        found = re.search(r"(https?://[^/\s]+)\S*/\?token=\S+", line)
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


def put_at_rest(server: Server, seconds: float = PATIENCE_S) -> None:
    """Bring a server's robot back to where it is after a start: disarmed, at home, nobody's.

    For the next test on the same server. Moves no arm: a node whose arm is elsewhere is killed, and
    the next one begins at home.

    Raises:
        TimeoutError: the robot did not get there.
    """
    deadline = time.monotonic() + seconds
    with server.api() as api:

        def until(what: str, so: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
            while not so(robot := api.get("/api/robots/puma").json()):
                if time.monotonic() > deadline:
                    raise TimeoutError(f"not {what} within {seconds:g} s: {robot}")
                time.sleep(0.05)
            return dict(robot)

        until("free", lambda robot: robot["online"] and robot["controller"] is None)
        # Refused while the arm still moves.
        until("reset", lambda _: api.post("/api/robots/puma/reset").status_code == 200)
        robot = until("described", lambda robot: robot["description"] and robot["state"])
        home = robot["description"]["poses"]["home"]
        here = robot["state"]["joints"]
        if max(abs(a - b) for a, b in zip(here, home, strict=True)) > AT_HOME:
            before = robot["restarts"]
            server.node().kill()
            until("back", lambda robot: robot["restarts"] > before and robot["online"])
        until("disarmed", lambda robot: robot["mode"] == "disarmed" and robot["fault"] is None)


def wait_for(page: Page, expression: str, seconds: float = PATIENCE_S) -> None:
    """Wait until a JavaScript expression is true on the page.

    Playwright's own ``wait_for_function`` evaluates text inside the page, which the page's content
    security policy rightly refuses.

    Raises:
        TimeoutError: it did not become true.
    """
    deadline = time.monotonic() + seconds
    while not page.evaluate(expression):
        if time.monotonic() > deadline:
            robot = page.evaluate("JSON.stringify(window.farhand?.robot)")
            raise TimeoutError(f"not true within {seconds:g} s: {expression}\nrobot: {robot}")
        page.wait_for_timeout(20)


MINE = "window.farhand.robot.controller === window.farhand.hello.session"
ARMED = "window.farhand.robot.armed"


Click = Callable[[Page, str], object]


def press_until(
    page: Page,
    button: str,
    expression: str,
    seconds: float = PATIENCE_S,
    click: Click = Page.click,
) -> None:
    """Press a button as a person does: again, where it has brought nothing.

    On a starved machine the robot may be silent for a moment, and then nothing can be asked of it.

    Raises:
        TimeoutError: the JavaScript expression did not become true.
    """
    give_up = time.monotonic() + seconds
    while not page.evaluate(expression):
        click(page, button)
        try:
            wait_for(page, expression, 5)
        except TimeoutError:
            if time.monotonic() > give_up:
                raise


def take_and_arm(page: Page, click: Click = Page.click) -> None:
    """Become who drives, and arm."""
    while not page.evaluate(ARMED):
        press_until(page, "#btn-control", MINE, click=click)
        with suppress(TimeoutError):
            press_until(page, "#btn-arm", f"{ARMED} || !({MINE})", 20, click)


def run(page: Page, module: str, script: str, argument: Any = None) -> Any:
    """Evaluate ``script`` with the exports of ``module`` as ``m`` and ``argument`` as ``a``."""
    return page.evaluate(
        f"async (a) => {{ const m = await import('/static/{module}'); {script} }}", argument
    )
