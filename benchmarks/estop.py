"""E-stop to standstill with 20 viewers and a flooding client.

A gesture jogs joint 1 at full speed while 20 clients watch the cameras and one more sends webcam
frames and messages as fast as the server takes them. Then somebody stops: by turns the one who
drives (button), one who only watches (button), and a program over REST. From just before the stop
is sent to the first state in which every joint is measured to stand, on the node's clock. Each time
the stop must be latched: arming is refused until a reset.

Every now and then, while it is stopped, gateway, node and cameras are killed (SIGKILL) and started
again: the robot must still be stopped.

With ``--siege`` everything else that could hold a stop up happens at the same time
(:mod:`benchmarks.siege`): a log that is not read, a disk that freezes just before each stop, idle
strangers, header floods, and uploads. Needs root.

    python -m benchmarks.estop [--runs 200] [--restarts 10] [--siege] [--save FILE]
"""

import argparse
import asyncio
import contextlib
import itertools
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import httpx
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from benchmarks.observer import tick_now, wait, wait_async
from benchmarks.operator import Operator
from benchmarks.report import arguments, percentiles, promise, report
from benchmarks.rig import TOKEN, Rig, clip
from benchmarks.siege import besiege, unread_pipe
from tests.disks import Disk, freezable

VIEWERS = 20
DISK_MIB = 128
P99_MS = 300.0
MAX_MS = 500.0
SHOWING = 180
"""Frames of one showing, about 6 s."""
WAYS = ("driver", "watcher", "rest")
HEADERS = {"Authorization": f"Bearer {TOKEN}"}


async def crowd(url: str) -> None:
    """Twenty who look and one who floods, until killed; in a process of its own."""
    socket_url = url.replace("http", "ws", 1)
    seen = 0

    async def look(name: str) -> None:
        nonlocal seen
        async with connect(
            f"{socket_url}/ws/camera/{name}", additional_headers=HEADERS, max_size=None
        ) as socket:
            seen += 1
            async for _ in socket:
                pass

    async def flood() -> None:
        pictures = clip("up").keep()
        async with Operator(url, TOKEN) as operator:
            print("floods", flush=True)
            while True:
                await operator.show(next(pictures), flood=True)
                await operator.say("ping", t=1.0)
                # The library yields only when its buffer is full.
                await asyncio.sleep(0)

    async with asyncio.TaskGroup() as group:
        for number in range(VIEWERS):
            group.create_task(look(("wrist", "scene")[number % 2]))
        while seen < VIEWERS:
            await asyncio.sleep(0.05)
        group.create_task(flood())


@contextmanager
def crowded(url: str, option: str = "--crowd") -> Iterator[None]:
    """The crowd is there, or with ``--besiege`` those who attack."""
    process = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.estop", option, url],
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[1],
    )
    assert process.stdout is not None
    try:
        if not process.stdout.readline():
            raise RuntimeError(f"nobody came ({option})")
        yield
        if process.poll() is not None:
            raise RuntimeError(f"who came left before the end ({option})")
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


class Outcome(NamedTuple):
    """What came of one stop."""

    took_ms: float
    latched: bool
    why_not: str = ""


async def one_stop(rig: Rig, way: str, disk: Disk | None = None) -> Outcome:
    """Drive at full speed, stop, and try to arm; leaves the robot stopped.

    Args:
        rig: The system.
        way: Who stops, one of :data:`WAYS`.
        disk: Frozen from just before the stop until it was measured.

    Raises:
        RuntimeError: the arm did not reach full speed, or did not come to rest at all.
    """
    observer = rig.observer
    await wait_async(lambda: observer.state.controller is None, "nobody drives")
    observer.forget()
    pictures = clip(rig.next_gesture())
    async with (
        Operator(rig.url, TOKEN) as driver,
        Operator(rig.url, TOKEN) as watcher,
        httpx.AsyncClient(base_url=rig.url, headers=HEADERS, timeout=20) as api,
    ):
        await driver.take_and_arm()
        give_up = time.monotonic() + 60
        while not observer.at_full_speed():
            if time.monotonic() > give_up:
                raise RuntimeError(f"not at full speed: {observer.state}")
            # Under load a showing can break off, and the lease run out: show it anew.
            if not driver.robot["controller"]:
                await driver.take_and_arm()
            frames = itertools.islice(pictures.shown(), SHOWING)
            await driver.play(frames, until=observer.at_full_speed)
        showing = asyncio.create_task(driver.play(pictures.keep()))
        with contextlib.ExitStack() as frozen:
            if disk is not None:
                await asyncio.to_thread(disk.freeze)
                frozen.callback(disk.thaw)
                await wait_async(observer.at_full_speed, "full speed on a frozen disk")
            stopped = tick_now()
            match way:
                case "driver":
                    await driver.say("stop")
                case "watcher":
                    await watcher.say("stop")
                case _:
                    (await api.post("/api/robots/puma/stop")).raise_for_status()
            await asyncio.sleep(1.0)
            stood = observer.standstill(stopped, tick_now())
            refused = await _is_refused(driver)
        showing.cancel()
        with contextlib.suppress(asyncio.CancelledError, ConnectionClosed):
            await showing
        latched = all(
            state.mode == "stopped" and state.stop in ("S0", "S1")
            for state in observer.states
            if state.tick >= stood.at
        )
        moved = observer.moved_between(stood.at, tick_now())
        wrong = {"arming was not refused": not refused, "not latched": not latched, "moved": moved}
        why_not = ", ".join(what for what, so in wrong.items() if so)
        return Outcome(stood.since_fault_ms, not why_not, why_not)


