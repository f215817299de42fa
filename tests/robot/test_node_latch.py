"""A real node whose latch lies on a disk that fails: the arm stops all the same, and stays so."""

import os
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from app.link.messages import StopRequest
from tests.conftest import fill
from tests.disks import freezable, read_only
from tests.robot.test_node import JOG, NodeProcess, Remote, wait_for

STOP = StopRequest(source="test", reason="enough")


@pytest.fixture
def ends() -> Iterator[ExitStack]:
    """Ends what a test began, the last first: a frozen disk is thawed before its node is killed."""
    with ExitStack() as stack:
        yield stack


def start(ends: ExitStack, latch: Path) -> tuple[NodeProcess, Remote]:
    node = NodeProcess(latch=latch)
    ends.callback(node.close)
    remote = Remote(node.endpoint)
    ends.callback(remote.end.close)
    return node, remote


def stop_at_speed(remote: Remote) -> None:
    tick = remote.state.tick
    remote.end.stop(STOP)
    wait_for(lambda: remote.state.mode == "stopped", "the stop", 5)
    wait_for(lambda: remote.speed() < 1e-3, "standstill", 5)
    assert remote.moved_after(tick) < 500


def comes_back_stopped(node: NodeProcess, remote: Remote) -> None:
    remote.end.close()
    node.process.kill()
    node.process.wait(20)
    node.start()
    again = Remote(node.endpoint, "ben")
    assert again.states[0].mode == "stopped"
    assert again.state.reason == "enough (from before the node started)"
    again.end.close()


def test_a_fifo_in_the_way_of_the_latch(ends: ExitStack, tmp_path: Path) -> None:
    node, remote = start(ends, tmp_path / "latch")
    remote.ready()
    remote.show(JOG, 1, lambda: remote.speed() > 0.9, "joint 1 moves")
    (tmp_path / "latch").unlink(missing_ok=True)
    for name in ("latch", "latch.part"):
        os.mkfifo(tmp_path / name)
    stop_at_speed(remote)
    wait_for(lambda: remote.state.latch.status == "kept", "the stop on the disk")
    comes_back_stopped(node, remote)


def test_a_node_that_finds_a_fifo_starts_stopped(ends: ExitStack, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "latch")
    _, remote = start(ends, tmp_path / "latch")
    assert remote.states[0].mode == "stopped"
    remote.ask("take")
    assert remote.ask("arm").code == "latched"
    assert remote.ask("reset").granted
    wait_for(lambda: remote.state.latch.status == "none", "the reset on the disk")
    assert remote.ask("arm").granted


def test_a_full_disk(ends: ExitStack, small_disk: Path) -> None:
    node, remote = start(ends, small_disk / "latch")
    remote.ready()
    remote.show(JOG, 1, lambda: remote.speed() > 0.9, "joint 1 moves")
    fill(small_disk)
    stop_at_speed(remote)
    wait_for(lambda: remote.state.latch.status == "kept", "the stop on the disk")
    comes_back_stopped(node, remote)


def test_a_frozen_disk(ends: ExitStack, tmp_path: Path) -> None:
    disk = ends.enter_context(freezable(tmp_path))
    node, remote = start(ends, disk.folder / "latch")
    ends.callback(disk.thaw)
    remote.ready()
    remote.show(JOG, 1, lambda: remote.speed() > 0.9, "joint 1 moves")
    disk.freeze()
    stop_at_speed(remote)
    wait_for(lambda: remote.state.latch.waiting_ms > 1000, "a second")
    assert remote.state.latch.status == "pending"
    assert remote.state.latch.reason == "the stop is not on the disk yet"
    assert (remote.state.loop is None) or remote.state.loop.late_max_ms < 500, "the loop goes on"
    disk.thaw()
    wait_for(lambda: remote.state.latch.status == "kept", "the stop on the disk")
    comes_back_stopped(node, remote)


def test_a_read_only_disk(ends: ExitStack, tmp_path: Path) -> None:
    ends.enter_context(read_only(tmp_path))
    _, remote = start(ends, tmp_path / "latch")
    remote.ask("take")
    reply = remote.ask("arm")
    assert (reply.granted, reply.code) == (False, "latch_not_kept")
    assert reply.reason == "the stop latch cannot be written: Read-only file system"
    assert remote.state.latch.status == "failed"
    stop_at_speed(remote)
