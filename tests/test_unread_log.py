"""Nobody reads the server's log any more, while the arm moves and when it has to stop."""

import asyncio
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from prometheus_client.parser import text_string_to_metric_families

from app.link.actions import JogJoint
from app.link.messages import LeaseRequest, StopRequest
from app.link.session import socket_endpoint
from app.robot.latch_file import LatchFile
from benchmarks import estop
from benchmarks.node_process import Driver
from benchmarks.observer import FULL_SPEED, STANDSTILL_MS, Observer, tick_now, wait
from benchmarks.rig import Rig
from benchmarks.siege import unread_pipe
from tests.e2e.running import start_server, stop_server
from tests.unread import PipeReader, Reader, TerminalReader


@pytest.fixture(params=[PipeReader, TerminalReader])
def reader(request: pytest.FixtureRequest) -> Iterator[Reader]:
    with request.param() as reader:
        yield reader


def lines_dropped(api: httpx.Client) -> float:
    families = text_string_to_metric_families(api.get("/metrics").text)
    return next(
        each.samples[0].value for each in families if each.name == "farhand_log_lines_dropped"
    )


def test_the_arm_moves_and_stops_and_the_server_answers(reader: Reader, tmp_path: Path) -> None:
    with Rig(tmp_path, stderr=reader.handle) as rig, rig.server.api() as api:
        wait(lambda: ": robot puma listens on" in reader.text, "the node's log")
        reader.stop()
        for way in ("driver", "rest"):
            outcome = asyncio.run(estop.one_stop(rig, way))
            assert outcome.latched, outcome.why_not
            assert outcome.took_ms <= 2 * estop.MAX_MS
            if way == "driver":
                estop.reset(rig)

        # Whatever becomes of the node, and it has much to say, neither waits for the other.
        for number in (signal.SIGSTOP, signal.SIGKILL):
            before = api.get("/api/robots/puma").json()["restarts"]
            rig.server.node().send_signal(number)

            def back(before: int = before) -> bool:
                robot = api.get("/api/robots/puma").json()
                return bool(robot["restarts"] > before and robot["online"])

            wait(back, "the next node")
            assert api.get("/api/robots/puma").json()["mode"] == "stopped"

        # What does not fit is counted, and told as soon as somebody reads again.
        while not lines_dropped(api):
            assert api.get("/api/health").status_code == 200
        assert "were dropped" not in reader.text
        reader.go_on()
        wait(lambda: "lines for standard error were dropped" in reader.text, "the count")
        api.get("/api/after")
        wait(lambda: "GET /api/after 404" in reader.text, "what is logged from now on")


def test_a_server_ends_in_order_though_nobody_reads_its_log(reader: Reader, tmp_path: Path) -> None:
    with Rig(tmp_path, stderr=reader.handle) as rig, rig.server.api() as api:
        reader.stop()
        assert api.get("/api/health").status_code == 200
        node = rig.server.node()
        rig.server.process.terminate()
        assert rig.server.process.wait(30) == 0
        assert not node.is_running()


def test_a_node_that_runs_by_itself(reader: Reader, tmp_path: Path) -> None:
    endpoint = socket_endpoint(tmp_path / "link" / "n")
    latch = tmp_path / "latch"
    command = [sys.executable, "-m", "app", "robot", "--endpoint", endpoint, "--latch", str(latch)]
    node = subprocess.Popen(command, stdout=reader.handle, stderr=reader.handle)
    try:
        with Observer(endpoint) as observer:
            driver = Driver(endpoint, "anna")
            reader.stop()
            driver.ready()
            driver.show(JogJoint(joint=1, velocity=FULL_SPEED), 1, observer.at_full_speed)
            pressed = tick_now()
            driver.end.stop(StopRequest(source="test", reason="a test"))
            wait(lambda: observer.state.mode == "stopped" and observer.stands(), "the stop")
            stood = observer.standstill(pressed, tick_now())
            assert stood.since_fault_ms <= 2 * STANDSTILL_MS
            wait(lambda: LatchFile(latch).load(), "the latch")

            def lost() -> int:
                loop = observer.state.loop
                return 0 if loop is None else loop.log_lines_dropped

            while not lost():
                assert not driver.end.ask(LeaseRequest(kind="arm", holder="x"), 5).granted
            reader.go_on()
            wait(lambda: "were dropped" in reader.text, "the count")
            driver.end.close()
        node.terminate()
        assert node.wait(30) == 0
        reader.finish()
        assert "INFO ending: asked to end" in reader.text
    finally:
        node.kill()
        node.wait()


def test_a_server_starts_though_its_log_is_full_already(tmp_path: Path) -> None:
    # It is told at once that a token on the command line is seen by others.
    with unread_pipe() as full:
        server = start_server(tmp_path, stderr=full)
        try:
            with server.api() as api:
                assert api.get("/api/health").status_code == 200
        finally:
            stop_server(server)
