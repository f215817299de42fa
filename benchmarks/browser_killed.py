"""The browser is killed while the arm moves: time to standstill, measured at the joints.

A real Chromium shows a gesture to the real server; when the arm moves at full speed, every process
of the browser is killed (SIGKILL). The clock starts at the kill and ends at the last State of the
node, read on the link itself, in which a joint still moved.

    python -m benchmarks.browser_killed [--trials 50] [--save FILE]
"""

import tempfile
import time
from pathlib import Path

import numpy as np

from app.gestures.synthetic import Step
from app.link.gateway_end import GatewayEnd
from app.link.messages import State
from benchmarks.driving import browser, kill_browser, webcam
from benchmarks.report import arguments, percentiles, report
from tests.e2e.running import Server, start_server, stop_server

MOVING = 0.002
"""rad/s; at rest the joints measure well below."""
FULL_SPEED_M_S = 0.08
"""The starter gestures jog at 0.10 m/s."""


def one_kill(server: Server, video: Path) -> float:
    """Drive, kill, and return ms from the kill to the last motion.

    Raises:
        RuntimeError: the arm moved again by itself.
    """
    states: list[tuple[float, State]] = []
    with (
        GatewayEnd(
            "puma", server.endpoint(), on_state=lambda s: states.append((time.monotonic(), s))
        ),
        browser(server, video),
    ):
        deadline = time.monotonic() + 60
        while not _at_full_speed(states):
            if time.monotonic() > deadline:
                raise RuntimeError("the arm did not reach full speed within 60 s")
            time.sleep(0.005)
        kill_browser()
        killed = time.monotonic()
        time.sleep(3.0)
    last = max((at for at, state in states if _moves(state)), default=killed)
    if last - killed > 2.0:
        raise RuntimeError("the arm was still moving two seconds after the kill")
    return max(0.0, last - killed) * 1e3


def _moves(state: State) -> bool:
    return bool(np.abs(state.velocities).max() > MOVING)


def _at_full_speed(states: list[tuple[float, State]]) -> bool:
    recent = states[-6:]
    if len(recent) < 6:
        return False
    (began, first), (ended, last) = recent[0], recent[-1]
    way = np.linalg.norm(np.subtract(last.tool_position, first.tool_position))
    return bool(way / max(ended - began, 1e-3) > FULL_SPEED_M_S)


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--trials", type=int, default=50)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        # To and fro, so that the arm stays within its reach over all trials.
        videos = [
            webcam((Step(None, 0.6), Step(name, 3.0)), Path(folder) / f"{name}.mjpeg")
            for name in ("left", "right")
        ]
        server = start_server(Path(folder))
        times = []
        try:
            for trial in range(options.trials):
                times.append(one_kill(server, videos[trial % 2]))
                print(f"{trial + 1}: {times[-1]:.0f} ms", flush=True)
        finally:
            stop_server(server)
    report({"kill -> standstill, ms": percentiles(times)}, options)


if __name__ == "__main__":
    main()
