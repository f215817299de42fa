"""Opening the database: engine, SQLite's settings, migrations, and errors in plain words."""

import errno
import importlib.resources
import os
import re
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import alembic.command
import alembic.config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import URL, Connection, Engine, create_engine, event, inspect, make_url
from sqlalchemy.exc import (
    ArgumentError,
    DatabaseError,
    DBAPIError,
    NoSuchModuleError,
    OperationalError,
)

from app.errors import CannotStart, DatabaseBroken, ForeignDatabase, StorageFull, WorldError
from app.gestures.tables import Base

BUSY_S = 10.0
"""How long one writer waits for another before it gives up."""
NO_ROOM_BYTES = 64 * 1024
"""A log's index grows by 32 KiB at a time."""
GO_ON = (
    "bring a backup back with `farhand gestures restore`, or move it away to start again from the "
    "starter set"
)


def open_engine(url: str | URL) -> Engine:
    """An engine for the database at ``url``; nothing of the database is read yet.

    Raises:
        CannotStart: the URL is none, its driver is missing, or the folder is.
    """
    try:
        parsed = make_url(url)
        if parsed.get_backend_name() != "sqlite":
            return create_engine(parsed, pool_pre_ping=True)
        _check_place(parsed)
        engine = create_engine(parsed, connect_args={"timeout": BUSY_S})
    except (NoSuchModuleError, ModuleNotFoundError) as error:
        raise CannotStart(
            f"the driver for the database URL is missing ({_one_line(error)}); "
            "install it, or leave the URL out to use SQLite"
        ) from error
    except ArgumentError as error:
        raise CannotStart(
            f"the database URL is not one ({_one_line(error)}); "
            "it should look like sqlite:///farhand.db or postgresql+psycopg://user@host/name"
        ) from error
    _set_up_sqlite(engine)
    return engine


def describe(engine: Engine) -> str:
    """The database as messages call it: a file's path, or the URL without its password."""
    if engine.dialect.name == "sqlite":
        return f"the gesture database {engine.url.database}"
    return f"the gesture database {engine.url.render_as_string(hide_password=True)}"


def _check_place(url: URL) -> None:
    if not url.database or url.database == ":memory:" or url.database.startswith("file:"):
        raise CannotStart(
            "the gesture database must be a file; give its path, as in sqlite:////data/farhand.db"
        )
    path = Path(url.database)
    if path.is_dir():
        raise CannotStart(f"the gesture database {path} is a folder; name a file", path=str(path))
    if not path.parent.is_dir():
        raise CannotStart(
            f"the folder {path.parent} for the gesture database does not exist; make it, or choose "
            "another with --data-dir",
            path=str(path),
        )
    if not os.access(path.parent, os.W_OK) or (path.exists() and not os.access(path, os.W_OK)):
        raise _not_writable(f"the gesture database {path}")


def _not_writable(what: str) -> CannotStart:
    return CannotStart(
        f"{what} cannot be written; give this user write permission for the file and its folder, "
        "or choose another folder with --data-dir"
    )


def _set_up_sqlite(engine: Engine) -> None:
    """All that is special about SQLite, in one place.

    Write-ahead log with ``synchronous=FULL``: a commit that returned survives a power cut. The
    driver's own way of opening transactions is switched off (``isolation_level=None``): it would
    begin them as readers, and two readers that both want to write fail at once. Writers begin as
    writers instead (``BEGIN IMMEDIATE``) and wait their turn, for :data:`BUSY_S`.

    Foreign keys are off in transactions that may migrate: to change a table is to make it anew, and
    dropping the old one would delete all that refers to it
    (https://www.sqlite.org/lang_altertable.html#otheralter).
    """

    @event.listens_for(engine, "connect")
    def connect(connection: sqlite3.Connection, _record: Any) -> None:
        connection.isolation_level = None
        for pragma in ("journal_mode=WAL", "synchronous=FULL"):
            connection.execute(f"PRAGMA {pragma}").fetchall()

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        options = connection.get_execution_options()
        # Within a transaction it would do nothing.
        keys = "OFF" if options.get("migrate", False) else "ON"
        connection.exec_driver_sql(f"PRAGMA foreign_keys={keys}")
        connection.exec_driver_sql("BEGIN IMMEDIATE" if options.get("write", False) else "BEGIN")

    with plain_errors(engine), engine.connect() as connection:
        rows = connection.exec_driver_sql("PRAGMA quick_check(1)").fetchall()
        if rows != [("ok",)]:
            raise DatabaseBroken(
                f"{describe(engine)} is damaged ({_one_line(rows[0][0])}); {GO_ON}"
            )


