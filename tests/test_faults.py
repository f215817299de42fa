"""What fails while the arm moves at full speed: the benchmarks' own runs, once each.

Times are held to twice what is promised, for a machine that does other things; benchmarks/ holds
them to the promise itself.
"""

import asyncio
import itertools
import signal
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from benchmarks import estop, node_faults, stale_burst
from benchmarks.observer import STANDSTILL_MS, Observer, tick_now, wait, wait_async
from benchmarks.operator import Operator
from benchmarks.rig import TOKEN, Rig, clip
from benchmarks.standstill import (
    NotAtFullSpeed,
    Outcome,
    gateway_killed,
    gateway_stopped,
    network_blackholed,
    uplink_queues,
)
from tests.proxy import Proxy
from tests.reordering import Reordering
from tests.slow_link import SlowLink


@pytest.fixture(scope="module")
def module_rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    """A gateway with its node as a child."""
    with Rig(tmp_path_factory.mktemp("rig")) as rig:
        yield rig


@pytest.fixture
def rig(module_rig: Rig) -> Iterator[Rig]:
    yield module_rig
    estop.reset(module_rig)


@pytest.fixture
def separate(tmp_path: Path) -> Iterator[Rig]:
    """A gateway whose node runs by itself."""
    with Rig(tmp_path, separate=True) as rig:
        yield rig


def stood(fault: Callable[[], Outcome]) -> bool:
    """A busy machine may have to try again before the arm is at full speed."""
    for _ in range(5):
        with suppress(NotAtFullSpeed):
            outcome = fault()
            break
    else:
        raise NotAtFullSpeed
    return outcome.standstill.since_command_ms <= 2 * STANDSTILL_MS and not outcome.moved_again


def test_a_network_that_swallows_everything(rig: Rig) -> None:
    with Proxy(urlsplit(rig.url).port or 0) as proxy:
        assert stood(lambda: network_blackholed(rig, proxy))


def test_what_a_frame_waited_on_its_way_is_taken_off_the_life_of_its_command(rig: Rig) -> None:
    with SlowLink(urlsplit(rig.url).port or 0, delay_s=0.01, rate=4e6) as link:
        for _ in range(5):
            with suppress(NotAtFullSpeed):
                outcome = uplink_queues(rig, link)
                break
        else:
            raise NotAtFullSpeed
    # 250 ms less what was left of the 250 that it waited; or nothing at all.
    assert outcome.life_ms is None or outcome.life_ms <= 100
    assert outcome.since_sent_ms is not None
    assert outcome.since_sent_ms <= 2 * STANDSTILL_MS
    assert not outcome.moved_again


@pytest.mark.parametrize(("one_way", "anew"), [(False, True), (True, True), (True, False)])
def test_frames_that_a_stall_delayed_move_nothing(rig: Rig, one_way: bool, anew: bool) -> None:
    with Proxy(urlsplit(rig.url).port or 0) as proxy:
        outcome = asyncio.run(stale_burst.frames(rig, proxy, one_way=one_way, anew=anew))
    assert outcome.delayed > 10
    assert (outcome.acted_on, outcome.moved, outcome.drove_again) == (0, False, True)


def test_commands_that_a_stall_delayed_move_nothing() -> None:
    for outcome in stale_burst.node_bursts(2):
        assert outcome.delayed > 10
        assert (outcome.acted_on, outcome.moved, outcome.drove_again) == (0, False, True)


def test_pictures_that_overtake_one_another_and_get_lost_drive_and_stop_as_ever(rig: Rig) -> None:
    with Reordering(urlsplit(rig.url).port or 0) as link:
        asyncio.run(drive_over(rig, f"http://127.0.0.1:{link.port}"))
        assert link.overtaken > 10 and link.dropped > 0


async def drive_over(rig: Rig, url: str) -> None:
    """At full speed, to rest when the hand goes, at full speed again, and the stop."""
    observer = rig.observer
    await wait_async(lambda: observer.state.controller is None, "nobody drives")
    observer.forget()
    async with Operator(url, TOKEN) as operator:

        async def to_full_speed() -> None:
            shown = clip(rig.next_gesture()).shown()
            async with asyncio.timeout(60):
                await operator.play(shown, until=observer.at_full_speed, flood=True)

        await operator.take_and_arm()
        await to_full_speed()
        nothing = itertools.cycle(clip("left").before[:20])
        async with asyncio.timeout(30):
            await operator.play(nothing, until=observer.stands, flood=True)
        stood = tick_now()
        await operator.play(itertools.islice(nothing, 30), flood=True)
        assert not observer.moved_between(stood, tick_now())
        await to_full_speed()
        await operator.say("stop")
        await wait_async(lambda: observer.state.mode == "stopped" and observer.stands(), "the stop")
        numbers = [frame["seq"] for frame in operator.frames]
        refused = operator.errors
    assert numbers == sorted(set(numbers)), "an older picture was taken for news"
    assert not refused
    # Commands go by what was looked at, in its order.
    sequence = [command.sequence for _, command in observer.commands]
    assert sequence == sorted(sequence)


def test_a_gateway_that_is_stopped_and_goes_on(rig: Rig) -> None:
    with rig.server.api() as api:
        before = api.get("/api/robots").json()[0]["restarts"]
        assert stood(lambda: gateway_stopped(rig))
        # Its node was not to blame.
        assert api.get("/api/robots").json()[0]["restarts"] == before


def test_a_gateway_that_is_killed_takes_its_node_to_rest_first(rig: Rig) -> None:
    assert stood(lambda: gateway_killed(rig))


def test_a_node_of_its_own_outlives_its_gateway(separate: Rig) -> None:
    assert stood(lambda: gateway_stopped(separate))
    assert stood(lambda: gateway_killed(separate))


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_node_that_fails_while_the_arm_moves_comes_back_disarmed(
    rig: Rig, number: signal.Signals
) -> None:
    outcome = asyncio.run(node_faults.one_fault(rig, number, healthy_s=0))
    assert outcome.shown_ms < outcome.back_s * 1e3
    assert outcome.disarmed


def test_a_stop_is_latched_and_survives_a_restart_of_everything(rig: Rig) -> None:
    for way in estop.WAYS:
        outcome = asyncio.run(estop.one_stop(rig, way))
        assert outcome.latched
        assert outcome.took_ms <= 2 * estop.MAX_MS
        if way != estop.WAYS[-1]:
            estop.reset(rig)
    rig.kill_everything()
    rig.restart_gateway()
    assert asyncio.run(estop.is_latched(rig))


def test_the_observer_is_not_blind(rig: Rig) -> None:
    with Observer(rig.server.endpoint()) as observer:
        wait(observer.stands, "the first states")
        with pytest.raises(RuntimeError, match="still moved"):
            moving = observer.state.model_copy(update={"velocities": (1.0,) * 6})
            observer.states[:] = [moving]
            observer.standstill(moving.tick, moving.tick)
