"""Standstill within 500 ms of the last valid frame, whatever fails in between.

A real server and node; a gesture jogs joint 1 at full speed; then one thing fails. Time is the
node's own, read on a link of its own: from the tick that the last command carried to the first
state in which every joint is measured to stand. When what failed can come back, it does, with
everything that was delayed and the hand still up, and the arm must not move again by itself.

    python -m benchmarks.standstill [--runs 50] [--only "gateway stopped"] [--save FILE]

- ``browser killed``, ``browser stopped``: SIGKILL, or SIGSTOP and later SIGCONT, of every process
  of a real Chromium that drives.
- ``network blackholed``: a proxy between client and gateway stops forwarding without closing, and
  later forwards everything at once.
- ``uplink queues``: on a link of 10 ms the traffic of others holds the way up for 0.25 s; one more
  frame goes into that queue, and none follows. Counted from when that one was *sent*.
- ``gateway killed``, ``gateway stopped``: SIGKILL, or SIGSTOP and later SIGCONT, of the gateway,
  whose node runs by itself; ``..., its own node``: whose node is its child. A child that has lost
  its gateway brings the arm to rest and ends.
"""

import asyncio
import contextlib
import signal
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

import psutil
from websockets.exceptions import ConnectionClosed

from app.gestures.synthetic import Step
from benchmarks.driving import browser, signal_browser, webcam
from benchmarks.observer import STANDSTILL_MS, Observer, Standstill, tick_now, wait, wait_async
from benchmarks.operator import Operator
from benchmarks.report import arguments, percentiles, promise, report
from benchmarks.rig import JOGS, TOKEN, Clip, Rig, clip
from tests.proxy import Proxy
from tests.slow_link import SlowLink

FAILED_S = 2.5
"""How long a fault lasts; longer than a lease lives."""
WATCHED_S = 2.5
"""How long the arm is watched after that."""
FULL_SPEED_S = 30.0
QUEUE_S = 0.25
"""So long the way up is held by somebody else."""


class Outcome(NamedTuple):
    """What came of one fault."""

    standstill: Standstill
    moved_again: bool
    since_sent_ms: float | None = None
    """From the sending of the last frame, where that is not about the moment of its arrival."""
    life_ms: int | None = None
    """What was left of the life of its command; None: nothing, it was not commanded."""


class NotAtFullSpeed(RuntimeError):
    """There is nothing to measure: a busy machine did not get the arm to its full speed."""


Fault = Callable[[], None]


async def drive_and_fail(rig: Rig, url: str, fail: Fault, mend: Fault) -> Outcome:
    """Drive at full speed, fail, mend, and watch.

    Args:
        rig: The system.
        url: Where the operator connects to.
        fail: Makes something fail.
        mend: Makes it work again.

    Raises:
        NotAtFullSpeed: the arm was not.
        RuntimeError: the arm did not come to rest at all.
    """
    observer = rig.observer
    await wait_async(lambda: observer.state.controller is None, "nobody drives")
    observer.forget()
    pictures = clip(rig.next_gesture())
    async with Operator(url, TOKEN) as operator:
        await _reach_full_speed(operator, observer, pictures)

        async def keep_showing() -> None:
            with contextlib.suppress(ConnectionClosed):
                await operator.play(pictures.keep())

        showing = asyncio.create_task(keep_showing())
        try:
            failed = tick_now()
            fail()
            await asyncio.sleep(FAILED_S)
            standstill = observer.standstill(failed, tick_now())
            mended = tick_now()
            await asyncio.to_thread(mend)
            await asyncio.sleep(WATCHED_S)
        finally:
            showing.cancel()
            await asyncio.gather(showing, return_exceptions=True)
    again = observer.moved_between(standstill.at, mended) or rig.observer.moved_between(
        standstill.at, tick_now()
    )
    return Outcome(standstill, again)


async def _reach_full_speed(operator: Operator, observer: Observer, pictures: Clip) -> None:
    """Take control, arm, and show the gesture until the arm is at full speed.

    Raises:
        NotAtFullSpeed: it did not get there in time.
    """
    await operator.take_and_arm()
    give_up = time.monotonic() + FULL_SPEED_S
    await operator.play(
        pictures.shown(),
        until=lambda: observer.at_full_speed() or time.monotonic() > give_up,
    )
    if not observer.at_full_speed():
        raise NotAtFullSpeed


def network_blackholed(rig: Rig, proxy: Proxy) -> Outcome:
    """The proxy stops forwarding, and later forwards everything."""
    url = f"http://127.0.0.1:{proxy.port}"
    return asyncio.run(drive_and_fail(rig, url, proxy.hold, proxy.forward))


async def last_frame_queued(rig: Rig, link: SlowLink) -> Outcome:
    """Drive at full speed; the way up fills; one more frame, and none after it."""
    observer = rig.observer
    await wait_async(lambda: observer.state.controller is None, "nobody drives")
    observer.forget()
    pictures = clip(rig.next_gesture())
    async with Operator(f"http://127.0.0.1:{link.port}", TOKEN) as operator:
        await _reach_full_speed(operator, observer, pictures)
        link.queue_up(QUEUE_S)
        await asyncio.sleep(0.03)  # what was on its way before has arrived
        sent = tick_now()
        number = await operator.show(pictures.held[0], flood=True)
        await asyncio.sleep(WATCHED_S)
        standstill = observer.standstill(sent, tick_now())
    lives = [command.ttl_ms for _, command in observer.commands if command.frame == number]
    moved = observer.moved_between(standstill.at, tick_now())
    life = lives[0] if lives else None
    return Outcome(standstill, moved, float(standstill.at - sent), life)


