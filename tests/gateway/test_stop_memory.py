"""A robot that was stopped comes back stopped, whatever its own latch has become."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.gateway.stop_memory import AGAIN_S, StopMemory
from app.link.messages import LatchState, State, StopRequest
from tests.gateway.running import Running, StandIn, running, settings_for, wait_for
from tests.gateway.test_drive import state

STOP = StopRequest(source="page", reason="button")
NOT_KEPT = LatchState(
    status="failed",
    reason="the stop latch cannot be written: No space left on device",
    waiting_ms=1500,
)


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def memory(tmp_path: Path, clock: Clock) -> Iterator[StopMemory]:
    memory = StopMemory(tmp_path / "remembered", clock)
    yield memory
    memory.close()


def stopped(resets: int = 0) -> State:
    return state(mode="stopped", armed=False, stop="S1", reason="button (page)", resets=resets)


def standing(resets: int = 0) -> State:
    return state(mode="disarmed", armed=False, resets=resets)


def test_what_was_never_stopped_owes_nothing(memory: StopMemory) -> None:
    assert memory.saw(standing()) is None
    assert memory.owed is None
    assert memory.kept.status == "none"


def test_a_reset_that_the_robot_counts_ends_it(memory: StopMemory) -> None:
    memory.saw(stopped(resets=2))
    assert memory.remembered is not None
    assert memory.owed is None, "the robot says so itself"
    assert memory.saw(standing(resets=3)) is None
    assert (memory.remembered, memory.owed) == (None, None)


def test_who_comes_back_without_its_stop_is_stopped_again_until_it_says_so(
    memory: StopMemory, clock: Clock
) -> None:
    memory.saw(stopped(resets=2))
    again = memory.saw(standing(resets=0))
    assert again is not None and again.reason == "button (page)"
    assert memory.saw(standing(resets=0)) is None, "it was sent a moment ago"
    clock.now += 2 * AGAIN_S
    assert memory.saw(standing(resets=0)) == again
    assert memory.owed == again
    memory.saw(stopped(resets=0))
    assert memory.owed is None
    assert memory.saw(standing(resets=1)) is None
    assert memory.remembered is None


def test_a_stop_that_was_asked_for_is_owed_until_it_is_seen(
    memory: StopMemory, clock: Clock
) -> None:
    memory.saw(stopped())
    memory.was_reset()
    memory.asked(STOP)
    # A state from before it arrived, which counts the reset: the stop is not over by it.
    assert memory.saw(standing(resets=1)) is None
    assert memory.owed == STOP
    clock.now += 2 * AGAIN_S
    assert memory.saw(standing(resets=1)) == STOP
    memory.saw(stopped(resets=1))
    assert memory.owed is None
    assert memory.remembered == STOP


def test_it_outlives_its_process(tmp_path: Path) -> None:
    path = tmp_path / "remembered"
    first = StopMemory(path)
    first.saw(stopped(resets=5))
    first.close()
    second = StopMemory(path)
    assert second.remembered == second.owed
    assert second.saw(standing(resets=0)) is not None
    second.was_reset()
    second.close()
    third = StopMemory(path)
    assert third.saw(standing(resets=0)) is None
    third.close()


def test_one_that_cannot_be_read_counts_as_stopped(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "remembered")
    memory = StopMemory(tmp_path / "remembered")
    assert memory.owed is not None
    memory.close()


@pytest.fixture
def server(node: StandIn, tmp_path: Path) -> Iterator[Running]:
    with running(settings_for(tmp_path, node.endpoint)) as server:
        wait_for(lambda: server.hub.robot.online, "the robot")
        yield server


def test_a_node_that_lost_its_latch_is_stopped_before_anybody_arms(
    server: Running, node: StandIn
) -> None:
    assert server.http.post("/api/robots/puma/stop").status_code == 200
    before = len(node.stops)
    with server.operator() as operator:
        operator.send("take_control")
        operator.next("robot", controller=operator.hello["session"])
        node.deaf_to_stops = True
        node.mode = "disarmed"  # as a node that was started again, and found no latch
        operator.next("robot", mode="disarmed")
        operator.send("arm")
        refused = operator.next("error")
        assert refused["code"] == "latched"
        assert "does not say so" in refused["message"]
        assert not [request for request in node.requests if request.kind == "arm"]
        node.deaf_to_stops = False
        operator.next("robot", mode="stopped")
        assert len(node.stops) > before
        assert node.stops[-1].reason == "a stop was asked for over REST"
        operator.send("reset")
        operator.next("robot", mode="disarmed")
        operator.send("arm")
        operator.next("robot", mode="armed")


def test_a_gateway_that_was_started_again_remembers_the_stop(tmp_path: Path) -> None:
    with StandIn(tmp_path / "one") as node:
        with running(settings_for(tmp_path, node.endpoint)) as server:
            wait_for(lambda: server.hub.robot.online, "the robot")
            assert server.http.post("/api/robots/puma/stop").status_code == 200
        node.mode = "disarmed"  # it has failed meanwhile, and lost its latch
        with running(settings_for(tmp_path, node.endpoint)) as server:
            wait_for(lambda: node.mode == "stopped", "the stop again")
            assert server.http.post("/api/robots/puma/reset").status_code == 200
        assert node.mode == "disarmed"
        with running(settings_for(tmp_path, node.endpoint)) as server:
            wait_for(lambda: server.hub.robot.online, "the robot")
            assert server.hub.robot.wait_newer(20, lambda state: state.mode == "disarmed")
            assert server.hub.robot.stop_memory.remembered is None


def test_what_the_disk_does_not_know_is_told_everywhere(server: Running, node: StandIn) -> None:
    kept = server.http.get("/api/robots/puma").json()
    assert kept["latch"] == {"status": "none", "reason": None, "waiting_ms": 0}
    assert kept["remembered"]["status"] == "none"
    node.latch = NOT_KEPT
    told = NOT_KEPT.model_dump()
    wait_for(lambda: server.hub.robot.state.latch == NOT_KEPT, "the state")
    assert server.http.get("/api/robots/puma").json()["latch"] == told
    assert server.http.get("/api/robots").json()[0]["latch"] == told
    assert server.http.get("/api/health").json()["robots"][0]["latch"] == told
    with server.operator() as operator:
        assert operator.next("robot", latch=told)
