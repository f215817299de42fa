"""Driving in a browser over a slow link, and what a cut of it costs.

python -m benchmarks.slow_link [--runs 5] [--seconds 20] [--cut 3] [--save FILE]

The link is the tests' own proxy (``tests/slow_link.py``) with 75 ms and 2 Mbit/s each way, for all
of the page's connections together; ``--round-trip`` and ``--rate`` choose another. A webcam shows
``up`` again and again, the 3D view is hidden. Browser, server and robot share one machine and its
monotonic clock, so that ages are true ones:

- *picture age*: of what stands on the screen, looked at all the time, from when the robot stood so.
- *age as the page tells it*: minus the true one, when a picture is drawn.
- *frame to its answer*: from the webcam's picture to its ``frame`` message, by the page's average.
- *frame to command*: from the webcam's picture to the command for the robot node.
- *back*: from the restored link to a page that hears the robot again, without control and disarmed;
  from the cut it is this and the cut. ``reloads`` counts pages that were loaded anew.
"""

import tempfile
import time
from argparse import Namespace
from pathlib import Path
from urllib.parse import urlsplit

from playwright.sync_api import Page

from app.gestures.synthetic import Step
from benchmarks.driving import browser, webcam
from benchmarks.observer import Observer
from benchmarks.report import arguments, percentiles, promise, report
from tests.e2e.running import start_server, stop_server, wait_for
from tests.slow_link import SlowLink

CAMERAS = ("wrist", "scene")
AGE_MS = 500.0
BACK_S = 5.0
SETTLE_MS = 10_000
"""So long the page has to find what the link carries."""
_LOOK = """() => ({
    now: performance.now(), shown: window.farhand.shown, frames: window.farhand.frames,
    pictures: window.farhand.pictures,
})"""
_BACK = """(session) => {
    const { hello, robot, state } = window.farhand;
    return state.connection.state === "open" && hello.session !== session && robot !== null
        && !robot.armed && robot.controller === null;
}"""
_WATCH_FRAMES = """() => {
    // What FrameSender sends: header with number and capture time, then the picture.
    window.sentFrames = [];
    const send = WebSocket.prototype.send;
    WebSocket.prototype.send = function (data) {
        if (data instanceof ArrayBuffer) {
            const view = new DataView(data);
            const [seq, captured] = [view.getUint32(4, true), view.getFloat64(8, true)];
            window.sentFrames.push([seq, captured, data.byteLength]);
        }
        return send.call(this, data);
    };
}"""


def clock_offset_ms(page: Page) -> float:
    """This machine's monotonic clock minus the page's, ms, by the quickest of some questions."""
    found = []
    for _ in range(30):
        before = time.monotonic()
        there: float = page.evaluate("performance.now()")
        after = time.monotonic()
        found.append((after - before, (before + after) / 2 * 1e3 - there))
    return min(found)[1]


class Figures:
    """What was measured, over all runs."""

    def __init__(self) -> None:
        self.ages: dict[str, list[float]] = {name: [] for name in CAMERAS}
        self.errors: list[float] = []
        self.answers: list[float] = []
        self.commands: list[float] = []
        self.sizes: list[float] = []
        self.rates: dict[str, list[float]] = {name: [] for name in (*CAMERAS, "frames")}
        self.levels: list[int] = []
        self.back: list[float] = []
        self.up: list[float] = []
        self.down: list[float] = []
        self.reloads = 0
        self.moved = 0


def drive(page: Page, link: SlowLink, observer: Observer, seconds: float, figures: Figures) -> None:
    """Look at a page that drives."""
    offset = clock_offset_ms(page)
    page.evaluate(_WATCH_FRAMES)
    seen: dict[str, int] = {}
    first_command = len(observer.commands)
    heights = []
    first = page.evaluate(_LOOK)
    up, down = link.carried
    began = time.monotonic()
    while time.monotonic() - began < seconds:
        page.wait_for_timeout(20)
        look = page.evaluate(_LOOK)
        for name in CAMERAS:
            shown = look["shown"][name]
            figures.ages[name].append(look["now"] + offset - shown["tick"])
            if seen.get(name) != shown["tick"]:
                seen[name] = shown["tick"]
                figures.errors.append(shown["tick"] - (shown["takenAt"] + offset))
        figures.levels.append(look["frames"]["level"])
        if look["frames"]["latencyMs"] is not None:
            figures.answers.append(look["frames"]["latencyMs"])
        heights.append(observer.state.tool_position[2])
    took = time.monotonic() - began
    figures.up.append((link.carried[0] - up) * 8e-6 / took)
    figures.down.append((link.carried[1] - down) * 8e-6 / took)
    for name in CAMERAS:
        count = look["pictures"][name] - first["pictures"][name]
        figures.rates[name].append(count / took)
    figures.rates["frames"].append((look["frames"]["sent"] - first["frames"]["sent"]) / took)
    figures.moved += max(heights) - min(heights) > 0.01
    sent = {seq: captured + offset for seq, captured, _ in page.evaluate("window.sentFrames")}
    figures.sizes += [size for *_, size in page.evaluate("window.sentFrames")]
    for tick, command in observer.commands[first_command:]:
        if command.frame in sent:
            figures.commands.append(tick - sent[command.frame])


