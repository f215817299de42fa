"""A bounded flood by strangers: does the one who drives notice?

An operator shows a gesture at 30 frames a second. By turns nobody else is there, and strangers
come, in a process of their own: 2,000 connections (some silent, some with half a head, some that
never read) and 10,000 requests (without and with wrong credentials, on connections kept and on new
ones, guesses at the sign-in form, heads without end), from several addresses of loopback, the
operator's among them. From sending a frame to its answer, which leaves the gateway after the
frame's command:

    python -m benchmarks.flood [--turns 4] [--seconds 15] [--save FILE]

Asked for: the 99th percentile at most 10% worse; the operator drives throughout, and a stop over
REST, on a new connection at the height of it, is confirmed.
"""

import argparse
import asyncio
import contextlib
import itertools
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import httpx
import psutil

from benchmarks.operator import Operator
from benchmarks.report import arguments, percentiles, promise, report
from benchmarks.rig import TOKEN, clip
from tests.e2e.running import Server, start_server, stop_server

CONNECTIONS = 2000
REQUESTS = 10_000
SOURCES = ("127.0.0.1", "127.0.0.2", "127.0.0.3", "127.0.0.4")
MOST_OPEN = 600
SETTLE_S = 2.0
WORSE = 1.1
HEADERS = {"Authorization": f"Bearer {TOKEN}"}