async def _is_refused(driver: Operator) -> bool:
    """Whether arming is refused because the stop is latched."""
    for _ in range(3):
        # On a busy machine control may have run out meanwhile, and is then what is missing first.
        if not driver.robot["controller"]:
            await driver.say("take_control")
        await driver.say("arm")
        with contextlib.suppress(TimeoutError):
            await driver.wait_for(lambda: any(e["code"] == "latched" for e in driver.errors), 5)
            return True
        print([error["code"] for error in driver.errors], flush=True)
    return False


async def is_latched(rig: Rig) -> bool:
    """Whether the robot is stopped, and will not be armed."""
    async with Operator(rig.url, TOKEN) as operator:
        await operator.wait_for(lambda: operator.robot.get("online"), 60)
        await operator.say("take_control")
        await operator.wait_for(lambda: operator.robot["controller"])
        await operator.say("arm")
        await operator.wait_for(lambda: operator.errors)
        mode, code = operator.robot["mode"], operator.errors[0]["code"]
        return bool(mode == "stopped" and code == "latched")


def reset(rig: Rig) -> None:
    """Leave the stop."""
    with rig.server.api() as api:
        # Refused while anything still moves.
        wait(lambda: api.post("/api/robots/puma/reset").status_code == 200, "a reset")


def measure(runs: int, restarts: int, *, siege: bool) -> dict[str, dict[str, float | str]]:
    """The rows of the report."""
    took: dict[str, list[float]] = {way: [] for way in WAYS}
    latched = 0
    survived = done = 0
    block = -(-runs // max(restarts, 1))
    with contextlib.ExitStack() as around:
        folder = Path(around.enter_context(tempfile.TemporaryDirectory()))
        disk = around.enter_context(freezable(folder, DISK_MIB)) if siege else None
        stderr = around.enter_context(unread_pipe()) if siege else None
        place = folder if disk is None else disk.folder
        rig = around.enter_context(Rig(place, stderr=stderr))
        while done < runs:
            with contextlib.ExitStack() as crowd:
                crowd.enter_context(crowded(rig.url))
                if siege:
                    crowd.enter_context(crowded(rig.url, "--besiege"))
                for _ in range(min(block, runs - done)):
                    way = WAYS[done % len(WAYS)]
                    if done:
                        reset(rig)
                    outcome = asyncio.run(one_stop(rig, way, disk))
                    took[way].append(outcome.took_ms)
                    latched += outcome.latched
                    done += 1
                    print(f"{done} {way}: {outcome}", flush=True)
            if restarts:
                rig.kill_everything()
                rig.restart_gateway()
                survived += asyncio.run(is_latched(rig))
                print(f"{survived} restarts survived", flush=True)
    everything = percentiles([each for values in took.values() for each in values])
    rows: dict[str, dict[str, float | str]] = {
        f"stop by {way}, ms": {**percentiles(values)} for way, values in took.items()
    }
    return rows | {
        "stop -> standstill, ms": {
            **everything,
            **promise(
                f"p99 {P99_MS:.0f}, max {MAX_MS:.0f}",
                kept=everything["p99"] <= P99_MS and everything["max"] <= MAX_MS,
            ),
        },
        "latched": {"n": latched, **promise(f"{done} of {done}", kept=latched == done)},
        "still stopped after a restart of everything": {
            "n": survived,
            **promise(f"{-(-done // block)}", kept=survived == (-(-done // block)) or not restarts),
        },
    }


def main() -> None:
    parser = arguments(__doc__, runs=200)
    parser.add_argument("--restarts", type=int, default=10, help="restarts of everything")
    parser.add_argument("--crowd", metavar="URL", help=argparse.SUPPRESS)
    parser.add_argument("--siege", action="store_true", help="with everything that could delay it")
    parser.add_argument("--besiege", metavar="URL", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.crowd:
        asyncio.run(crowd(options.crowd))
        return
    if options.besiege:
        asyncio.run(besiege(options.besiege))
        return
    report(measure(options.runs, options.restarts, siege=options.siege), options)


if __name__ == "__main__":
    main()
