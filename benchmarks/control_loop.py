"""How punctual the control loop is while both cameras stream and the arm moves.

Lateness is measured by the loop itself (time of waking after the deadline): it counts the cycles
that were due and those that began more than 5 ms late or never, and each state tells the worst of
the last second. Asked for: 240 Hz, 99.9% of the cycles within 5 ms of their time, none over 20 ms,
and both cameras at 20 pictures a second or more.

    python -m benchmarks.control_loop [--seconds 60] [--save FILE]
"""

import time

from app.link.actions import JogJoint
from app.link.messages import State
from benchmarks.node_process import BenchNode, Driver
from benchmarks.report import arguments, percentiles, promise, report

ON_TIME = 0.999
"""Part of the cycles that begin within 5 ms of their time."""


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
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
    cycles = loops[-1].cycles - loops[0].cycles
    late = loops[-1].late - loops[0].late
    worst = percentiles([loop.late_max_ms for loop in loops])
    rates = {name: number / took for name, number in pictures.items()}
    figures: dict[str, dict[str, float | str]] = {
        "cycles": {"n": cycles},
        "begun within 5 ms, %": {
            "mean": f"{100 * (1 - late / cycles):.3f}",
            **promise(f"{ON_TIME:.1%}", kept=late <= (1 - ON_TIME) * cycles),
        },
        "rate, Hz": {**percentiles([loop.rate_hz for loop in loops])},
        "worst lateness of a second, ms": {**worst, **promise("20", kept=worst["max"] <= 20)},
    }
    for name, rate in rates.items():
        figures[f"{name} pictures a second"] = {
            "mean": f"{rate:.1f}",
            **promise("20", kept=rate >= 20),
        }
    report(figures, options)


if __name__ == "__main__":
    main()
