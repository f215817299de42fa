"""Hand comes to rest -> first joint motion, the whole way, at 30 frames a second.

A real server with its robot node; a scripted operator sends the drawn hand's JPEGs over the
WebSocket as the page does. The start of the clock is the moment at which the first frame with the
hand at rest would have been captured (its turn in the 30 Hz schedule); the end is the first State
of the node, read on the link itself, in which a joint moves. All clocks are this machine's.

    python -m benchmarks.whole_way [--trials 40] [--save FILE]
"""

import asyncio
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

from app.gestures.synthetic import Step, SyntheticOperator
from app.link.gateway_end import GatewayEnd
from app.link.messages import State
from benchmarks.operator import Operator
from benchmarks.report import arguments, percentiles, report
from tests.e2e.running import TOKEN, Server, start_server, stop_server

RATE = 30
MOVES = ("up", "down", "left", "right", "forward", "back")
MOVING = 0.002
"""rad/s; at rest the joints measure well below."""


def clip(gesture: str) -> tuple[list[bytes], int]:
    """JPEGs of one showing of a gesture, and the index of the first with the hand at rest."""
    operator = SyntheticOperator((Step(None, 0.8), Step(gesture, 0.6), Step(None, 0.8)), fps=RATE)
    frames = [
        cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tobytes()
        for frame in operator.frames()
    ]
    return frames, round(operator.captions[0].start_s * RATE)


async def measure(server: Server, trials: int) -> dict[str, list[float]]:
    """Time one showing after another; ms."""
    moved_at: list[float] = []
    watching = False

    def on_state(state: State) -> None:
        if watching and not moved_at and np.abs(state.velocities).max() > MOVING:
            moved_at.append(time.monotonic())

    clips = {gesture: clip(gesture) for gesture in MOVES}
    whole: list[float] = []
    seen: list[float] = []
    server_time: list[float] = []
    with GatewayEnd("puma", server.endpoint(), on_state=on_state):
        async with Operator(server.url, TOKEN) as operator:
            await operator.take_and_arm()
            for trial in range(trials):
                frames, at_rest = clips[MOVES[trial % len(MOVES)]]
                moved_at.clear()
                watching = True
                gestures = len(operator.gestures)
                began = time.monotonic()
                await operator.play(frames, RATE)
                watching = False
                rest = began + at_rest / RATE
                if not moved_at:
                    raise RuntimeError(f"nothing moved; last frame: {operator.frames[-1]}")
                whole.append((moved_at[0] - rest) * 1e3)
                starts = [g for g in operator.gestures[gestures:] if g["phase"] == "start"]
                seen.append((starts[0]["received"] - rest) * 1e3)
            server_time = [f["timing_ms"]["total"] for f in operator.frames if "timing_ms" in f]
    return {"at rest -> event": seen, "at rest -> motion": whole, "pipeline": server_time}


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--trials", type=int, default=40)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        server = start_server(Path(folder))
        try:
            figures = asyncio.run(measure(server, options.trials))
        finally:
            stop_server(server)
    report({f"{name}, ms": percentiles(values) for name, values in figures.items()}, options)


if __name__ == "__main__":
    main()
