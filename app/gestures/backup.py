"""Backups of an SQLite gesture database: whole, checked, and the newest few of them kept.

Copies are made with SQLite's online backup (https://www.sqlite.org/backup.html): of one moment,
while others read and write. A copy that does not pass its check never becomes a backup, so that a
database that breaks unseen cannot push the good ones out.
"""

import contextlib
import logging
import os
import re
import secrets
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from sqlalchemy import URL

from app.errors import DatabaseBroken, FarhandError, NotFound, StorageFull, WorldError
from app.gestures import database
from app.gestures.store import GestureStore

log = logging.getLogger(__name__)

_NAME = re.compile(r"gestures-(\d{8}T\d{6}\.\d{6})Z\.db")
_TIME = "%Y%m%dT%H%M%S.%f"
BUSY_S = 10.0


class Place(NamedTuple):
    """Where a database lies, and what is kept beside it."""

    database: Path
    backups: Path
    """Folder, owner's alone."""

    @property
    def marker(self) -> Path:
        """Exists while a database that was set aside has been neither restored nor given up."""
        return self.backups.parent / "gestures.lost.json"

    @property
    def lock(self) -> Path:
        """Held, shared, by every server that has the database open."""
        return self.backups.parent / "gestures.lock"


class Backup(NamedTuple):
    """One backup."""

    path: Path
    made: datetime
    """UTC."""
    bytes: int


class Fingerprint(NamedTuple):
    """Differs between two states of a database, also after an older one was brought back."""

    version: int
    gestures: int
    updated_ms: int


def stamp() -> str:
    """The time in UTC as names of files carry it."""
    return datetime.now(UTC).strftime(_TIME)


def found(place: Place) -> list[Backup]:
    """The backups that are there, newest first; not opened."""
    backups = []
    with contextlib.suppress(FileNotFoundError):
        for entry in os.scandir(place.backups):
            match = _NAME.fullmatch(entry.name)
            if match is not None and entry.is_file():
                made = datetime.strptime(match[1], _TIME).replace(tzinfo=UTC)
                backups.append(Backup(Path(entry.path), made, entry.stat().st_size))
    return sorted(backups, key=lambda backup: backup.made, reverse=True)


def fingerprint(path: Path) -> Fingerprint | None:
    """What state the database at ``path`` is in; None when it cannot be read."""
    try:
        with contextlib.closing(_open_file(path)) as connection:
            row = connection.execute(
                "SELECT (SELECT version FROM gallery), count(*), coalesce(max(updated_ms), 0)"
                " FROM gesture"
            ).fetchone()
        return Fingerprint(*row)
    except (sqlite3.Error, UnicodeDecodeError):
        return None


def verify(path: Path) -> int:
    """Check a copy: pages, checksums of galleries, gestures, samples and versions of actions.

    Brings a copy by an older Farhand up to date. Not for a database that is in use.

    Returns:
        How many gestures it holds, in all galleries.

    Raises:
        DatabaseBroken: with what is wrong.
    """
    store = GestureStore(url_of(path), None)
    try:
        gestures = store.check()
        for gesture in gestures:
            store.versions(gesture.id)
    except (ValueError, TypeError) as error:
        raise DatabaseBroken(f"{path} is damaged ({type(error).__name__})") from error
    finally:
        store.close()
    return len(gestures)


def url_of(path: Path) -> URL:
    """The SQLAlchemy URL of a file, whatever signs its name has."""
    return URL.create("sqlite", database=str(path))


