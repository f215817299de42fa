import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest
from sqlalchemy import URL

from app.errors import CannotStart, DatabaseBroken, FarhandError
from app.gestures import GestureStore
from app.link.actions import Home, JogCartesian, JogJoint, Sequence, Stop
from tests.gestures.conftest import STARTER, execute, template, url

DATA = Path(__file__).parent / "data"
"""What each version so far wrote: a dump by ``sqlite3.Connection.iterdump``."""


def make(path: Path) -> None:
    store = GestureStore(url(path), None)
    for number in range(8):
        store.create(f"gesture {number}", Home(), [template(number), template(number + 50)])
    store.close()


def broken(path: Path) -> str:
    with pytest.raises(DatabaseBroken) as caught:
        GestureStore(url(path), None)
    message = caught.value.message
    assert "\n" not in message
    assert str(path) in message
    return message


def test_a_new_database_has_the_starter_set(tmp_path: Path) -> None:
    store = GestureStore(url(tmp_path / "x.db"), STARTER)
    assert len(store.list()) == 10
    store.close()


def test_only_a_new_database_gets_it(tmp_path: Path) -> None:
    store = GestureStore(url(tmp_path / "x.db"), STARTER)
    for gesture in store.list():
        store.delete(gesture.id)
    store.close()
    again = GestureStore(url(tmp_path / "x.db"), STARTER)
    assert again.list() == []
    again.close()


def test_an_empty_file_counts_as_new(tmp_path: Path) -> None:
    (tmp_path / "x.db").touch()
    store = GestureStore(url(tmp_path / "x.db"), STARTER)
    assert len(store.list()) == 10
    store.close()


def test_a_broken_starter_set_leaves_no_half_made_database(tmp_path: Path) -> None:
    bad = tmp_path / "set"
    shutil.copytree(STARTER, bad)
    (bad / "stop" / "01.png").write_bytes(b"nonsense")
    with pytest.raises(CannotStart, match=r"the starter set .* 'stop/01.png' is not a PNG file"):
        GestureStore(url(tmp_path / "x.db"), bad)
    store = GestureStore(url(tmp_path / "x.db"), STARTER)
    assert len(store.list()) == 10
    store.close()


def test_commits_are_durable_and_keys_are_kept(store: GestureStore) -> None:
    with store.base.engine.connect() as connection:
        pragma = {
            name: connection.exec_driver_sql(f"PRAGMA {name}").scalar_one()
            for name in ("journal_mode", "synchronous", "foreign_keys")
        }
    assert pragma == {"journal_mode": "wal", "synchronous": 2, "foreign_keys": 1}


def test_a_path_with_special_signs_works(tmp_path: Path) -> None:
    folder = tmp_path / "a b ?#%20é"
    folder.mkdir()
    store = GestureStore(URL.create("sqlite", database=str(folder / "x.db")), None)
    store.create("a", Home(), [template()])
    store.close()
    assert (folder / "x.db").is_file()


def test_a_text_file_is_no_database(tmp_path: Path) -> None:
    path = tmp_path / "x.db"
    path.write_text("dear diary, " * 500)
    message = broken(path)
    assert message.endswith("or move it away to start again from the starter set")
    assert "file is not a database" in message
    assert path.read_text().startswith("dear diary")


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8, 0.97])
def test_a_cut_database_is_broken(tmp_path: Path, share: float) -> None:
    path = tmp_path / "x.db"
    make(path)
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    broken(path)


def test_no_flipped_bytes_change_what_a_gesture_does(tmp_path: Path) -> None:
    """Whatever is hit: either the store refuses, or every gesture is as it was."""
    path = tmp_path / "x.db"
    make(path)
    store = GestureStore(url(path), None)
    before = store.list()
    store.close()
    good = path.read_bytes()
    chance = random.Random(1)
    refused = 0
    for _ in range(60):
        data = bytearray(good)
        for _ in range(3):
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        path.write_bytes(data)
        try:
            store = GestureStore(url(path), None)
        except DatabaseBroken:
            refused += 1
        else:
            assert store.list() == before
            store.close()
    assert refused > 10


@pytest.mark.parametrize(
    "change",
    [
        'UPDATE gesture SET action = \'{"type":"gripper","width":0.1}\' WHERE number = 2',
        "UPDATE gesture SET action = 'nonsense' WHERE number = 2",
        "UPDATE gesture SET name = 'other' WHERE number = 2",
        "UPDATE gesture SET active = 0 WHERE number = 2",
        "UPDATE sample SET template = zeroblob(600) WHERE number = 3",
        "UPDATE sample SET template = zeroblob(3) WHERE number = 3",
        "UPDATE gesture SET created_ms = 1e300 WHERE number = 2",
    ],
)
def test_changed_content_is_noticed(tmp_path: Path, change: str) -> None:
    path = tmp_path / "x.db"
    make(path)
    execute(path, change)
    assert "its content has changed on the disk" in broken(path)


def test_another_programs_database_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "x.db"
    execute(path, "CREATE TABLE invoices (id INTEGER)")
    assert "holds other tables (invoices), not gestures; name another file" in broken(path)
    execute(path, "SELECT * FROM invoices")


def test_a_newer_database_is_refused_by_its_version(tmp_path: Path) -> None:
    path = tmp_path / "x.db"
    make(path)
    execute(path, "UPDATE alembic_version SET version_num = '0999'")
    message = broken(path)
    assert "was written by a newer Farhand (its version 0999, this one knows 0005)" in message