def migrate(connection: Connection, name: str) -> bool:
    """Bring the database up to date, inside the transaction that is open on ``connection``.

    Args:
        connection: With a transaction for writing and migrating; the caller commits it.
        name: How messages call the database.

    Returns:
        Whether the database was new: empty until now.

    Raises:
        ForeignDatabase: it belongs to a newer version, or to something else.
        DatabaseBroken: it is damaged.
    """
    config = alembic.config.Config()
    folder = importlib.resources.files("app.gestures") / "migrations"
    config.set_main_option("script_location", str(folder).replace("%", "%%"))
    config.attributes["connection"] = connection
    scripts = ScriptDirectory.from_config(config)
    tables = set(inspect(connection).get_table_names())
    current = MigrationContext.configure(connection).get_current_revision()
    known = {script.revision for script in scripts.walk_revisions()}
    if current is None and len(tables & set(Base.metadata.tables)) > 1:
        raise DatabaseBroken(f"{name} is damaged (it does not say its version); {GO_ON}")
    if current is None and tables - {"alembic_version"}:
        raise ForeignDatabase(
            f"{name} holds other tables ({', '.join(sorted(tables)[:3])}), not gestures; "
            "name another file"
        )
    if current is not None and current not in known:
        if re.fullmatch(r"\d{4}", current) is None:
            raise DatabaseBroken(f"{name} is damaged (its version reads {current[:8]!r}); {GO_ON}")
        raise ForeignDatabase(
            f"{name} was written by a newer Farhand (its version {current}, this one knows "
            f"{scripts.get_current_head()}); install the newer Farhand, or {GO_ON}",
            found=current,
            known=scripts.get_current_head(),
        )
    if current != scripts.get_current_head():
        alembic.command.upgrade(config, "head")
        is_sqlite = connection.dialect.name == "sqlite"
        if is_sqlite and connection.exec_driver_sql("PRAGMA foreign_key_check").first() is not None:
            raise DatabaseBroken(f"{name} is damaged (a part belongs to nothing); {GO_ON}")
    return current is None


@contextmanager
def plain_errors(engine: Engine) -> Iterator[None]:
    """Turn the driver's errors into Farhand's, each one line that says how to go on.

    Raises:
        StorageFull: no space left; nothing was changed.
        DatabaseBroken: the file is no database, or is damaged.
        CannotStart: the file or its folder cannot be opened or written.
        WorldError: busy or out of reach.
    """
    name = describe(engine)
    try:
        yield
    except OSError as error:
        if is_full(error):
            raise _full(name) from error
        raise
    except UnicodeDecodeError as error:
        # The driver passes on what SQLite says, in which a damaged name may stand.
        raise DatabaseBroken(f"{name} is damaged (text that is not UTF-8); {GO_ON}") from error
    except DBAPIError as error:
        text = _one_line(error.orig)
        if "is full" in text or "No space left" in text or no_room(error.orig, _folder(engine)):
            raise _full(name) from error
        if "readonly" in text or "unable to open" in text:
            raise _not_writable(name) from error
        if "is locked" in text:
            raise WorldError(
                f"{name} is busy: another program has been writing for more than {BUSY_S:.0f} s; "
                "try again",
                code="database_busy",
            ) from error
        if isinstance(error, OperationalError) and engine.dialect.name != "sqlite":
            raise CannotStart(f"{name} does not answer: {text}") from error
        if isinstance(error, DatabaseError) and engine.dialect.name == "sqlite":
            raise DatabaseBroken(f"{name} is damaged ({text}); {GO_ON}") from error
        raise


def is_full(error: OSError) -> bool:
    """Whether it says that no space is left, or no more is allowed."""
    return error.errno in (errno.ENOSPC, errno.EDQUOT)


def no_room(error: object, folder: Path) -> bool:
    """Whether an error of SQLite comes from a full disk.

    SQLite says "full" of its files, but "disk I/O error" where the log's index cannot grow, and
    "unable to open" where a file cannot be made.
    """
    name = str(getattr(error, "sqlite_errorname", ""))
    if name.startswith("SQLITE_FULL"):
        return True
    if not name.startswith(("SQLITE_IOERR", "SQLITE_CANTOPEN")):
        return False
    try:
        room = os.statvfs(folder)
    except OSError:
        return False
    return room.f_bavail * room.f_frsize < NO_ROOM_BYTES


def _folder(engine: Engine) -> Path:
    return Path(engine.url.database or ".").parent


def _full(name: str) -> StorageFull:
    return StorageFull(
        f"the disk that holds {name} is full; nothing was changed: free some space and try again"
    )


def _one_line(error: object) -> str:
    return " ".join(str(error).split())[:200]
