"""What Farhand keeps is nobody else's to read, from the first start on and in old folders."""

import logging
import os
import shutil
import stat
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.cli_gestures import open_store
from app.config import Settings
from app.errors import CannotStart
from app.gateway.gallery import place_of
from app.gestures import backup
from app.memory.database import open_memory
from app.private import keep_private, private_file, private_folder


@pytest.fixture(autouse=True)
def usual_umask() -> Iterator[None]:
    """That of a usual login, under which files are everybody's to read."""
    before = os.umask(0o022)
    yield
    os.umask(before)


def mode(path: Path) -> int:
    return stat.S_IMODE(path.lstat().st_mode)


def open_to_others(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder.parent)): f"{mode(path):04o}"
        for path in [folder, *folder.rglob("*")]
        if mode(path) & 0o077
    }


def test_everything_is_private_from_the_first_start(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path / "new" / "data")
    store = open_store(settings)
    memory = open_memory(settings.data_dir / "memory.db")
    with memory.write() as connection:
        connection.execute("INSERT INTO settings VALUES ('a', 1, '{}')")
    place = place_of(settings)
    assert place is not None
    backup.make(place, 5)
    names = {path.name for path in settings.data_dir.iterdir()}
    assert names >= {"gestures.db", "gestures.db-wal", "memory.db", "memory.db-wal", "backups"}
    assert open_to_others(settings.data_dir) == {}
    assert mode(tmp_path / "new") == 0o700  # made on the way
    memory.close()
    store.close()


def test_an_old_folder_is_mended_when_it_is_opened(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = tmp_path / "data"
    folder.mkdir()
    names = (
        "gestures.db", "gestures.db-wal", "gestures.db.broken-2026", "gestures.lost.json",
        "memory.db", "memory.db.damaged", "tokens.json", "tokens.lock", "address",
        "stop-puma.latch", "stop-puma.latch.lock", "server.lock", "gestures.lock",
        "backups/gestures-1.db", "tls/authority.pem",
    )  # fmt: skip
    for name in names:
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(name)
        path.chmod(0o664)
    (folder / "backups").chmod(0o775)
    theirs = folder / "notes.txt"
    theirs.write_text("of the user's own")
    theirs.chmod(0o644)
    folder.chmod(0o755)
    caplog.set_level(logging.INFO)
    private_folder(folder)
    assert open_to_others(folder) == {"data/notes.txt": "0644"}
    assert mode(folder) == mode(folder / "backups") == 0o700
    assert {mode(folder / name) for name in names} == {0o600}
    assert "was open to other users of this machine; it is closed now" in caplog.text
    caplog.clear()
    private_folder(folder)
    assert not caplog.records


def test_links_are_not_followed(tmp_path: Path) -> None:
    outside = tmp_path / "outside"
    (outside / "deep").mkdir(parents=True)
    for name in ("file", "deep/file"):
        (outside / name).touch()
    folder = tmp_path / "data"
    folder.mkdir()
    (folder / "gestures.db").symlink_to(outside / "file")
    (folder / "backups").symlink_to(outside / "deep")
    (folder / "memory.db").symlink_to(outside / "nowhere")
    private_folder(folder)
    assert mode(outside / "file") == mode(outside / "deep" / "file") == 0o644
    assert mode(outside / "deep") == 0o755


def test_a_database_elsewhere_is_closed_and_its_folder_left(tmp_path: Path) -> None:
    database = tmp_path / "elsewhere" / "mine.db"
    database.parent.mkdir()
    database.touch()
    Path(f"{database}-wal").touch()
    private_file(database)
    assert mode(database) == mode(Path(f"{database}-wal")) == 0o600
    assert mode(database.parent) == 0o755


def test_a_folder_that_everybody_shares_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "shared"
    folder.mkdir()
    folder.chmod(0o1777)
    with pytest.raises(CannotStart, match=r"all users share \(mode 1777\); choose a folder of"):
        private_folder(folder)
    assert mode(folder) == 0o1777


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder away")
def test_a_folder_or_file_of_another_user_is_not_touched(tmp_path: Path) -> None:
    folder = tmp_path / "theirs"
    folder.mkdir()
    os.chown(folder, 4711, 4711)
    with pytest.raises(CannotStart, match="belongs to user 4711, and this is user 0; run Farhand"):
        private_folder(folder)
    assert mode(folder) == 0o755
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "memory.db").touch()
    os.chown(folder / "memory.db", 4711, 4711)
    private_folder(folder)
    assert mode(folder / "memory.db") == 0o644


READ_ALL = """
import sqlite3, sys
for name in sys.argv[1:]:
    try:
        connection = sqlite3.connect(f"file:{name}?mode=ro", uri=True)
        connection.execute("SELECT count(*) FROM sqlite_schema").fetchall()
    except sqlite3.OperationalError:
        print("kept out")
    else:
        print("read", name)
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can be another user")
def test_another_user_neither_reads_nor_locks_the_databases() -> None:
    with tempfile.TemporaryDirectory(prefix="fh-") as place:
        Path(place).chmod(0o755)
        settings = Settings(data_dir=Path(place) / "data")
        store = open_store(settings)
        names = [settings.data_dir / "gestures.db", settings.data_dir / "memory.db"]
        memory = open_memory(names[1])
        # Even where the folder lets others through.
        settings.data_dir.chmod(0o755)
        command = [shutil.which("python3", path=os.defpath) or sys.executable, "-c", READ_ALL]
        done = subprocess.run(
            [*command, *map(str, names)], user=65534, cwd="/", capture_output=True, text=True
        )
        memory.close()
        store.close()
    assert done.stdout.split("\n") == ["kept out", "kept out", ""], done.stderr


def test_a_folder_that_cannot_be_made_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(CannotStart, match=r"cannot be made \(Not a directory\); choose another"):
        private_folder(tmp_path / "file" / "data")


def test_children_inherit_it(tmp_path: Path) -> None:
    keep_private()
    assert os.umask(0o077) == 0o077
    (tmp_path / "made").touch()
    assert mode(tmp_path / "made") == 0o600
