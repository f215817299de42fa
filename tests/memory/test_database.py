"""The file: made, brought up to date, set aside when it is damaged, and full."""

import sqlite3
import threading
from pathlib import Path

import pytest

from app.errors import FarhandError, MemoryUnavailable, StorageFull
from app.memory import Database, EventStore, NewEvent, open_memory
from app.memory import database as module
from app.memory.database import DAMAGED, STEPS, MemoryDamaged
from tests.conftest import fill


def version(path: Path) -> int:
    connection = sqlite3.connect(path)
    try:
        return int(connection.execute("PRAGMA user_version").fetchone()[0])
    finally:
        connection.close()


def test_what_was_written_is_there_after_a_restart(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    for run in (1, 2):
        database = open_memory(path)
        store = EventStore(database, 100, 1 << 20)
        assert len(store.page(10)) == run - 1
        store.write([NewEvent(1, run, "started")])
        database.close()
    assert version(path) == len(STEPS)


@pytest.mark.parametrize("former", range(1, len(STEPS)))
def test_a_file_of_every_version_so_far_is_brought_up_to_date(tmp_path: Path, former: int) -> None:
    path = tmp_path / "memory.db"
    connection = sqlite3.connect(path)
    for statement in (each for step in STEPS[:former] for each in step):
        connection.execute(statement)
    connection.execute(
        "INSERT INTO events (at_ms, kind, bytes, data) VALUES (5, 'reset', 64, '{}')"
    )
    connection.execute(f"PRAGMA user_version={former}")
    connection.commit()
    connection.close()
    database = Database(path)
    (event,) = EventStore(database, 100, 1 << 20).page(10)
    assert (event.kind, event.at_ms) == ("reset", 5)
    database.close()
    assert version(path) == len(STEPS)


def test_a_step_that_breaks_off_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "memory.db"
    Database(path).close()
    broken = (*STEPS, ("CREATE TABLE more (x)", "CREATE TABLE events (x)"))
    monkeypatch.setattr(module, "STEPS", broken)
    with pytest.raises(MemoryUnavailable, match="already exists"):
        Database(path)
    assert version(path) == len(STEPS)
    monkeypatch.setattr(module, "STEPS", (*STEPS, ("CREATE TABLE more (x)",)))
    Database(path).close()
    assert version(path) == len(STEPS) + 1


@pytest.mark.parametrize("how", ["text", "cut", "scribbled"])
def test_a_damaged_file_is_set_aside_and_a_new_one_begun(tmp_path: Path, how: str) -> None:
    path = tmp_path / "memory.db"
    database = Database(path)
    store = EventStore(database, 1000, 1 << 20)
    store.write([NewEvent(n, n, "keys", {"who": "x" * 100}) for n in range(200)])
    database.close()
    whole = path.read_bytes()
    broken = {
        "text": b"this is no database\n" * 400,
        "cut": whole[: len(whole) // 2],
        "scribbled": whole[:4096] + bytes(8192) + whole[12288:],
    }[how]
    path.write_bytes(broken)
    with pytest.raises(MemoryDamaged) as caught:
        Database(path)
    assert str(path) in caught.value.message
    assert "\n" not in caught.value.message
    database = open_memory(path)
    assert EventStore(database, 1000, 1 << 20).page(10) == []
    database.close()
    assert path.with_name(path.name + DAMAGED).read_bytes() == broken


def test_what_is_newer_or_of_something_else_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "memory.db"
    Database(path).close()
    connection = sqlite3.connect(path)
    connection.execute("PRAGMA user_version=99")
    connection.close()
    with pytest.raises(MemoryUnavailable, match="a newer Farhand"):
        open_memory(path)
    other = tmp_path / "other.db"
    connection = sqlite3.connect(other)
    connection.execute("CREATE TABLE mine (x)")
    connection.close()
    with pytest.raises(MemoryUnavailable, match="holds something else"):
        open_memory(other)
    with pytest.raises(MemoryUnavailable, match="cannot be used"):
        open_memory(tmp_path / "nowhere" / "memory.db")


def test_a_full_disk_loses_what_is_new_and_keeps_what_is_there(small_disk: Path) -> None:
    database = open_memory(small_disk / "memory.db")
    store = EventStore(database, 10_000, 64 << 20)
    store.write([NewEvent(0, 0, "started")])
    filler = fill(small_disk)
    lost = 0
    for number in range(1, 50):
        try:
            store.write([NewEvent(number, number, "gesture", template=bytes(60_000))])
        except (StorageFull, MemoryUnavailable):
            lost += 1
    assert lost > 40
    written = len(store.page(200))
    assert written == 50 - lost
    filler.unlink()
    store.write([NewEvent(99, 99, "reset")])
    assert store.page(1)[0].kind == "reset"
    assert len(store.page(200)) == written + 1
    database.close()


def test_readers_wait_for_no_writer(tmp_path: Path) -> None:
    database = Database(tmp_path / "memory.db")
    store = EventStore(database, 100, 1 << 20)
    store.write([NewEvent(1, 1, "started")])
    done = threading.Event()
    with database.write() as connection:
        connection.execute("DELETE FROM events")
        seen: list[int] = []

        def read() -> None:
            seen.append(len(store.page(10)))
            done.set()

        threading.Thread(target=read).start()
        assert done.wait(10)
        assert seen == [1]
    assert store.page(10) == []
    database.close()


def test_a_file_that_another_program_holds_is_one_clear_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "BUSY_S", 0.05)
    path = tmp_path / "memory.db"
    database = Database(path)
    store = EventStore(database, 100, 1 << 20)
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    with pytest.raises(FarhandError, match="locked"):
        store.write([NewEvent(1, 1, "started")])
    other.execute("ROLLBACK")
    store.write([NewEvent(1, 1, "started")])
    other.close()
    database.close()
