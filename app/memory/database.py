"""The file: opened, brought up to date, and its errors in plain words.

It is a file of its own beside the gesture database, because it may be lost: neither its damage nor
a disk that it fills may touch what decides how a robot moves. So it needs no engine and no
Alembic, either: SQLite alone, and one list of steps (:data:`STEPS`), each made whole or not at all.
"""

import contextlib
import logging
import sqlite3
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from app.errors import MemoryUnavailable, StorageFull

log = logging.getLogger(__name__)

BUSY_S = 2.0
"""How long one writer waits for another before it gives up."""
LOG_BYTES = 1 << 20
"""SQLite's log is cut to this size whenever it has been folded into the file."""
STEPS: tuple[tuple[str, ...], ...] = (
    (
        # bytes before the pictures: what is counted is then read without them.
        """CREATE TABLE events (
            id INTEGER PRIMARY KEY AUTOINCREMENT,
            at_ms INTEGER NOT NULL,
            kind TEXT NOT NULL,
            took_ms INTEGER,
            bytes INTEGER NOT NULL,
            data TEXT NOT NULL,
            template BLOB,
            picture BLOB
        )""",
        "CREATE INDEX events_by_kind ON events (kind, id)",
    ),
    (
        """CREATE TABLE settings (
            gallery TEXT PRIMARY KEY,
            changed_ms INTEGER NOT NULL,
            data TEXT NOT NULL
        ) WITHOUT ROWID""",
    ),
)
"""Statements that lead from each version to the next; ``PRAGMA user_version`` counts them. A step
that was ever released stays as it is."""
DAMAGED = ".damaged"
_FILES = ("", "-wal", "-shm")


class MemoryDamaged(MemoryUnavailable):
    """The file is no database, or not as it was written."""


class Database:
    """Safe to use from any thread: writers wait for one another, readers for nobody.

    Args:
        path: Of the file; made if it is not there.

    Raises:
        MemoryDamaged: it is no database, or is damaged.
        MemoryUnavailable: it is of a newer Farhand or of something else, or cannot be opened.
        StorageFull: no space to make it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._writing = threading.Lock()
        with plain_errors(path):
            self._writer = self._connect()
        try:
            with plain_errors(path):
                self._set_up(self._writer)
        except BaseException:
            self._writer.close()
            raise

    def close(self) -> None:
        """Close it. SQLite then folds its log into the file."""
        with self._writing:
            self._writer.close()

    @contextmanager
    def read(self) -> Iterator[sqlite3.Connection]:
        """A connection that sees the file as of one moment.

        Raises:
            MemoryUnavailable: it cannot be read.
        """
        with plain_errors(self.path), contextlib.closing(self._connect()) as connection:
            connection.execute("BEGIN")
            yield connection

    @contextmanager
    def write(self) -> Iterator[sqlite3.Connection]:
        """A connection whose changes are made when the block ends; none when it raises.

        Raises:
            StorageFull: no space is left; nothing was changed.
            MemoryUnavailable: it cannot be written; nothing was changed.
        """
        with self._writing, plain_errors(self.path), _transaction(self._writer) as connection:
            yield connection

    def _connect(self) -> sqlite3.Connection:
        return sqlite3.connect(
            self.path, timeout=BUSY_S, isolation_level=None, check_same_thread=False
        )

    def _set_up(self, connection: sqlite3.Connection) -> None:
        for pragma in ("journal_mode=WAL", f"journal_size_limit={LOG_BYTES}"):
            connection.execute(f"PRAGMA {pragma}").fetchall()
        # A power cut may take the newest events, and never makes a writer wait for the disk.
        connection.execute("PRAGMA synchronous=NORMAL")
        if connection.execute("PRAGMA quick_check(1)").fetchall() != [("ok",)]:
            raise MemoryDamaged(f"{self.path} is damaged")
        with _transaction(connection):
            version = connection.execute("PRAGMA user_version").fetchone()[0]
            tables = connection.execute("SELECT count(*) FROM sqlite_schema").fetchone()[0]
            if version == 0 and tables:
                raise MemoryUnavailable(f"{self.path} holds something else; move it away")
            if version > len(STEPS):
                raise MemoryUnavailable(
                    f"{self.path} was written by a newer Farhand (its version {version}, this one "
                    f"knows {len(STEPS)}); install the newer Farhand, or move the file away"
                )
            for statement in (each for step in STEPS[version:] for each in step):
                connection.execute(statement)
            connection.execute(f"PRAGMA user_version={len(STEPS)}")


def open_memory(path: Path) -> Database:
    """Open the file; one that is damaged is set aside, and a new one made.

    Raises:
        MemoryUnavailable, StorageFull: as :class:`Database`.
    """
    try:
        return Database(path)
    except MemoryDamaged as error:
        aside = path.with_name(path.name + DAMAGED)
        log.error("%s: it is set aside as %s, and a new one begun", error.message, aside.name)
    try:
        for suffix in _FILES:
            with contextlib.suppress(FileNotFoundError):
                Path(f"{path}{suffix}").replace(f"{aside}{suffix}")
    except OSError as error:
        raise MemoryUnavailable(f"{path} is damaged, and cannot be set aside: {error}") from error
    return Database(path)


@contextmanager
def _transaction(connection: sqlite3.Connection) -> Iterator[sqlite3.Connection]:
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield connection
        connection.execute("COMMIT")
    except BaseException:
        # After some errors, a full disk among them, SQLite has rolled back by itself.
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise


@contextmanager
def plain_errors(path: Path) -> Iterator[None]:
    """Turn the driver's errors into Farhand's, each one line.

    Raises:
        StorageFull: no space left; nothing was changed.
        MemoryDamaged: the file is no database, or is damaged.
        MemoryUnavailable: it cannot be opened, read or written, or another program holds it.
    """
    try:
        yield
    except UnicodeDecodeError as error:
        raise MemoryDamaged(f"{path} is damaged (text that is not UTF-8)") from error
    except sqlite3.Error as error:
        name = str(getattr(error, "sqlite_errorname", ""))
        text = " ".join(str(error).split())[:200]
        if name.startswith("SQLITE_FULL"):
            raise StorageFull(f"the disk that holds {path} is full; nothing was changed") from error
        if name.startswith(("SQLITE_CORRUPT", "SQLITE_NOTADB")):
            raise MemoryDamaged(f"{path} is damaged ({text})") from error
        raise MemoryUnavailable(f"{path} cannot be used: {text}") from error