def cut(page: Page, link: SlowLink, seconds: float, figures: Figures) -> None:
    """Cut the link for a while, and wait for the page."""
    session = page.evaluate("window.farhand.hello.session")
    page.evaluate("window.sameDocument = true")
    link.hold()
    page.wait_for_timeout(seconds * 1e3)
    link.forward()
    restored = time.monotonic()
    while not page.evaluate(_BACK, session):
        if time.monotonic() - restored > 60:
            raise TimeoutError("the page did not come back")
        page.wait_for_timeout(10)
    figures.back.append(time.monotonic() - restored)
    figures.reloads += page.evaluate("window.sameDocument !== true")


def measure(folder: Path, options: Namespace) -> dict[str, dict[str, float | str]]:
    """All runs, each with a server and a browser of its own."""
    figures = Figures()
    video = webcam((Step(None, 1.0), Step("up", 2.0)), folder / "webcam.mjpeg")
    for number in range(options.runs):
        here = folder / str(number)
        here.mkdir()
        server = start_server(here)
        try:
            port = urlsplit(server.url).port
            assert port is not None
            way_s = options.round_trip / 2e3
            with (
                SlowLink(port, delay_s=way_s, rate=options.rate * 1e6 / 8) as link,
                Observer(server.endpoint()) as observer,
            ):
                direct = server.link
                server.link = direct.replace(server.url, f"http://127.0.0.1:{link.port}")
                with browser(server, video) as page:
                    wait_for(page, "Object.keys(window.farhand.shown).length === 2")
                    page.wait_for_timeout(SETTLE_MS)
                    drive(page, link, observer, options.seconds, figures)
                    cut(page, link, options.cut, figures)
        finally:
            stop_server(server)
    rows: dict[str, dict[str, float | str]] = {}
    for name in CAMERAS:
        ages = percentiles(figures.ages[name])
        kept = ages["p99"] < AGE_MS
        rows[f"{name}: picture age, ms"] = {
            **ages,
            "each s": sum(figures.rates[name]) / options.runs,
            **promise(f"p99 < {AGE_MS:g}", kept=kept),
        }
    rows["age as the page tells it minus the true one, ms"] = {**percentiles(figures.errors)}
    rows["frame to its answer, ms"] = {**percentiles(figures.answers)}
    rows["frame to command, ms"] = {
        **percentiles(figures.commands),
        "each s": sum(figures.rates["frames"]) / options.runs,
    }
    rows["carried up, Mbit/s"] = {**percentiles(figures.up)}
    rows["carried down, Mbit/s"] = {**percentiles(figures.down)}
    rows["webcam frame, kB"] = {**percentiles([size / 1e3 for size in figures.sizes])}
    rows["level of the frames, 0 the best"] = {**percentiles(figures.levels)}
    rows["runs in which the arm moved"] = {
        "n": figures.moved,
        **promise("all", kept=figures.moved == options.runs),
    }
    longest = max(figures.back) + options.cut
    rows[f"back after a cut of {options.cut:g} s, s from its end"] = {
        **percentiles(figures.back),
        "reloads": figures.reloads,
        **promise(
            f"{BACK_S:g} s from the cut on, no reload",
            kept=longest < BACK_S and not figures.reloads,
        ),
    }
    return rows


def main() -> None:
    parser = arguments(__doc__, runs=5)
    parser.add_argument("--seconds", type=float, default=20.0, help="of driving in each run")
    parser.add_argument("--cut", type=float, default=3.0, help="s")
    parser.add_argument("--round-trip", type=float, default=150.0, help="ms")
    parser.add_argument("--rate", type=float, default=2.0, help="Mbit/s each way")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        figures = measure(Path(folder), options)
    report(figures, options)


if __name__ == "__main__":
    main()