def make(place: Place, keep: int) -> Path | None:
    """Back the database up, unless the newest backup holds the same; then drop the oldest.

    Takes as long as reading the database twice; not for the event loop.

    Args:
        place: Of the database.
        keep: How many backups stay; 0 makes none.

    Returns:
        The new backup, if one was needed.

    Raises:
        DatabaseBroken: the copy did not pass its check; no backup was made or dropped.
        StorageFull: no space; no backup was made or dropped.
        OSError: the folder cannot be written.
    """
    if keep == 0:
        return None
    backups = found(place)
    now = fingerprint(place.database)
    if backups and now is not None and fingerprint(backups[0].path) == now:
        return None
    place.backups.mkdir(mode=0o700, parents=True, exist_ok=True)
    place.backups.chmod(0o700)
    name = stamp()
    if backups and name <= backups[0].made.strftime(_TIME):
        # The clock was set back; the newest must stay the newest.
        later = backups[0].made.timestamp() + 1
        name = datetime.fromtimestamp(later, UTC).strftime(_TIME)
    path = place.backups / f"gestures-{name}Z.db"
    with copied(place.database, place.backups) as copy:
        verify(copy)
        with contextlib.closing(_open_file(copy)) as connection:
            # One file that is whole by itself: a database with a log leaves files beside it.
            connection.execute("PRAGMA journal_mode=DELETE").fetchall()
        sync(copy)
        copy.replace(path)
        sync(place.backups)
    for backup in [each for each in found(place) if each.path != path][keep - 1 :]:
        backup.path.unlink(missing_ok=True)
    return path


@contextmanager
def copied(source: Path, folder: Path) -> Iterator[Path]:
    """A copy of the database ``source`` in ``folder``, gone afterwards unless it was renamed.

    Raises:
        DatabaseBroken: ``source`` cannot be read.
        StorageFull: no space in ``folder``.
        WorldError: somebody writes to ``source`` all the time.
    """
    for old in folder.glob(".copy-*"):
        # Left by a crash; a copy that is being made now is younger than its process's start.
        if old.stat().st_mtime < datetime.now().timestamp() - 3600:
            old.unlink(missing_ok=True)
    copy = folder / f".copy-{secrets.token_hex(4)}"
    try:
        if source.stat().st_size == 0:
            # SQLite would take it for a new database.
            raise DatabaseBroken(f"{source} is empty")
        os.close(os.open(copy, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
        with (
            contextlib.closing(_open_file(source)) as old_end,
            contextlib.closing(sqlite3.connect(copy)) as new_end,
        ):
            old_end.backup(new_end)
        yield copy
    except DatabaseBroken as error:
        # What is wrong with the copy is wrong with what was copied, and that has a name.
        error.message = error.message.replace(str(copy), str(source))
        raise
    except sqlite3.Error as error:
        if database.no_room(error, folder):
            raise StorageFull(f"no space for a copy of {source}; free some") from error
        if getattr(error, "sqlite_errorname", "").startswith("SQLITE_BUSY"):
            raise WorldError(f"{source} is busy; try again", code="database_busy") from error
        raise DatabaseBroken(f"{source} is damaged ({error})") from error
    except UnicodeDecodeError as error:
        raise DatabaseBroken(f"{source} is damaged (text that is not UTF-8)") from error
    except OSError as error:
        if database.is_full(error):
            raise StorageFull(f"no space for a copy of {source}; free some") from error
        raise
    finally:
        for part in files_of(copy):
            part.unlink(missing_ok=True)


def newest_good(place: Place) -> Backup:
    """The newest backup that passes its check.

    Raises:
        NotFound: there is none.
    """
    for backup in found(place):
        try:
            check(backup.path)
        except FarhandError as error:
            log.warning("%s is passed over: %s", backup.path.name, error.message)
        else:
            return backup
    raise NotFound(f"there is no good backup in {place.backups}")


def check(path: Path) -> int:
    """:func:`verify` a copy of ``path``, so that nothing is written beside it.

    Returns:
        How many gestures it holds.

    Raises:
        DatabaseBroken: with what is wrong.
    """
    with copied(path, path.parent) as copy:
        return verify(copy)


def files_of(path: Path) -> tuple[Path, ...]:
    """A database's file, its write-ahead log and the log's index."""
    return (path, *(path.with_name(path.name + end) for end in ("-wal", "-shm", "-journal")))


def sync(path: Path) -> None:
    """Wait until a file, or what a folder lists, is on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _open_file(path: Path) -> sqlite3.Connection:
    uri = path.absolute().as_uri()
    return sqlite3.connect(f"{uri}?mode=rw", uri=True, timeout=BUSY_S)
