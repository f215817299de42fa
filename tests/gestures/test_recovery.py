"""What happens to a gesture database that is broken."""

import fcntl
import os
import stat
from collections.abc import Callable
from pathlib import Path

import pytest

from app.errors import CannotStart, DatabaseBroken, ForeignDatabase, NotFound
from app.gestures import GestureStore, backup, recovery
from app.gestures.backup import Place
from app.gestures.recovery import Hold
from tests.gestures.conftest import STARTER, enrol, execute, url


def open_names(place: Place) -> list[str]:
    """Open the database as a server does, and say what it holds."""
    hold = Hold(place)

    def make() -> GestureStore:
        recovery.check_there(place)
        return GestureStore(url(place.database), STARTER)

    try:
        store = recovery.open_or_set_aside(place, hold, make)
        found = [gesture.name for gesture in store.list()]
        store.close()
        return found
    finally:
        hold.close()


def flip(path: Path, at: int, to: bytes) -> None:
    with path.open("r+b") as file:
        file.seek(at)
        file.write(to)


def change_template(path: Path) -> None:
    execute(path, "UPDATE sample SET template = zeroblob(600)")


def break_name(path: Path) -> None:
    execute(path, "UPDATE gesture SET name = CAST(x'ff41' AS TEXT)")


def break_schema(path: Path) -> None:
    # SQLite puts the damaged name into its message, which is then no text.
    data = path.read_bytes()
    path.write_bytes(data.replace(b"CREATE TABLE sample", b"CREATE \xff\xfe\xffLE sample"))


DAMAGES: dict[str, Callable[[Path], object]] = {
    "nonsense": lambda path: path.write_bytes(b"not a database at all" * 500),
    "cut": lambda path: os.truncate(path, 5000),
    "empty": lambda path: os.truncate(path, 0),
    "gone": lambda path: path.unlink(),
    "magic": lambda path: flip(path, 3, b"\0"),
    "a read-only format": lambda path: flip(path, 18, b"\7"),
    "template": change_template,
    "name": break_name,
    "schema": break_schema,
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_it_is_set_aside_whole_and_a_restore_brings_the_backup_back(
    place: Place, damage: str
) -> None:
    enrol(place, "mine")
    made = backup.make(place, 5)
    DAMAGES[damage](place.database)
    was = place.database.read_bytes() if place.database.exists() else None
    assert "mine" not in open_names(place)
    aside = list(place.database.parent.glob("*.broken-*"))
    if was is None:
        assert aside == []
    else:
        assert [path.read_bytes() for path in aside] == [was]
    told = recovery.problem(place)
    assert told is not None and "cannot be armed" in told
    assert f"farhand gestures restore --data-dir {place.backups.parent}" in told
    # A restart forgets nothing.
    assert len(open_names(place)) == 10
    assert recovery.problem(place) == told

    result = recovery.restore(place)
    assert (result.backup, result.gestures) == (made, 1)
    assert recovery.problem(place) is None
    assert open_names(place) == ["mine"]
    assert stat.S_IMODE(place.database.stat().st_mode) == 0o600
    (kept,) = result.kept
    store = GestureStore(url(kept), None)
    assert len(store.list()) == 10
    store.close()


def test_a_new_folder_has_no_problem(place: Place) -> None:
    assert len(open_names(place)) == 10
    assert recovery.problem(place) is None
    assert not recovery.accept(place)


def test_a_log_goes_aside_with_its_database(place: Place) -> None:
    enrol(place, "mine")
    place.database.write_bytes(b"x" * 9000)
    log = place.database.with_name("gestures.db-wal")
    log.write_bytes(b"y" * 100)
    open_names(place)
    (kept,) = place.database.parent.glob("*.broken-*-wal")
    assert kept.read_bytes() == b"y" * 100


def test_what_is_new_can_be_accepted(place: Place) -> None:
    place.database.write_bytes(b"x" * 9000)
    open_names(place)
    assert recovery.problem(place) is not None
    assert recovery.accept(place)
    assert recovery.problem(place) is None


@pytest.mark.parametrize("text", ["", "{", "[]", '{"why": 1}', "\udcff"])
def test_an_unreadable_note_still_keeps_the_robot_from_being_armed(place: Place, text: str) -> None:
    place.marker.write_bytes(text.encode(errors="surrogateescape"))
    told = recovery.problem(place)
    assert told is not None and told.startswith("The gesture database was lost. ")


def test_a_sound_database_that_is_not_ours_is_left_alone(place: Place) -> None:
    execute(place.database, "CREATE TABLE customers (id INTEGER)")
    with pytest.raises(ForeignDatabase, match="customers"):
        open_names(place)
    assert recovery.problem(place) is None


def test_nothing_is_set_aside_under_another_server(place: Place) -> None:
    place.database.write_bytes(b"x" * 9000)
    other = Hold(place)
    with pytest.raises(DatabaseBroken, match="Another server has it open"):
        open_names(place)
    other.close()
    assert recovery.problem(place) is None
    assert len(open_names(place)) == 10


def test_a_restore_and_a_server_exclude_each_other(place: Place) -> None:
    enrol(place, "mine")
    backup.make(place, 5)
    hold = Hold(place)
    with pytest.raises(CannotStart, match="a server has the gesture database open; end it first"):
        recovery.restore(place)
    hold.close()
    handle = os.open(place.lock, os.O_RDWR)
    fcntl.flock(handle, fcntl.LOCK_EX)
    with pytest.raises(CannotStart, match="is being restored"):
        Hold(place)
    os.close(handle)
    recovery.restore(place)


def test_a_damaged_or_missing_backup_changes_nothing(place: Place) -> None:
    enrol(place, "mine")
    before = place.database.read_bytes()
    bad = place.backups.parent / "bad.db"
    bad.write_bytes(b"z" * 9000)
    with pytest.raises(DatabaseBroken, match=r"bad\.db"):
        recovery.restore(place, bad)
    with pytest.raises(NotFound, match="there is no backup"):
        recovery.restore(place, bad.with_name("none.db"))
    with pytest.raises(NotFound, match="no good backup"):
        recovery.restore(place)
    assert place.database.read_bytes() == before
