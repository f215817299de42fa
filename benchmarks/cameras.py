"""Wrist and scene pictures to a browser that drives, and the node's loop meanwhile.

python -m benchmarks.cameras [--seconds 30] [--view-3d] [--save FILE]
"""

import tempfile
import time
from pathlib import Path

from app.gestures.synthetic import CLIP
from app.link.gateway_end import GatewayEnd
from app.link.messages import State
from benchmarks.driving import browser, webcam
from benchmarks.report import arguments, report
from tests.e2e.running import start_server, stop_server, wait_for


def measure(folder: Path, seconds: float, view_3d: bool) -> dict[str, dict[str, float]]:
    """Count what the page shows, and watch the loop's own report."""
    loops: list[tuple[float, float]] = []

    def on_state(state: State) -> None:
        if state.loop is not None:
            loops.append((state.loop.rate_hz, state.loop.late_max_ms))

    video = webcam(CLIP, folder / "webcam.mjpeg")
    server = start_server(folder)
    try:
        with browser(server, video, view_3d=view_3d) as page:
            wait_for(
                page, "window.farhand.pictures.wrist > 20 && window.farhand.pictures.scene > 20"
            )
            with GatewayEnd("puma", server.endpoint(), on_state=on_state):
                before = page.evaluate(
                    "({...window.farhand.pictures, frame: window.farhand.counts.frame})"
                )
                began = time.monotonic()
                page.wait_for_timeout(seconds * 1e3)
                after = page.evaluate(
                    "({...window.farhand.pictures, frame: window.farhand.counts.frame})"
                )
                took = time.monotonic() - began
    finally:
        stop_server(server)
    rates = sorted(rate for rate, _ in loops)
    return {
        "wrist": {"frames/s": (after["wrist"] - before["wrist"]) / took},
        "scene": {"frames/s": (after["scene"] - before["scene"]) / took},
        "webcam frames answered": {"frames/s": (after["frame"] - before["frame"]) / took},
        "control loop": {
            "median_hz": rates[len(rates) // 2],
            "lowest_hz": rates[0],
            "latest_ms": max(late for _, late in loops),
        },
    }


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--view-3d", action="store_true", help="with the 3D view shown")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        figures = measure(Path(folder), options.seconds, options.view_3d)
    report(figures, options)


if __name__ == "__main__":
    main()
