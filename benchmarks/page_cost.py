"""What the page costs the operator's computer while it drives: main thread, memory, DOM.

Chromium, without a graphics card, drives by a webcam of 30 frames a second with the 3D view hidden:

    python -m benchmarks.page_cost [--seconds 60] [--glass] [--profile] [--save FILE]

Every ten seconds garbage is collected, and heap, DOM nodes and listeners are counted; what that
takes is not counted as the page's work. ``busy`` is the part of the time in which the main thread
runs a task (what Chromium calls TaskDuration), ``processor`` the part in which it also has a
processor: on a machine that does other things at once the first is larger. Needs Chromium.

Asked for: busy below 0.30; no growth from the first third of the time to the last (5% of the heap
and of the nodes is measuring error). Six samples or fewer say nothing about growth.
"""

import argparse
import statistics
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from playwright.sync_api import CDPSession, Page

from app.gestures.synthetic import Step
from benchmarks.driving import browser, webcam
from benchmarks.report import Row, arguments, promise, report
from tests.e2e.running import start_server, stop_server

MOST_BUSY = 0.30
GROWTH = 1.05
WARM_UP_S = 10.0
EVERY_S = 10.0
FEWEST_SAMPLES = 9
SCRIPT = (Step(None, 0.8), Step("left", 2.0), Step(None, 0.8), Step("right", 2.0))
COUNTED = {"heap, MB": "JSHeapUsedSize", "DOM nodes": "Nodes", "listeners": "JSEventListeners"}
TIMES = {
    "busy": "TaskDuration",
    "of it scripts": "ScriptDuration",
    "of it styles": "RecalcStyleDuration",
    "of it layout": "LayoutDuration",
}
MOST_FUNCTIONS = 12


class Clock:
    """Reads Chromium's own counters, in wall time or in the main thread's processor time."""

    def __init__(self, page: Page, domain: str) -> None:
        self.session: CDPSession = page.context.new_cdp_session(page)
        self.session.send("Performance.enable", {"timeDomain": domain})

    def read(self) -> dict[str, float]:
        """All counters by their names; times in s."""
        metrics = self.session.send("Performance.getMetrics")["metrics"]
        return {metric["name"]: metric["value"] for metric in metrics}


class Watch:
    """Samples a page that drives."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._clocks = {"wall": Clock(page, "timeTicks"), "processor": Clock(page, "threadTicks")}
        self._spent: defaultdict[tuple[str, str], float] = defaultdict(float)
        self._seconds = 0.0
        self._frames = 0
        self.samples: list[dict[str, float]] = []

    def go_on(self, seconds: float) -> None:
        """Let it drive, and count."""
        frames = self._sent()
        before = {name: clock.read() for name, clock in self._clocks.items()}
        began = before["wall"]["Timestamp"]
        self._page.wait_for_timeout(1000 * seconds)
        for name, clock in self._clocks.items():
            after = clock.read()
            for counter in TIMES.values():
                self._spent[name, counter] += after[counter] - before[name][counter]
            if name == "wall":
                self._seconds += after["Timestamp"] - began
        self._frames += self._sent() - frames
        session = self._clocks["wall"].session
        session.send("HeapProfiler.collectGarbage")
        now = self._clocks["wall"].read()
        self.samples.append({row: now[counter] for row, counter in COUNTED.items()})
        self.samples[-1]["heap, MB"] /= 1e6

    def rows(self) -> dict[str, Row]:
        """The rows of the report."""
        share = {key: spent / self._seconds for key, spent in self._spent.items()}
        rows: dict[str, dict[str, float | str]] = {
            row: {
                "part of the time": share["wall", counter],
                "processor": share["processor", counter],
            }
            for row, counter in TIMES.items()
        }
        busy = share["wall", "TaskDuration"]
        rows["busy"] |= promise(f"{MOST_BUSY:g}", kept=busy < MOST_BUSY)
        for row in COUNTED:
            rows[row] = grown([sample[row] for sample in self.samples])
        rows["frames sent a second"] = {"n": self._frames / self._seconds}
        return dict(rows)

    def _sent(self) -> int:
        return int(self._page.evaluate("window.farhand.frames.sent"))


def grown(values: list[float]) -> dict[str, float | str]:
    """First and last thirds of what was counted, held against one another."""
    third = max(1, len(values) // 3)
    first, last = statistics.median(values[:third]), statistics.median(values[-third:])
    row: dict[str, float | str] = {"n": len(values), "first": first, "last": last}
    if len(values) >= FEWEST_SAMPLES:
        row |= promise(f"{first * GROWTH:.4g}", kept=last <= first * GROWTH)
    return row


def costliest(profile: dict[str, Any]) -> Iterable[tuple[str, float]]:
    """Functions by their own part of a profile's samples, the costliest first."""
    hits: Counter[str] = Counter()
    for node in profile["nodes"]:
        frame = node["callFrame"]
        place = frame["url"].rsplit("/static/", 1)[-1]
        hits[f"{frame['functionName'] or '(unnamed)'} {place}:{frame['lineNumber'] + 1}"] += node[
            "hitCount"
        ]
    total = sum(hits.values())
    return [(name, count / total) for name, count in hits.most_common(MOST_FUNCTIONS)]


def measure(options: argparse.Namespace) -> dict[str, Row]:
    """Drive, and count."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        video = webcam(SCRIPT, folder / "webcam.mjpeg")
        server = start_server(folder)
        try:
            with browser(server, video) as page:
                if options.glass:
                    page.click("#glass-toggle")
                page.wait_for_timeout(1000 * WARM_UP_S)
                watch = Watch(page)
                profiler = page.context.new_cdp_session(page)
                if options.profile:
                    profiler.send("Profiler.enable")
                    profiler.send("Profiler.start")
                for _ in range(max(1, round(options.seconds / EVERY_S))):
                    watch.go_on(EVERY_S)
                if options.profile:
                    for function, part in costliest(profiler.send("Profiler.stop")["profile"]):
                        print(f"{part:6.1%}  {function}")
                return watch.rows()
        finally:
            stop_server(server)


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="of driving (600 for growth)")
    parser.add_argument("--glass", action="store_true", help="with the glass box open")
    parser.add_argument("--profile", action="store_true", help="also say which functions cost most")
    options = parser.parse_args()
    report(measure(options), options)


if __name__ == "__main__":
    main()
