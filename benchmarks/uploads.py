"""Frames and a stop that is shown, while others upload large pictures, import and evaluate.

One operator shows a gesture at 30 frames a second, with control; another one shows *stop*, again
and again. First alone; then while eight clients upload pictures of 12 million pixels, one imports a
gallery and one has a gallery tried, each without end. Times are taken in this process: from just
before a frame is sent to its command on the robot's link, and from the first frame that shows
*stop* to the stop there.

    python -m benchmarks.uploads [--seconds 40] [--stops 20] [--before FOLDER] [--save FILE]

``--before``: a checkout of an older version, which is measured first, in the same run.
"""

import argparse
import asyncio
import contextlib
import itertools
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import httpx
import numpy as np

from app.gestures import NewGesture, read_set
from app.gestures.hand import POSES, HandView, render_hand
from app.gestures.setwriter import zip_stream
from app.link.messages import Command, key
from app.link.session import open_session
from benchmarks.observer import wait
from benchmarks.operator import Operator
from benchmarks.report import Row, arguments, percentiles, promise, report
from benchmarks.rig import clip
from tests.e2e.running import ROOT, TOKEN, Server, start_server, stop_server

UPLOADERS = 8
SIZE = (4000, 3000)
GROWTH = 1.2
"""The 99th percentile under load, in parts of that without; scheduling included."""
HEADERS = {"Authorization": f"Bearer {TOKEN}"}
LONGEST_S = 20.0
"""A stop that has not come by then counts as this long."""
REST_S = 0.7
"""Without a hand before *stop* is shown."""


def pictures() -> list[tuple[str, bytes, str]]:
    """Files of twelve million pixels: a drawn hand as JPEG and as PNG, each below 4 MiB."""
    hand = cv2.resize(render_hand(POSES["stop"], view=HandView(270.0)), SIZE)
    noise = np.random.default_rng(1).integers(0, 12, hand.shape, np.uint8)
    jpeg = cv2.imencode(".jpg", cv2.add(hand, noise), [cv2.IMWRITE_JPEG_QUALITY, 70])[1].tobytes()
    png = cv2.imencode(".png", hand)[1].tobytes()
    return [("x.jpg", jpeg, "image/jpeg"), ("x.png", png, "image/png")]


async def load(url: str) -> None:
    """Uploads, an import and an evaluation without end, until killed; in a process of its own."""
    files = pictures()
    small = [
        NewGesture(f"{entry.name} {number}", entry.action, entry.templates)
        for number in range(10)
        for entry in read_set(ROOT / "gesture_db")
    ]
    archive = b"".join(zip_stream(small))
    async with httpx.AsyncClient(base_url=url, headers=HEADERS, timeout=300) as api:
        galleries = [
            (await api.post("/api/galleries", json={"name": f"load {n}"})).json()["id"]
            for n in range(2)
        ]
        begun = asyncio.Event()

        async def upload(file: tuple[str, bytes, str]) -> None:
            while True:
                await api.post("/api/gestures/check", files=[("images", file)])
                begun.set()

        async def job(path: str, **options: object) -> None:
            while True:
                started = (await api.post(path, **options)).json()  # type: ignore[arg-type]
                while "id" in started and started["state"] == "running":
                    await asyncio.sleep(0.5)
                    started = (await api.get(f"/api/jobs/{started['id']}")).json()
                await asyncio.sleep(0.1)

        async with asyncio.TaskGroup() as group:
            for number in range(UPLOADERS):
                group.create_task(upload(files[number % len(files)]))
            path = f"/api/galleries/{galleries[0]}/import"
            kind = {"Content-Type": "application/zip"}
            group.create_task(job(path, content=archive, headers=kind))
            group.create_task(job(f"/api/galleries/{galleries[1]}/matrix"))
            await begun.wait()
            print("loads", flush=True)


@contextmanager
def loaded(url: str) -> Iterator[None]:
    """The load is there."""
    process = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.uploads", "--load", url],
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )
    assert process.stdout is not None
    try:
        if process.stdout.readline() != "loads\n":
            raise RuntimeError("the load did not begin")
        yield
        if process.poll() is not None:
            raise RuntimeError("the load ended before the end")
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


