"""A 2 s stall, then the burst of everything that was delayed: not one stale command is acted on.

The arm jogs at full speed when a proxy stops forwarding for 2 s; the sender goes on at 30 a second
and heeds no limit of what is under way. In every second run only the way to the robot stalls, so
that the sender goes on seeing new ticks; in half of the runs of each kind the hand is put down for
a second and then shows the gesture anew, so that whoever believed the delayed ones would find the
half second without a gesture and the new gesture that let an arm move again. Stale is what was sent
over 500 ms (frames) or 250 ms (commands) before it could arrive.

    python -m benchmarks.stale_burst [--runs 50] [--save FILE]

- ``browser to gateway``: webcam frames over a WebSocket.
- ``gateway to node``: commands over Zenoh on TCP. Somebody renews the lease meanwhile on a way of
  its own, so that nothing but their age speaks against the commands.
"""

import asyncio
import contextlib
import itertools
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

from app.errors import RobotUnavailable
from app.link.actions import Action, JogJoint
from app.link.gateway_end import GatewayEnd
from app.link.messages import COMMAND_TTL_MS, LeaseRequest
from benchmarks.node_process import BenchNode, Driver, free_port
from benchmarks.observer import FULL_SPEED, ROBOT, Observer, tick_now, wait, wait_async
from benchmarks.operator import Operator
from benchmarks.report import arguments, promise, report
from benchmarks.rig import TOKEN, Rig, clip
from tests.proxy import Proxy

STALL_S = 2.0
WATCHED_S = 2.0
FRAME_AGE_MS = 500
"""docs/protocol.md: a frame that is older moves nothing."""


class Outcome(NamedTuple):
    """What came of one burst."""

    delayed: int
    """Frames or commands sent during the stall."""
    acted_on: int
    """Stale ones that were obeyed."""
    moved: bool
    """The arm moved by itself after it had come to rest."""
    drove_again: bool
    """Afterwards no gesture and then a new one moved it: it would have moved if told so."""


async def frames(rig: Rig, proxy: Proxy, *, one_way: bool, anew: bool) -> Outcome:
    """One stall between browser and gateway."""
    observer = rig.observer
    await wait_async(lambda: observer.state.controller is None, "nobody drives")
    observer.forget()
    pictures = clip(rig.next_gesture())
    sent: dict[int, int] = {}

    async def note(_: int, seq: int) -> None:
        sent[seq] = tick_now()

    async with Operator(f"http://127.0.0.1:{proxy.port}", TOKEN) as operator:
        await operator.take_and_arm()
        await operator.play(pictures.shown(), until=observer.at_full_speed)
        began = tick_now()
        proxy.hold(down=not one_way)

        def stall_is_over() -> bool:
            return tick_now() - began >= STALL_S * 1e3

        during = pictures.shown() if anew else pictures.keep()
        await operator.play(during, at_each=note, until=stall_is_over, flood=True)
        delayed = len(sent)
        rested = observer.standstill(began, tick_now()).at
        forwarded = tick_now()
        proxy.forward()
        # The hand stays up.
        watched = forwarded + WATCHED_S * 1e3
        await operator.play(pictures.keep(), at_each=note, until=lambda: tick_now() > watched)
        moved = observer.moved_between(rested, tick_now())
        acted_on = sum(
            arrived >= forwarded
            and command.frame is not None
            and sent.get(command.frame, forwarded) < forwarded - FRAME_AGE_MS
            for arrived, command in observer.commands
        )
        give_up = time.monotonic() + 60
        await operator.play(
            clip(rig.next_gesture()).shown(),
            until=lambda: not observer.stands() or time.monotonic() > give_up,
        )
        return Outcome(delayed, acted_on, moved, not observer.stands())


