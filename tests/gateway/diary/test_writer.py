"""The thread that writes: it never holds anybody up, and counts what is lost."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from app.errors import MemoryUnavailable, StorageFull
from app.gateway.diary.writer import SLEW_MS, WAITING, Writer
from app.memory import Database, EventStore
from tests.gateway.running import wait_for


class Disk(EventStore):
    """A store whose disk can be slow, full or stranger."""

    error: Exception | None = None

    def __init__(self, database: Database) -> None:
        super().__init__(database, 10_000, 1 << 24)
        self.free = threading.Event()
        self.free.set()

    def write(self, items: Any) -> int | None:
        self.free.wait(20)
        if self.error is not None:
            raise self.error
        return super().write(items)


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Disk]:
    database = Database(tmp_path / "memory.db")
    yield Disk(database)
    database.close()


def test_events_are_written_in_order_and_told(disk: Disk) -> None:
    told: list[int] = []
    writer = Writer(disk, told.append)
    token = writer.record("keys", lasts=True, who="me")
    writer.record("reset")
    writer.picture(token, b"jpeg")
    writer.finish(token, presses=2)
    writer.finish(token, presses=99)  # only once
    writer.finish(12345)
    wait_for(lambda: told and disk.page(5)[-1].took_ms is not None, "the events")
    reset, keys = disk.page(5)
    assert (reset.kind, keys.kind) == ("reset", "keys")
    assert keys.data == {"who": "me", "presses": 2}
    assert keys.picture
    assert told[-1] == reset.id
    writer.close()
    assert writer.lost == 0


def test_closing_writes_what_waits(disk: Disk) -> None:
    writer = Writer(disk)
    for _ in range(100):
        writer.record("reset")
    writer.close()
    assert len(disk.page(200)) == 100


def test_a_slow_disk_makes_nobody_wait_and_what_does_not_fit_is_counted(disk: Disk) -> None:
    disk.free.clear()
    writer = Writer(disk)
    started = time.monotonic()
    for _ in range(WAITING + 500):
        writer.record("reset")
    assert time.monotonic() - started < 5, "it waited for the disk"
    lost = writer.lost
    assert 0 < lost <= 500
    disk.free.set()
    writer.close()
    assert len(disk.page(10_000)) == WAITING + 500 - lost


@pytest.mark.parametrize(
    "error", [StorageFull("full"), MemoryUnavailable("gone"), ZeroDivisionError("a mistake")]
)
def test_what_cannot_be_written_is_lost_and_what_comes_later_is_not(
    disk: Disk, error: Exception
) -> None:
    writer = Writer(disk)
    disk.error = error
    writer.record("stop")
    wait_for(lambda: writer.lost == 1, "the loss to be noticed")
    disk.error = None
    writer.record("reset")
    writer.close()
    assert [event.kind for event in disk.page(5)] == ["reset"]


def test_without_a_store_everything_is_lost_and_nothing_breaks() -> None:
    writer = Writer(None)
    for _ in range(2 * WAITING):
        writer.finish(writer.record("keys", lasts=True))
    writer.picture(1, b"jpeg")
    assert writer.lost == 2 * WAITING
    writer.close()


def test_a_clock_that_is_nudged_back_stands_still_and_one_that_is_set_is_believed(
    disk: Disk,
) -> None:
    now = 1_000_000
    writer = Writer(disk, clock=lambda: now)
    times = (0, -SLEW_MS + 1, 10, -SLEW_MS * 3, -SLEW_MS * 3 + 1)
    for offset in times:
        now = 1_000_000 + offset
        writer.record("reset")
    writer.close()
    written = [event.at_ms - 1_000_000 for event in reversed(disk.page(10))]
    assert written == [0, 0, 10, -SLEW_MS * 3, -SLEW_MS * 3 + 1]