def uplink_queues(rig: Rig, link: SlowLink) -> Outcome:
    """The last frame waited behind somebody else's traffic."""
    return asyncio.run(last_frame_queued(rig, link))


def gateway_stopped(rig: Rig) -> Outcome:
    """SIGSTOP, SIGCONT."""
    return asyncio.run(
        drive_and_fail(
            rig,
            rig.url,
            lambda: rig.signal_gateway(signal.SIGSTOP),
            lambda: rig.signal_gateway(signal.SIGCONT),
        )
    )


def gateway_killed(rig: Rig) -> Outcome:
    """SIGKILL, and a new gateway."""
    children = psutil.Process(rig.server.process.pid).children(recursive=True)

    def mend() -> None:
        if not rig.separate:
            _, left = psutil.wait_procs(children, 5)
            if left:
                raise RuntimeError(f"outlived the gateway: {left}")
        rig.restart_gateway()

    return asyncio.run(
        drive_and_fail(rig, rig.url, lambda: rig.signal_gateway(signal.SIGKILL), mend)
    )


def browser_fails(rig: Rig, videos: dict[str, Path], fail: int, mend: int | None) -> Outcome:
    """Signal every process of the browser, and perhaps once more later."""
    observer = rig.observer
    wait(lambda: observer.state.controller is None, "nobody drives")
    observer.forget()
    with browser(rig.server, videos[rig.next_gesture()]):
        try:
            wait(observer.at_full_speed, "full speed", FULL_SPEED_S)
        except TimeoutError:
            raise NotAtFullSpeed from None
        failed = tick_now()
        signal_browser(signal.Signals(fail))
        time.sleep(FAILED_S)
        mended = tick_now()
        if mend is not None:
            signal_browser(signal.Signals(mend))
        # Before anything can raise: a stopped browser cannot be closed.
        time.sleep(WATCHED_S)
        standstill = observer.standstill(failed, mended)
        return Outcome(standstill, observer.moved_between(standstill.at, tick_now()))


@contextmanager
def scenario(name: str, folder: Path) -> Iterator[Callable[[], Outcome]]:
    """Prepare what one kind of fault needs; gives the function that does it once."""
    with Rig(folder, separate=name in ("gateway killed", "gateway stopped")) as rig:
        match name:
            case "browser killed" | "browser stopped":
                # Longer than the fault and the watch after it, so that the hand stays up.
                held = FAILED_S + WATCHED_S + 2.0
                videos = {
                    gesture: webcam(
                        (Step(None, 1.0), Step(gesture, held)), folder / f"{gesture}.mjpeg"
                    )
                    for gesture in JOGS.values()
                }
                killed = name == "browser killed"
                fail = signal.SIGKILL if killed else signal.SIGSTOP
                mend = None if killed else signal.SIGCONT
                yield lambda: browser_fails(rig, videos, fail, mend)
            case "network blackholed":
                with Proxy(urlsplit(rig.url).port or 0) as proxy:
                    yield lambda: network_blackholed(rig, proxy)
            case "uplink queues":
                with SlowLink(urlsplit(rig.url).port or 0, delay_s=0.01, rate=4e6) as link:
                    yield lambda: uplink_queues(rig, link)
            case "gateway killed" | "gateway killed, its own node":
                yield lambda: gateway_killed(rig)
            case _:
                yield lambda: gateway_stopped(rig)


SCENARIOS = (
    "browser killed",
    "browser stopped",
    "network blackholed",
    "uplink queues",
    "gateway killed",
    "gateway stopped",
    "gateway killed, its own node",
    "gateway stopped, its own node",
)


def measure(name: str, runs: int) -> dict[str, float | str]:
    """One row of the report: ``runs`` times one kind of fault.

    Raises:
        RuntimeError: the arm did not come to rest at all, or never moved.
    """
    outcomes: list[Outcome] = []
    repeated = 0
    with tempfile.TemporaryDirectory() as folder, scenario(name, Path(folder)) as once:
        while len(outcomes) < runs:
            try:
                outcomes.append(once())
            except NotAtFullSpeed:
                repeated += 1
                if repeated > runs:
                    raise
                continue
            newest = outcomes[-1]
            print(
                f"{name} {len(outcomes)}: {newest.standstill.since_command_ms:.0f} ms, "
                f"by the node {newest.standstill.since_obeyed_ms or float('nan'):.0f} ms"
                f"{', moved again' if newest.moved_again else ''}",
                flush=True,
            )
    took = [each.since_sent_ms or each.standstill.since_command_ms for each in outcomes]
    by_node = [each.standstill.since_obeyed_ms for each in outcomes]
    again = sum(each.moved_again for each in outcomes)
    return {
        **{
            f"{key} ms" if key != "n" else "runs": value for key, value in percentiles(took).items()
        },
        "from the fault, max ms": max(each.standstill.since_fault_ms for each in outcomes),
        "by the node's own account, max ms": max((ms for ms in by_node if ms), default=0.0),
        "moved again": again,
        "repeated": repeated,
        **promise(
            f"{STANDSTILL_MS:.0f} ms, never again",
            kept=max(took) <= STANDSTILL_MS and not again,
        ),
    }


def main() -> None:
    parser = arguments(__doc__, runs=50)
    parser.add_argument("--only", action="append", choices=SCENARIOS, help="only this; repeatable")
    options = parser.parse_args()
    rows = {name: measure(name, options.runs) for name in options.only or SCENARIOS}
    report(rows, options)


if __name__ == "__main__":
    main()
