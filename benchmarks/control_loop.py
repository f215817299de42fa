"""How punctual the control loop is while both cameras stream and the arm moves.

Lateness is measured by the loop itself (time of waking after the deadline); each state tells the
worst of the last second. The target: 240 Hz, never late by more than 20 ms, and both cameras at 20
pictures a second or more.
"""

import time

from app.link.actions import JogJoint
from app.link.messages import State
from benchmarks.node_process import BenchNode, Driver
from benchmarks.report import arguments, percentiles, report


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=30.0)
    options = parser.parse_args()
    pictures = {"wrist": 0, "scene": 0}

    def count(name: str) -> None:
        pictures[name] += 1

    states: list[State] = []
    with BenchNode(cameras=True) as node:
        driver = Driver(node.endpoint, "bench")
        watches = [
            driver.end.watch_camera("wrist", lambda *_: count("wrist")),
            driver.end.watch_camera("scene", lambda *_: count("scene")),
        ]
        driver.ready()
        # Cameras take seconds to start, and the loop's figures are of the last second.
        deadline = time.monotonic() + 60
        driver.show(None, 0, lambda: min(pictures.values()) > 5 or time.monotonic() > deadline)
        settled = time.monotonic() + 2.0
        driver.show(None, 0, lambda: time.monotonic() > settled)
        pictures.update(wrist=0, scene=0)
        began = time.monotonic()
        hold = 0
        while time.monotonic() < began + options.seconds:
            hold += 1
            turn_round = time.monotonic() + 1.0
            jog = JogJoint(joint=1, velocity=0.5 if hold % 2 else -0.5)

            def is_over(at: float = turn_round) -> bool:
                return time.monotonic() > at

            driver.show(jog, hold, is_over, lambda _: states.append(driver.state))
        took = time.monotonic() - began
        for watch in watches:
            watch.close()
        driver.end.close()
    loops = [state.loop for state in states if state.loop is not None]
    figures = {
        "rate, Hz": percentiles([loop.rate_hz for loop in loops]),
        "worst lateness of a second, ms": percentiles([loop.late_max_ms for loop in loops]),
        "pictures a second": {name: number / took for name, number in pictures.items()},
    }
    report(figures, options)


if __name__ == "__main__":
    main()
