"""What the 3D view costs the server: the gateway's share of a processor while somebody looks.

A program moves the tool to and fro by keys for as long as it is measured: first with nobody
looking at the 3D view, then with one who reads everything that viser sends (no browser: this
measures the server alone):

    python -m benchmarks.scene_cost [--seconds 20] [--save FILE]

Asked for: the view costs at most a tenth of one processor.
"""

import argparse
import asyncio
import contextlib
import itertools
import tempfile
import time
from collections.abc import AsyncIterator
from pathlib import Path

import msgspec
import psutil
import viser
from websockets.asyncio.client import connect
from websockets.typing import Subprotocol

from benchmarks.operator import Operator
from benchmarks.report import arguments, promise, report
from tests.e2e.running import TOKEN, Server, start_server, stop_server

MOST = 0.10
SETTLE_S = 4.0
JOG_EVERY_S = 0.05
TURN_EVERY_S = 1.5
SPEED = 0.1
"""m/s"""
CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (2.0, -1.6, 1.5),
    "fov": 0.8,
    "near": 0.01,
    "far": 100.0,
    "image_height": 480,
    "image_width": 640,
    "look_at": (0.2, 0.0, 0.6),
    "up_direction": (0.0, 0.0, 1.0),
}
"""Who has told viser where their camera is counts as somebody who looks."""


async def to_and_fro(operator: Operator) -> None:
    """Move the tool left and right by keys until cancelled."""
    turn = round(TURN_EVERY_S / JOG_EVERY_S)
    for number in itertools.count():
        way = SPEED if number // turn % 2 == 0 else -SPEED
        action = {"type": "jog_cartesian", "frame": "base", "linear": [0, way, 0]}
        hold = 1 + number // turn
        # Nothing is held for a moment between two directions, as between two keys.
        held = action if number % turn > 12 else None
        await operator.say("jog", hold=hold, action=held, tick=operator.tick)
        await asyncio.sleep(JOG_EVERY_S)


class Looker:
    """Counts what the 3D view sends."""

    def __init__(self) -> None:
        self.bytes = 0

    @contextlib.asynccontextmanager
    async def look(self, url: str) -> AsyncIterator["Looker"]:
        """Be connected as viser's own page is."""
        async with connect(
            url.replace("http", "ws", 1) + "/viser",
            additional_headers={"Authorization": f"Bearer {TOKEN}"},
            subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
            max_size=None,
        ) as socket:
            await socket.send(msgspec.msgpack.encode(CAMERA))

            async def read() -> None:
                async for message in socket:
                    self.bytes += len(message)

            reading = asyncio.create_task(read())
            yield self
            reading.cancel()
            await asyncio.gather(reading, return_exceptions=True)


def busy(process: psutil.Process) -> float:
    """Processor time that a process has used, s."""
    times = process.cpu_times()
    return times.user + times.system


async def share(process: psutil.Process, seconds: float) -> float:
    """Part of one processor that a process uses."""
    before, began = busy(process), time.monotonic()
    await asyncio.sleep(seconds)
    return (busy(process) - before) / (time.monotonic() - began)


async def both(server: Server, seconds: float) -> dict[str, dict[str, float | str]]:
    """The rows of the report."""
    gateway = psutil.Process(server.process.pid)
    async with Operator(server.url, TOKEN) as operator:
        await operator.take_and_arm()
        moving = asyncio.create_task(to_and_fro(operator))
        await operator.wait_for(lambda: operator.robot.get("mode") == "moving")
        await asyncio.sleep(SETTLE_S)
        alone = await share(gateway, seconds)
        async with Looker().look(server.url) as looker:
            await asyncio.sleep(SETTLE_S)
            looker.bytes = 0
            seen = await share(gateway, seconds)
            rate = looker.bytes / seconds
        moving.cancel()
        await asyncio.gather(moving, return_exceptions=True)
    view = seen - alone
    return {
        "nobody looks": {"share of a processor": alone},
        "one looks": {"share of a processor": seen, "kB/s sent": rate / 1e3},
        "the view": {"share of a processor": view, **promise(f"{MOST:g}", kept=view <= MOST)},
    }


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=20.0, help="each of the two")
    options: argparse.Namespace = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        server = start_server(Path(folder))
        try:
            rows = asyncio.run(both(server, options.seconds))
        finally:
            stop_server(server)
    report(rows, options)


if __name__ == "__main__":
    main()