class Strangers:
    """Whoever comes unasked, from one process.

    Args:
        port: Of the server, on loopback.
    """

    def __init__(self, port: int) -> None:
        self._port = port
        self._open: list[asyncio.StreamWriter] = []
        self._sources = itertools.cycle(SOURCES)
        self.answers: Counter[int] = Counter()

    async def come(self, connections: int, requests: int, seconds: float) -> None:
        """So many connections and requests, evenly over the time."""
        async with asyncio.TaskGroup() as group:
            start = time.monotonic()
            for number in range(requests):
                await asyncio.sleep(start + number / requests * seconds - time.monotonic())
                group.create_task(self._ask(number))
                if number * connections // requests != (number + 1) * connections // requests:
                    group.create_task(self._hold(number))
        for writer in self._open:
            writer.close()
        self._open.clear()

    async def _connect(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        source = (next(self._sources), 0)
        return await asyncio.open_connection("127.0.0.1", self._port, local_addr=source)

    async def _hold(self, number: int) -> None:
        """A connection that takes a place."""
        with contextlib.suppress(OSError):
            _, writer = await self._connect()
            begun = (b"", self._head("/")[:-2], self._head("/") * 3)[number % 3]
            writer.write(begun)
            self._open.append(writer)
            if len(self._open) > MOST_OPEN:
                self._open.pop(0).close()

    async def _ask(self, number: int) -> None:
        """One request, and its answer."""
        with contextlib.suppress(OSError, TimeoutError, asyncio.IncompleteReadError):
            reader, writer = await self._connect()
            try:
                writer.write(self._request(number))
                async with asyncio.timeout(5):
                    line = await reader.readline()
                self.answers[int(line.split()[1]) if line else 0] += 1
            finally:
                writer.close()

    def _request(self, number: int) -> bytes:
        match number % 5:
            case 0:
                return self._head("/api/robots")
            case 1:
                return self._head("/", "Accept: text/html")
            case 2:
                return self._head("/api/robots", f"Authorization: Bearer guess-{number}")
            case 3:
                return self._head("/", *(f"Name-{each}: {'a' * 900}" for each in range(90)))
        form = f"token=guess-{number}".encode()
        return self._head("/signin", f"Content-Length: {len(form)}", method="POST") + form

    def _head(self, path: str, *lines: str, method: str = "GET") -> bytes:
        host = f"Host: 127.0.0.1:{self._port}"
        return "\r\n".join([f"{method} {path} HTTP/1.1", host, *lines, "", ""]).encode()


async def strangers(port: int) -> None:
    """Come when told to, in a process of its own: connections, requests, seconds on a line."""
    crowd = Strangers(port)
    print("here", flush=True)
    for line in sys.stdin:
        connections, requests, seconds = line.split()
        await crowd.come(int(connections), int(requests), float(seconds))
        print(dict(crowd.answers), flush=True)
        crowd.answers.clear()


async def measure(server: Server, options: argparse.Namespace) -> dict[str, dict[str, float | str]]:
    """The rows of the report."""
    pictures = clip("left").keep()
    gateway = psutil.Process(server.process.pid)
    took: dict[bool, list[float]] = {False: [], True: []}
    processor = {False: 0.0, True: 0.0}
    answers: Counter[str] = Counter()
    files = 0
    command = [sys.executable, "-m", "benchmarks.flood", "--strangers", server.url]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None and process.stdout is not None
        assert process.stdout.readline() == "here\n"
        async with Operator(server.url, TOKEN) as operator:
            await operator.take_and_arm()
            showing = asyncio.create_task(operator.play(pictures))
            for turn in range(2 * options.turns):
                flooded = turn % 2 == 1
                await asyncio.sleep(SETTLE_S)
                operator.frames.clear()
                before = sum(gateway.cpu_times()[:2])
                if flooded:
                    share = (CONNECTIONS // options.turns, REQUESTS // options.turns)
                    print(*share, options.seconds, file=process.stdin, flush=True)
                await asyncio.sleep(options.seconds)
                processor[flooded] += sum(gateway.cpu_times()[:2]) - before
                took[flooded] += [
                    1e3 * (f["received"] - f["sent"]) for f in operator.frames if f["sent"]
                ]
                files = max(files, gateway.num_fds())
                if flooded:
                    line = await asyncio.to_thread(process.stdout.readline)
                    answers += Counter(read_counts(line))
            driving = bool(operator.robot["controller"]) and bool(operator.robot["armed"])
            print(CONNECTIONS // 4, REQUESTS // 4, 5, file=process.stdin, flush=True)
            await asyncio.sleep(2.5)
            async with httpx.AsyncClient(base_url=server.url, headers=HEADERS) as api:
                began = time.monotonic()
                stopped = (await api.post("/api/robots/puma/stop")).status_code == 200
                stop_ms = 1e3 * (time.monotonic() - began)
            showing.cancel()
            await asyncio.gather(showing, return_exceptions=True)
        process.stdin.close()
    alone, meanwhile = (percentiles(took[flooded]) for flooded in (False, True))
    ratio = meanwhile["p99"] / alone["p99"]
    seconds = options.turns * options.seconds
    return {
        "frame to answer, alone, ms": {**alone, "processor": processor[False] / seconds},
        "the same, flooded": {**meanwhile, "processor": processor[True] / seconds},
        "p99, times": {"n": ratio, **promise(f"{WORSE:g}", kept=ratio <= WORSE)},
        "operator drives throughout": promise("yes", kept=driving),
        "stop over REST, ms": {"n": stop_ms, **promise("confirmed", kept=stopped)},
        "files open at most": {"n": files},
        "strangers' answers": {
            "n": answers.total(),
            **{status or "none": count for status, count in sorted(answers.items())},
        },
    }


def read_counts(line: str) -> dict[str, int]:
    """What the strangers said of their answers: ``{401: 3, 0: 2}``."""
    pairs = (pair.split(":") for pair in line.strip().strip("{}").split(",") if pair)
    return {key.strip(): int(count) for key, count in pairs}


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--turns", type=int, default=4, help="alone, and as often flooded")
    parser.add_argument("--seconds", type=float, default=15.0, help="of each")
    parser.add_argument("--strangers", metavar="URL", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.strangers:
        asyncio.run(strangers(int(options.strangers.rpartition(":")[2])))
        return
    with tempfile.TemporaryDirectory() as folder:
        server = start_server(Path(folder))
        try:
            rows = asyncio.run(measure(server, options))
        finally:
            stop_server(server)
    report(rows, options)


if __name__ == "__main__":
    main()