class Link:
    """What passes on the robot's link, with the time at which it was seen here."""

    def __init__(self, endpoint: str) -> None:
        self.commands: dict[int, float] = {}
        self.stops: list[float] = []
        self._session = open_session(endpoint, listen=False)
        self._commands = self._session.declare_subscriber(key("puma", "command"), self._command)
        self._stops = self._session.declare_subscriber(key("puma", "stop"), self._stop)

    def _command(self, sample: object) -> None:
        now = time.monotonic()
        command = Command.model_validate_json(sample.payload.to_bytes())  # type: ignore[attr-defined]
        if command.frame is not None:
            self.commands.setdefault(command.frame, now)

    def _stop(self, _sample: object) -> None:
        self.stops.append(time.monotonic())

    def close(self) -> None:
        """End it."""
        self._session.close()  # type: ignore[no-untyped-call]


async def frames(url: str, link: Link, seconds: float) -> list[float]:
    """Frame to command, ms, for so long."""
    took: list[float] = []
    async with Operator(url, TOKEN) as operator:
        await operator.take_and_arm()
        link.commands.clear()
        sent: dict[int, float] = {}
        until = time.monotonic() + seconds
        start, shown = time.monotonic(), clip("left").shown()
        for index in itertools.count():
            now = time.monotonic()
            if now >= until:
                break
            await asyncio.sleep(max(0.0, start + index / 30 - now))
            before = time.monotonic()
            number = await operator.show(next(shown))
            if number >= 0:
                sent[number] = before
        await asyncio.sleep(2.0)
        took += [
            (link.commands[number] - before) * 1e3
            for number, before in sent.items()
            if number in link.commands
        ]
    return took


async def stops(url: str, server: Server, link: Link, count: int) -> list[float]:
    """*stop* at rest in the picture to the stop on the link, ms, so many times."""
    took: list[float] = []
    held = clip("stop").held
    nothing = clip("stop").before[0]
    async with Operator(url, TOKEN) as operator:
        for _ in range(count):
            await operator.play([nothing] * round(30 * REST_S))
            link.stops.clear()
            began = time.monotonic()
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(LONGEST_S):
                    await operator.play(itertools.cycle(held), until=lambda: link.stops)
            took.append(((link.stops or [time.monotonic()])[0] - began) * 1e3)
            await asyncio.sleep(0.5)
            with server.api() as api:
                wait(lambda: api.post("/api/robots/puma/reset").status_code == 200, "a reset", 60)
    return took


def phase(server: Server, seconds: float, count: int) -> tuple[list[float], list[float]]:
    """Frame to command, and *stop* to stop, ms."""
    link = Link(server.endpoint())
    try:
        took = asyncio.run(frames(server.url, link, seconds))
        stopped = asyncio.run(stops(server.url, server, link, count))
        print(f"{percentiles(took)}, {percentiles(stopped)}", file=sys.stderr, flush=True)
        return took, stopped
    finally:
        link.close()


def measure(name: str, code: Path, seconds: float, count: int) -> dict[str, Row]:
    """The rows of one version."""
    rows: dict[str, Row] = {}
    with tempfile.TemporaryDirectory() as folder:
        server = start_server(Path(folder), cwd=code)
        try:
            quiet = phase(server, seconds, count)
            with loaded(server.url):
                busy = phase(server, seconds, count)
        finally:
            stop_server(server)
    for what, alone, beside in zip(("frame to command", "stop shown"), quiet, busy, strict=True):
        before, after = percentiles(alone), percentiles(beside)
        rows[f"{name}{what}, ms, alone"] = before
        asked: dict[str, str] = {}
        if not name and "p99" in before and "p99" in after:
            kept = after["p99"] <= GROWTH * before["p99"]
            asked = promise(f"99th percentile at most {GROWTH:g} times", kept=kept)
        rows[f"{name}{what}, ms, beside uploads"] = {**after, **asked}
    return rows


def main() -> None:
    """Measure and report."""
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=40.0, help="of frames, each time")
    parser.add_argument("--stops", type=int, default=20, help="so many, each time")
    parser.add_argument("--before", type=Path, help="a checkout of an older version")
    parser.add_argument("--load", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.load:
        asyncio.run(load(options.load))
        return
    rows: dict[str, Row] = {}
    if options.before is not None:
        rows |= measure("before: ", options.before, options.seconds, options.stops)
    report(rows | measure("", ROOT, options.seconds, options.stops), options)


if __name__ == "__main__":
    main()