def test_tables_that_are_missing_are_noticed(tmp_path: Path) -> None:
    path = tmp_path / "x.db"
    make(path)
    execute(path, "DROP TABLE sample")
    broken(path)


def test_migrations_make_exactly_the_tables_that_the_code_uses(store: GestureStore) -> None:
    from alembic.autogenerate import compare_metadata
    from alembic.runtime.migration import MigrationContext

    from app.gestures.tables import Base

    with store.base.engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []


def test_an_interrupted_first_start_is_made_good(tmp_path: Path) -> None:
    """A database at the state before the first migration: alembic's table, and nothing in it."""
    path = tmp_path / "x.db"
    execute(path, "CREATE TABLE alembic_version (version_num VARCHAR(32) NOT NULL)")
    store = GestureStore(url(path), STARTER)
    assert len(store.list()) == 10
    store.close()


@pytest.mark.parametrize(
    ("place", "message"),
    [
        ("sqlite:///{}/missing/x.db", "does not exist; make it, or choose another"),
        ("sqlite:///{}", "is a folder; name a file"),
        ("sqlite://", "must be a file"),
        ("sqlite:///:memory:", "must be a file"),
        ("nonsense", "the database URL is not one"),
        ("nodatabase://host/x", "the driver for the database URL is missing"),
    ],
)
def test_a_wrong_place_is_one_clear_line(tmp_path: Path, place: str, message: str) -> None:
    with pytest.raises(CannotStart) as caught:
        GestureStore(place.format(tmp_path), None)
    assert message in caught.value.message
    assert "\n" not in caught.value.message


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written_is_one_clear_line(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(CannotStart, match="cannot be written; give this user"):
            GestureStore(url(tmp_path / "x.db"), None)
    finally:
        tmp_path.chmod(0o700)


def test_a_database_that_turns_read_only_is_one_clear_line(store: GestureStore) -> None:
    with store.base.engine.connect() as connection:
        connection.exec_driver_sql("PRAGMA query_only=ON")
    with pytest.raises(CannotStart, match="cannot be written"):
        store.create("a", Home(), [template()])


def test_a_database_that_another_program_holds_is_busy_not_broken(tmp_path: Path) -> None:
    path = tmp_path / "x.db"
    store = GestureStore(url(path), None)
    with store.base.engine.connect() as connection:
        connection.exec_driver_sql("PRAGMA busy_timeout=50")
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    with pytest.raises(FarhandError, match="is busy") as caught:
        store.create("a", Home(), [template()])
    assert (caught.value.code, caught.value.status) == ("database_busy", 503)
    other.execute("ROLLBACK")
    other.close()
    store.create("a", Home(), [template()])
    store.close()


WRITER = """
import sys
from app.gestures import GestureStore
from app.link.actions import Home, JogCartesian, JogJoint, Sequence, Stop
from tests.gestures.conftest import template
store = GestureStore(sys.argv[1], None)
for number in range(100000):
    store.create(str(number), Home(), [template(number + k) for k in range(5)])
    print(number, flush=True)
"""


@pytest.mark.parametrize("acknowledged", [1, 7, 23])
def test_a_kill_loses_nothing_that_was_acknowledged(tmp_path: Path, acknowledged: int) -> None:
    place = url(tmp_path / "x.db")
    root = Path(__file__).parents[2]
    writer = subprocess.Popen(
        [sys.executable, "-c", WRITER, place], cwd=root, stdout=subprocess.PIPE, text=True
    )
    assert writer.stdout is not None
    last = -1
    for line in writer.stdout:
        last = int(line)
        if last == acknowledged:
            writer.send_signal(signal.SIGKILL)
    writer.wait()
    writer.stdout.close()
    store = GestureStore(place, None)
    names = [gesture.name for gesture in store.list()]
    assert names[: last + 1] == [str(number) for number in range(last + 1)]
    assert len(names) <= last + 2  # one more may have been written and not been acknowledged
    for gesture in store.list():
        number = int(gesture.name)
        expected = [template(number + k) for k in range(5)]
        assert [sample.template for sample in gesture.samples] == expected
    store.create("afterwards", Home(), [template()])
    store.close()


@pytest.mark.parametrize("dump", sorted(DATA.glob("v*.sql")), ids=lambda path: path.stem)
def test_databases_of_every_version_so_far_are_brought_up_to_date(
    tmp_path: Path, dump: Path
) -> None:
    path = tmp_path / "x.db"
    connection = sqlite3.connect(path)
    connection.executescript(dump.read_text(encoding="utf-8"))
    connection.close()
    store = GestureStore(url(path), STARTER)
    greeting, wave = store.list()
    assert (greeting.name, wave.name) == ("Grüße", "wave")
    assert greeting.active and wave.active
    assert greeting.action == JogCartesian(linear=(0.1, 0.0, 0.0))
    assert wave.action == Sequence(steps=(JogJoint(joint=1, velocity=0.1, duration=2.0), Stop()))
    assert store.templates() == [
        ("Grüße", template(1)),
        ("Grüße", template(2)),
        ("wave", template(3)),
    ]
    store.create("new", Home(), [template()])
    store.close()


def test_every_version_has_its_dump() -> None:
    from app.gestures.migrations import versions

    assert versions.__file__ is not None
    scripts = Path(versions.__file__).parent.glob("v*.py")
    assert {path.name[:5] for path in scripts} == {path.stem for path in DATA.glob("v*.sql")}