def commands(
    observer: Observer, driver: Driver, direct: GatewayEnd, proxy: Proxy, *, anew: bool
) -> Outcome:
    """One stall between gateway and node; both ways, as the driver must not see newer ticks."""
    driver.ready()
    holds = itertools.count(int(time.monotonic() * 1e3))
    jog = JogJoint(joint=1, velocity=FULL_SPEED)
    hold = 0
    while not observer.at_full_speed():
        # A busy machine can make the driver fall silent; then it needs no gesture, and a new one.
        jog = JogJoint(joint=1, velocity=observer.direction() * FULL_SPEED)
        driver.show(None, next(holds), lambda: driver.state.mode == "armed")
        hold, give_up = next(holds), tick_now() + 1500

        def is_over(at: int = give_up) -> bool:
            return observer.at_full_speed() or tick_now() > at

        driver.show(jog, hold, is_over)
    observer.forget()
    before = dict(observer.state.dropped)
    epoch = observer.state.epoch
    over = threading.Event()

    def renew() -> None:
        request = LeaseRequest(kind="renew", holder=driver.holder, epoch=epoch)
        while not over.wait(0.3):
            # An answer can be lost on a busy machine; the next one is in time.
            with contextlib.suppress(RobotUnavailable):
                direct.ask(request, timeout=0.5)

    renewing = threading.Thread(target=renew)
    renewing.start()
    try:
        began = tick_now()
        proxy.hold()
        delayed = 0

        def count(_: int) -> None:
            nonlocal delayed
            delayed += 1

        def since(seconds: float) -> bool:
            return tick_now() - began >= seconds * 1e3

        shown: tuple[Action | None, int] = (None, hold) if anew else (jog, hold)
        driver.show(*shown, lambda: since(STALL_S / 2), count)
        driver.show(jog, next(holds) if anew else hold, lambda: since(STALL_S), count)
        rested = observer.standstill(began, tick_now()).at
        proxy.forward()
        # Nothing fresh follows at first: whatever happens now comes of what was delayed.
        time.sleep(WATCHED_S)
        after = [state for state in observer.states if state.tick > began + COMMAND_TTL_MS + 100]
        dropped = sum(observer.state.dropped.values()) - sum(before.values())
        held = all(state.mode == "holding" for state in after)
        moved = observer.moved_between(rested, tick_now())
        # What is not counted as refused fell out of the node's ring unread.
        acted_on = 0 if held and dropped else delayed
    finally:
        over.set()
        renewing.join()
    driver.show(None, next(holds), lambda: observer.state.mode == "armed")
    driver.show(jog, next(holds), lambda: not observer.stands())
    direct.ask(LeaseRequest(kind="release", holder=driver.holder, epoch=epoch), timeout=2)
    wait(observer.stands, "rest")
    return Outcome(delayed, acted_on, moved, True)


def gateway_bursts(runs: int) -> Iterator[Outcome]:
    """``runs`` stalls between browser and gateway."""
    with (
        tempfile.TemporaryDirectory() as folder,
        Rig(Path(folder)) as rig,
        Proxy(urlsplit(rig.url).port or 0) as proxy,
    ):
        for run in range(runs):
            yield asyncio.run(frames(rig, proxy, one_way=run % 2 == 1, anew=run % 4 >= 2))


def node_bursts(runs: int) -> Iterator[Outcome]:
    """``runs`` stalls between gateway and node."""
    port = free_port()
    endpoint = f"tcp/127.0.0.1:{port}"
    with (
        BenchNode(cameras=False, endpoint=endpoint),
        Observer(endpoint) as observer,
        GatewayEnd(ROBOT, endpoint, timeout=30) as direct,
        Proxy(port) as proxy,
    ):
        for run in range(runs):
            driver = Driver(f"tcp/127.0.0.1:{proxy.port}", f"driver-{run}")
            try:
                yield commands(observer, driver, direct, proxy, anew=run % 2 == 1)
            finally:
                driver.end.close()


WAYS = {"browser to gateway": gateway_bursts, "gateway to node": node_bursts}


def row(name: str, outcomes: Iterator[Outcome]) -> dict[str, float | str]:
    """One row of the report."""
    done = []
    for outcome in outcomes:
        done.append(outcome)
        print(f"{name} {len(done)}: {outcome}", flush=True)
    acted_on = sum(each.acted_on for each in done)
    moved = sum(each.moved for each in done)
    drove_again = sum(each.drove_again for each in done)
    return {
        "runs": len(done),
        "delayed": sum(each.delayed for each in done),
        "stale acted on": acted_on,
        "moved by itself": moved,
        "drove again when told": drove_again,
        **promise("0 acted on", kept=not acted_on and not moved and drove_again == len(done)),
    }


def main() -> None:
    parser = arguments(__doc__, runs=50)
    options = parser.parse_args()
    report({name: row(name, burst(options.runs)) for name, burst in WAYS.items()}, options)


if __name__ == "__main__":
    main()
