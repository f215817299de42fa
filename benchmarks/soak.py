"""Minutes of driving at 30 frames a second: frames processed, latency and memory over time.

python -m benchmarks.soak [--minutes 10] [--save FILE]
"""

import asyncio
import itertools
import tempfile
import time
from pathlib import Path

import cv2
import psutil

from app.gestures.synthetic import CLIP, SyntheticOperator
from benchmarks.operator import Operator
from benchmarks.report import arguments, percentiles, report
from tests.e2e.running import TOKEN, Server, start_server, stop_server

RATE = 30


def memory(server: Server) -> float:
    """Resident memory of the gateway and all its children, MiB."""
    gateway = psutil.Process(server.process.pid)
    processes = [gateway, *gateway.children(recursive=True)]
    return float(sum(process.memory_info().rss for process in processes)) / 2**20


async def measure(server: Server, minutes: float) -> dict[str, dict[str, float]]:
    """Play the demonstration over and over; a row a minute."""
    pictures = [
        cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tobytes()
        for frame in SyntheticOperator(CLIP, fps=RATE).frames()
    ]
    rows: dict[str, dict[str, float]] = {}
    async with Operator(server.url, TOKEN) as operator:
        await operator.take_and_arm()
        endless = itertools.cycle(pictures)
        for minute in range(1, max(1, round(minutes)) + 1):
            operator.frames.clear()
            skipped = operator.skipped
            began = time.monotonic()
            await operator.play([next(endless) for _ in range(60 * RATE)], RATE)
            seconds = time.monotonic() - began
            answers = [(f["received"] - f["sent"]) * 1e3 for f in operator.frames if f.get("sent")]
            rows[f"minute {minute}"] = {
                "frames/s": len(operator.frames) / seconds,
                "skipped": operator.skipped - skipped,
                **{f"answer_{k}_ms": v for k, v in percentiles(answers).items() if k != "n"},
                "pipeline_p50_ms": percentiles([f["timing_ms"]["total"] for f in operator.frames])[
                    "p50"
                ],
                "memory_MiB": memory(server),
            }
            print(f"minute {minute}", rows[f"minute {minute}"], flush=True)
    return rows


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        server = start_server(Path(folder))
        try:
            rows = asyncio.run(measure(server, options.minutes))
        finally:
            stop_server(server)
    report(rows, options)


if __name__ == "__main__":
    main()
