"""Backups of the gesture database."""

import os
import stat
from pathlib import Path

import pytest

from app.errors import DatabaseBroken, NotFound, StorageFull
from app.gestures import GestureStore, backup
from app.gestures.backup import Place
from app.link.actions import Home
from tests.conftest import fill
from tests.gestures.conftest import enrol, execute, template, url


def names(path: Path) -> list[str]:
    store = GestureStore(url(path), None)
    try:
        return [gesture.name for gesture in store.list()]
    finally:
        store.close()


def test_a_backup_is_one_whole_file_of_the_owner_alone(place: Place) -> None:
    enrol(place, "one", "two")
    old = os.umask(0)
    try:
        made = backup.make(place, 5)
    finally:
        os.umask(old)
    assert made is not None
    assert list(place.backups.iterdir()) == [made]
    assert stat.S_IMODE(made.stat().st_mode) == 0o600
    assert stat.S_IMODE(place.backups.stat().st_mode) == 0o700
    assert backup.check(made) == 2
    assert list(place.backups.iterdir()) == [made]
    assert names(made) == ["one", "two"]


def test_it_holds_what_was_acknowledged_while_a_server_has_the_database_open(place: Place) -> None:
    store = GestureStore(url(place.database), None)
    try:
        store.create("in the log", Home(), [template()])
        made = backup.make(place, 5)
        assert made is not None and names(made) == ["in the log"]
    finally:
        store.close()


def test_only_what_changed_is_backed_up_and_the_newest_are_kept(place: Place) -> None:
    made = []
    for number in range(5):
        enrol(place, f"gesture {number}")
        made.append(backup.make(place, 3))
        assert backup.make(place, 3) is None
    kept = [each.path for each in backup.found(place)]
    assert kept == list(reversed(made[2:]))
    assert backup.make(place, 0) is None


def test_the_newest_stays_the_newest_when_the_clock_is_set_back(place: Place) -> None:
    enrol(place, "old")
    first = backup.make(place, 2)
    assert first is not None
    future = first.with_name("gestures-29990101T000000.000000Z.db")
    first.rename(future)
    enrol(place, "new")
    second = backup.make(place, 2)
    assert [each.path for each in backup.found(place)] == [second, future]


def test_a_broken_database_pushes_no_good_backup_out(place: Place) -> None:
    enrol(place, "good")
    first = backup.make(place, 1)
    # Past the checks of pages: what stands there has changed.
    execute(
        place.database,
        "UPDATE sample SET template = zeroblob(600)",
        "UPDATE gallery SET version = 99",
    )
    with pytest.raises(DatabaseBroken, match="gesture 'good'") as caught:
        backup.make(place, 1)
    assert str(place.database) in caught.value.message
    assert ".copy" not in caught.value.message
    assert list(place.backups.iterdir()) == [first]


def test_the_newest_good_one_is_found_and_damaged_ones_are_passed_over(place: Place) -> None:
    with pytest.raises(NotFound, match="no good backup"):
        backup.newest_good(place)
    enrol(place, "a")
    first = backup.make(place, 5)
    for damage in (b"", b"nonsense" * 1000):
        enrol(place, f"b{len(damage)}")
        made = backup.make(place, 5)
        assert made is not None
        made.write_bytes(damage)
    assert backup.newest_good(place).path == first
    assert len(backup.found(place)) == 3


def test_what_a_crash_left_half_made_is_cleared_away(place: Place) -> None:
    place.backups.mkdir()
    left, fresh = place.backups / ".copy-0a", place.backups / ".copy-0b"
    for path in (left, fresh):
        path.touch()
    os.utime(left, (1, 1))
    enrol(place, "a")
    backup.make(place, 5)
    assert not left.exists()
    assert fresh.exists(), "another process may be making it"


def test_a_full_disk_drops_no_backup(place: Place, small_disk: Path) -> None:
    enrol(place, "a")
    place = Place(place.database, small_disk / "backups")
    made = backup.make(place, 1)
    fill(small_disk)
    enrol(place, "b")
    with pytest.raises(StorageFull, match="no space for a copy"):
        backup.make(place, 1)
    assert list(place.backups.iterdir()) == [made]
