"""The rules of lease and stops, whatever happens in whatever order: the full number of games.

The test plays the same games in a modest number (``tests/robot/any_order.py`` says what must hold).
Each game is a run of steps drawn at random: take, take over, renew, release, arm, disarm, stops of
every category, reset, gestures, doubts, commands that are stale, repeated or of an old lease, and
time that passes. What must hold is looked at in every cycle of the control loop. The first broken
rule ends it with the shortest game that breaks it.

    python -m benchmarks.safety_properties [--runs 1000] [--steps 50] [--save FILE]
"""

import time

from hypothesis import HealthCheck, Phase, settings
from hypothesis.stateful import run_state_machine_as_test

from benchmarks.report import arguments, report
from tests.robot.any_order import AnyOrder


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--steps", type=int, default=50)
    options = parser.parse_args()
    counts = {"runs": 0, "cycles": 0, "transitions": 0, "commands dropped": 0}

    class Counted(AnyOrder):
        """Counts what was played."""

        def __init__(self) -> None:
            super().__init__()
            self.began = self.it.now
            counts["runs"] += 1

        def teardown(self) -> None:
            counts["cycles"] += round((self.it.now - self.began) * 240)
            counts["transitions"] += self.steps
            counts["commands dropped"] += sum(self.controller.gate.dropped.values())

    started = time.monotonic()
    run_state_machine_as_test(
        Counted,
        settings=settings(
            max_examples=options.runs,
            stateful_step_count=options.steps,
            deadline=None,
            database=None,
            phases=(Phase.generate, Phase.shrink),
            suppress_health_check=list(HealthCheck),
        ),
    )
    results = {name: {"count": float(value)} for name, value in counts.items()}
    results["rules broken"] = {"count": 0.0}
    results["time"] = {"s": time.monotonic() - started}
    report(results, options)


if __name__ == "__main__":
    main()
