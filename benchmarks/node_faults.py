"""The robot node is killed or hangs: how soon that is shown, and how soon it is back, disarmed.

The arm moves when its node gets SIGKILL or SIGSTOP. Time runs from just before the signal to the
first ``robot`` message to the driving session that has ``mode`` ``faulted`` and a ``fault``, and
to the first one with ``online`` again. Each node has run for over ten seconds before, because
one that fails sooner is started again later and later.

    python -m benchmarks.node_faults [--runs 50] [--save FILE]
"""

import asyncio
import signal
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from app.gateway.node_process import HEALTHY_S
from benchmarks.observer import Observer, wait_async
from benchmarks.operator import Operator
from benchmarks.report import arguments, percentiles, promise, report
from benchmarks.rig import TOKEN, Rig, clip

SHOWN_MS = 300.0
BACK_S = {"killed": 3.0, "hung": 5.0}
SIGNALS = {"killed": signal.SIGKILL, "hung": signal.SIGSTOP}
WATCHED_S = 1.0


class Outcome(NamedTuple):
    """What came of one fault."""

    shown_ms: float
    back_s: float
    disarmed: bool
    """When it was back it was disarmed, nobody had control, and nothing moved."""


async def one_fault(
    rig: Rig, number: signal.Signals, *, healthy_s: float = HEALTHY_S + 1
) -> Outcome:
    """Drive, signal the node, and wait until it is back.

    Args:
        rig: The system, with the node as the gateway's child.
        number: The signal.
        healthy_s: How long the node has run by then.
    """
    healthy = time.monotonic() + healthy_s
    observer = rig.observer
    pictures = clip(rig.next_gesture())
    async with Operator(rig.url, TOKEN) as operator:
        await operator.take_and_arm()
        await operator.play(
            pictures.shown(),
            until=lambda: not observer.stands() and time.monotonic() > healthy - 8,
        )
        showing = asyncio.create_task(operator.play(pictures.keep()))
        try:
            await wait_async(lambda: time.monotonic() > healthy, "a node that is taken for healthy")
            node = rig.server.node()
            began = time.monotonic()
            node.send_signal(number)
            await operator.wait_for(
                lambda: operator.robot["mode"] == "faulted" and operator.robot["fault"], 30
            )
            shown = operator.robot["received"] - began
            await operator.wait_for(lambda: operator.robot["online"], 60)
            back = operator.robot["received"] - began
            first = operator.robot
            observer.__exit__()
            rig.observer = Observer(rig.server.endpoint())
            await asyncio.sleep(WATCHED_S)
            still = all(state.mode == "disarmed" for state in rig.observer.states)
        finally:
            showing.cancel()
            await asyncio.gather(showing, return_exceptions=True)
        disarmed = first["mode"] == "disarmed" and not first["armed"] and not first["controller"]
        moved = rig.observer.moved_between(0, rig.observer.state.tick)
        return Outcome(shown * 1e3, back, disarmed and still and not moved)


def main() -> None:
    parser = arguments(__doc__, runs=50)
    options = parser.parse_args()
    rows: dict[str, dict[str, float | str]] = {}
    with tempfile.TemporaryDirectory() as folder, Rig(Path(folder)) as rig:
        for name, number in SIGNALS.items():
            done: list[Outcome] = []
            for run in range(options.runs):
                done.append(asyncio.run(one_fault(rig, number)))
                print(f"{name} {run + 1}: {done[-1]}", flush=True)
            shown = percentiles([each.shown_ms for each in done])
            back = percentiles([each.back_s for each in done])
            disarmed = sum(each.disarmed for each in done)
            rows[f"{name}: fault shown, ms"] = {
                **shown,
                **promise(f"{SHOWN_MS:.0f}", kept=shown["max"] <= SHOWN_MS),
            }
            rows[f"{name}: back, s"] = {
                **back,
                **promise(f"{BACK_S[name]:.0f}", kept=back["max"] <= BACK_S[name]),
            }
            rows[f"{name}: back disarmed"] = {
                "n": disarmed,
                **promise(f"{len(done)} of {len(done)}", kept=disarmed == len(done)),
            }
    report(rows, options)


if __name__ == "__main__":
    main()
