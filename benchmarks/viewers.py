"""A hundred viewers, of whom twenty never read: does the one who drives notice?

An operator shows a gesture at 30 frames a second, first alone, then while a hundred clients, in a
process of their own on the same machine, look at the cameras in turn (without acknowledgements, so
that nothing is spared). From sending a frame to its answer, which leaves the gateway after the
frame's command; and the gateway's memory:

    python -m benchmarks.viewers [--seconds 300] [--viewers 100] [--idle 20] [--save FILE]

Asked for: the 99th percentile at most 10% worse; memory bounded.
"""

import argparse
import asyncio
import subprocess
import sys
import tempfile
from pathlib import Path

import psutil
from websockets.asyncio.client import connect

from benchmarks.operator import Operator
from benchmarks.report import arguments, percentiles, promise, report
from benchmarks.rig import TOKEN, clip
from tests.e2e.running import Server, start_server, stop_server

SETTLE_S = 5.0
WORSE = 1.1
HEADERS = {"Authorization": f"Bearer {TOKEN}"}


async def crowd(url: str, count: int, idle: int) -> None:
    """``count`` who look, the first ``idle`` of whom never read, until killed."""
    came = [0] * count
    opened = 0

    async def look(number: int) -> None:
        nonlocal opened
        path = f"{url.replace('http', 'ws', 1)}/ws/camera/{('wrist', 'scene')[number % 2]}"
        # One message waits in the library; what is more stays in the socket.
        options = {"max_queue": 1} if number < idle else {}
        async with connect(path, additional_headers=HEADERS, max_size=None, **options) as socket:  # type: ignore[arg-type]
            opened += 1
            if number < idle:
                await asyncio.Event().wait()
            async for _ in socket:
                came[number] += 1

    async with asyncio.TaskGroup() as group:
        for number in range(count):
            group.create_task(look(number))
        while opened < count:
            await asyncio.sleep(0.05)
        print("all here", flush=True)
        while True:
            before = sum(came)
            await asyncio.sleep(5)
            print((sum(came) - before) / 5 / max(1, count - idle), flush=True)


async def drive(server: Server, seconds: float) -> dict[str, float | str]:
    """Show a gesture; gives the times to the answers, ms, and the gateway's memory, MiB."""
    pictures = clip("left").keep()
    gateway = psutil.Process(server.process.pid)
    async with Operator(server.url, TOKEN) as operator:
        await operator.take_and_arm()
        showing = asyncio.create_task(operator.play(pictures))
        await asyncio.sleep(SETTLE_S)
        operator.frames.clear()
        before = gateway.memory_info().rss
        await asyncio.sleep(seconds)
        grown = gateway.memory_info().rss - before
        took = [1e3 * (f["received"] - f["sent"]) for f in operator.frames if f["sent"]]
        showing.cancel()
        await asyncio.gather(showing, return_exceptions=True)
    return {**percentiles(took), "frames a second": len(took) / seconds, "grown MiB": grown / 2**20}


def measure(options: argparse.Namespace) -> dict[str, dict[str, float | str]]:
    """The rows of the report."""
    with tempfile.TemporaryDirectory() as folder:
        server = start_server(Path(folder))
        try:
            alone = asyncio.run(drive(server, options.seconds))
            command = [sys.executable, "-m", "benchmarks.viewers", "--crowd", server.url]
            command += ["--viewers", str(options.viewers), "--idle", str(options.idle)]
            with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
                assert process.stdout is not None
                assert process.stdout.readline() == "all here\n"
                watched = asyncio.run(drive(server, options.seconds))
                process.terminate()
                rates = [float(line) for line in process.stdout]
        finally:
            stop_server(server)
    ratio = float(watched["p99"]) / float(alone["p99"])
    return {
        "alone": alone,
        f"{options.viewers} viewers, {options.idle} not reading": watched,
        "p99, times": {"n": ratio, **promise(f"{WORSE:g}", kept=ratio <= WORSE)},
        "pictures a second of one who reads": {**percentiles(rates)},
    }


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=300.0, help="alone, and once more watched")
    parser.add_argument("--viewers", type=int, default=100)
    parser.add_argument("--idle", type=int, default=20, help="of these do not read")
    parser.add_argument("--crowd", metavar="URL", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.crowd:
        asyncio.run(crowd(options.crowd, options.viewers, options.idle))
        return
    report(measure(options), options)


if __name__ == "__main__":
    main()
