"""What keeps a latched stop, on disks that are slow, full, read-only, frozen, or not there."""

import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from app.errors import CannotStart
from app.link.messages import StopRequest
from app.robot import latch as module
from app.robot.controller import DT, RAMP_S
from app.robot.latch import UNREADABLE, StopLatch
from app.robot.latch_file import BLOCK, LatchFile, Unreadable
from tests.conftest import fill
from tests.disks import freezable, read_only
from tests.gateway.running import wait_for
from tests.robot.operator import JOG, Operator

STOP = StopRequest(source="page", reason="button")
OTHER = StopRequest(category="S0", source="node", reason="the loop failed")
LONG_S = 20.0


@pytest.fixture
def open_latch() -> Iterator[Callable[[Path], StopLatch]]:
    opened: list[StopLatch] = []

    def open_one(path: Path) -> StopLatch:
        opened.append(StopLatch(path))
        return opened[-1]

    yield open_one
    for latch in opened:
        latch.close()


Open = Callable[[Path], StopLatch]


class Gate:
    """The disk: everything that is written waits until it is opened."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.open = threading.Event()
        self.waiting = threading.Event()
        keep = LatchFile.keep

        def wait(file: LatchFile, what: bytes) -> None:
            self.waiting.set()
            assert self.open.wait(LONG_S)
            keep(file, what)

        monkeypatch.setattr(LatchFile, "keep", wait)


def test_what_is_kept_outlives_its_process_and_takes_no_room(
    tmp_path: Path, open_latch: Open
) -> None:
    path = tmp_path / "made" / "latch"
    latch = open_latch(path)
    assert (latch.load(), latch.state.status) == (None, "none")
    size = path.stat().st_size
    latch.set(STOP)
    assert latch.wait(LONG_S)
    assert latch.state.status == "kept"
    assert StopLatch(path).load() == STOP
    latch.clear()
    assert latch.wait(LONG_S)
    assert latch.state.status == "none"
    assert StopLatch(path).load() is None
    assert path.stat().st_size == size == 2 * BLOCK
    assert path.stat().st_mode & 0o777 == 0o600


def test_a_write_that_was_cut_short_anywhere_never_loses_a_stop(tmp_path: Path) -> None:
    path = tmp_path / "latch"
    file = LatchFile(path)
    for before, after in ((b"", b"stop"), (b"stop", b""), (b"stop", b"worse")):
        file.keep(before)
        old = path.read_bytes()
        file.keep(after)
        new = path.read_bytes()
        changed = 0 if old[:BLOCK] != new[:BLOCK] else BLOCK
        assert old[BLOCK - changed :][:BLOCK] == new[BLOCK - changed :][:BLOCK], "one block changes"
        for cut in (1, 8, 12, 20, 24, 26, 100):
            torn = bytearray(old)
            torn[changed : changed + cut] = new[changed : changed + cut]
            path.write_bytes(torn)
            try:
                kept = file.load()
            except Unreadable:
                continue  # counts as a stop
            assert kept or not before or cut >= 24, "unless the reset was written as a whole"
            assert kept in (before, after)
        path.write_bytes(new)
        assert file.load() == after


@pytest.mark.parametrize("content", [b"", b"\xff", b"{", bytes(2 * BLOCK), b"x" * 3 * BLOCK])
def test_what_cannot_be_read_counts_as_set_and_can_be_reset(
    content: bytes, tmp_path: Path, open_latch: Open
) -> None:
    path = tmp_path / "latch"
    path.write_bytes(content)
    latch = open_latch(path)
    loaded = latch.load()
    assert loaded is not None and loaded.reason == UNREADABLE
    assert latch.wait(LONG_S)
    assert StopLatch(path).load() == loaded
    latch.clear()
    assert latch.wait(LONG_S)
    assert StopLatch(path).load() is None


def test_a_file_of_before_there_were_blocks_stays_latched(tmp_path: Path, open_latch: Open) -> None:
    path = tmp_path / "latch"
    path.write_bytes(STOP.encode())
    latch = open_latch(path)
    assert latch.load() == STOP
    assert latch.wait(LONG_S)
    assert path.stat().st_size == 2 * BLOCK
    assert StopLatch(path).load() == STOP


@pytest.mark.parametrize("name", ["latch", "latch.part"])
def test_a_fifo_holds_nobody_up(name: str, tmp_path: Path, open_latch: Open) -> None:
    os.mkfifo(tmp_path / name)
    latch = open_latch(tmp_path / "latch")
    loaded = latch.load()
    if name == "latch":
        assert loaded is not None and loaded.reason == UNREADABLE
    latch.set(OTHER)
    assert latch.wait(LONG_S)
    assert StopLatch(tmp_path / "latch").load() == OTHER
    # And one that takes the place of the file while the node runs.
    (tmp_path / "latch").unlink()
    os.mkfifo(tmp_path / "latch")
    latch.set(STOP)
    assert latch.wait(LONG_S)
    assert StopLatch(tmp_path / "latch").load() == STOP


def test_a_folder_in_the_place_of_the_file_is_told_and_counts_as_set(
    tmp_path: Path, open_latch: Open
) -> None:
    (tmp_path / "latch").mkdir()
    latch = open_latch(tmp_path / "latch")
    assert latch.load() is not None
    assert latch.state.status == "failed"
    assert latch.state.reason is not None
    assert latch.state.reason.startswith("the stop latch cannot be written: ")


def test_no_file_keeps_nothing() -> None:
    latch = StopLatch(None)
    latch.set(STOP)
    assert latch.load() is None
    assert latch.state.status == "none"


def test_without_a_folder_nothing_starts() -> None:
    with pytest.raises(CannotStart, match="cannot be written; name a file in a folder of yours"):
        StopLatch(Path("/proc/nowhere/latch"))


def test_a_file_that_somebody_removed_is_laid_down_again(
    tmp_path: Path, open_latch: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "CHECK_S", 0.05)
    latch = open_latch(tmp_path / "latch")
    latch.set(STOP)
    assert latch.wait(LONG_S)
    (tmp_path / "latch").unlink()
    wait_for((tmp_path / "latch").exists, "the file")
    assert StopLatch(tmp_path / "latch").load() == STOP


def test_a_disk_that_becomes_read_only_is_told_before_a_stop_needs_it(
    tmp_path: Path, open_latch: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "CHECK_S", 0.05)
    latch = open_latch(tmp_path / "latch")
    assert latch.state.status == "none"
    with read_only(tmp_path):
        wait_for(lambda: latch.state.status == "failed", "it to be noticed")
        assert latch.state.reason == "the stop latch cannot be written: Read-only file system"
    wait_for(lambda: latch.state.status == "none", "it to be over")


def test_a_disk_that_does_not_answer_at_the_start_counts_as_a_stop(
    tmp_path: Path, open_latch: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers = threading.Event()
    load = LatchFile.load

    def wait(file: LatchFile) -> bytes | None:
        answers.wait(LONG_S)
        return load(file)

    monkeypatch.setattr(LatchFile, "load", wait)
    monkeypatch.setattr(module, "START_S", 0.1)
    latch = open_latch(tmp_path / "latch")
    loaded = latch.load()
    assert loaded is not None and loaded.reason == UNREADABLE
    assert latch.state.status == "pending"
    answers.set()
    assert latch.wait(LONG_S)
    assert latch.state.status == "kept"


def test_a_stop_ramps_in_the_same_cycle_whatever_the_disk_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, open_latch: Open
) -> None:
    operator = Operator(open_latch(tmp_path / "latch")).ready()
    gate = Gate(monkeypatch)
    operator.show(JOG, 1, 0.5)
    assert operator.arm.velocities[0] == pytest.approx(1.0)
    operator.controller.stop(STOP)
    operator.wait(DT)
    assert operator.arm.velocities[0] < 1.0
    assert operator.standstill_after() <= RAMP_S
    assert operator.state.mode == "stopped"
    assert gate.waiting.wait(LONG_S)
    latch = operator.state.latch
    assert (latch.status, latch.reason) == ("pending", "the stop is not on the disk yet")
    gate.open.set()
    wait_for(lambda: operator.state.latch.status == "kept", "the stop on the disk")


def test_a_reset_that_the_disk_does_not_know_says_so_and_arms_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, open_latch: Open
) -> None:
    operator = Operator(open_latch(tmp_path / "latch"))
    operator.controller.stop(STOP)
    wait_for(lambda: operator.state.latch.status == "kept", "the stop on the disk")
    gate = Gate(monkeypatch)
    operator.wait(0.3)
    assert operator.ask("reset").granted
    assert (operator.state.mode, operator.state.resets) == ("disarmed", 1)
    latch = operator.state.latch
    assert (latch.status, latch.reason) == ("pending", "the reset is not on the disk yet")
    operator.ask("take")
    reply = operator.ask("arm")
    assert (reply.granted, reply.code) == (False, "latch_not_kept")
    # A node that fails now comes back stopped.
    assert LatchFile(tmp_path / "latch").load() == STOP.encode()
    gate.open.set()
    wait_for(lambda: operator.state.latch.status == "none", "the reset on the disk")
    assert operator.ask("arm").granted
    assert LatchFile(tmp_path / "latch").load() == b""


def test_a_stop_right_after_a_reset_wins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, open_latch: Open
) -> None:
    operator = Operator(open_latch(tmp_path / "latch"))
    gate = Gate(monkeypatch)
    operator.controller.stop(STOP)
    operator.wait(0.3)
    for _ in range(3):
        assert operator.ask("reset").granted
        operator.controller.stop(OTHER)
    gate.open.set()
    wait_for(lambda: operator.state.latch.status == "kept", "the stop on the disk")
    assert LatchFile(tmp_path / "latch").load() == OTHER.encode()
    assert operator.state.mode == "stopped"


def test_a_full_disk_keeps_a_stop_and_its_reset(small_disk: Path, open_latch: Open) -> None:
    latch = open_latch(small_disk / "latch")
    fill(small_disk)
    latch.set(STOP)
    assert latch.wait(LONG_S)
    assert LatchFile(small_disk / "latch").load() == STOP.encode()
    latch.clear()
    assert latch.wait(LONG_S)
    assert LatchFile(small_disk / "latch").load() == b""


def test_without_room_for_a_stop_nobody_arms(small_disk: Path, open_latch: Open) -> None:
    filler = fill(small_disk)
    operator = Operator(open_latch(small_disk / "latch"))
    operator.ask("take")
    reply = operator.ask("arm")
    assert (reply.code, reply.reason) == (
        "latch_not_kept",
        "the stop latch cannot be written: No space left on device",
    )
    assert operator.state.latch.status == "failed"
    filler.unlink()
    wait_for(lambda: operator.state.latch.status == "none", "room")
    assert operator.ask("arm").granted


def test_on_a_read_only_disk_a_stop_stays_latched_and_nobody_arms(
    tmp_path: Path, open_latch: Open
) -> None:
    first = StopLatch(tmp_path / "latch")
    first.set(STOP)
    first.close()
    with read_only(tmp_path):
        operator = Operator(open_latch(tmp_path / "latch"))
        assert operator.state.mode == "stopped"
        assert operator.state.latch.status == "failed"
        operator.wait(0.3)
        assert operator.ask("reset").granted
        operator.ask("take")
        reply = operator.ask("arm")
        assert reply.code == "latch_not_kept"
        assert "Read-only file system" in reply.reason
        assert LatchFile(tmp_path / "latch").load() == STOP.encode()
    wait_for(lambda: operator.state.latch.status == "none", "the reset on the disk")
    assert operator.ask("arm").granted


def test_a_frozen_disk_holds_nobody_up(tmp_path: Path) -> None:
    with freezable(tmp_path) as disk:
        path = disk.folder / "latch"
        operator = Operator(StopLatch(path)).ready()
        operator.show(JOG, 1, 0.5)
        disk.freeze()
        operator.controller.stop(STOP)
        assert operator.standstill_after() <= RAMP_S
        assert operator.state.latch.status == "pending"
        wait_for(lambda: operator.state.latch.waiting_ms > 200, "time to pass")
        assert operator.state.latch.status == "pending"
        assert LatchFile(path).load() == b""
        disk.thaw()
        wait_for(lambda: operator.state.latch.status == "kept", "the stop on the disk")
        assert StopLatch(path).load() == STOP
        operator.controller.safety._latch.close()
