"""What happens to a broken database: set aside whole, and remembered until a person decides.

A server that finds its database damaged, empty or gone although there are backups starts with the
starter set. Nobody chose those gestures, so :func:`problem` keeps the robot from being armed until
:func:`restore` or :func:`accept`; a restart does not forget it.
"""

import fcntl
import json
import logging
import os
import secrets
import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from app.errors import (
    CannotStart,
    DatabaseBroken,
    ForeignDatabase,
    NotFound,
    StorageFull,
    WorldError,
)
from app.gestures.backup import Place, copied, files_of, found, newest_good, stamp, sync, verify
from app.gestures.database import GO_ON, is_full
from app.gestures.store import GestureStore

log = logging.getLogger(__name__)

_MAGIC = b"SQLite format 3\0"


class Restored(NamedTuple):
    """What a restore did."""

    backup: Path
    gestures: int
    kept: tuple[Path, ...]
    """Where what was replaced lies now."""


def how(place: Place) -> str:
    """What to do about a lost database, as one sentence without its full stop."""
    restore = f"farhand gestures restore --data-dir {shlex.quote(str(place.backups.parent))}"
    return (
        f"To bring the last good backup back, end the server and run `{restore}`; to keep the "
        f"starter gestures, run `{restore} --accept-new`"
    )


def problem(place: Place) -> str | None:
    """Why the robot must not be armed: the gestures are not those that people taught.

    Returns:
        One or two sentences with how to go on, or None when all is well.
    """
    try:
        what = str(json.loads(place.marker.read_bytes())["what"])
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError):
        what = "The gesture database was lost."  # in doubt the arm stands still
    return f"{what} The starter gestures are in use and the robot cannot be armed. {how(place)}."


class Hold:
    """Says to :func:`restore` that a server has the database open. Ends with the process.

    Raises:
        CannotStart: it is being restored, or the file that says so cannot be written.
        StorageFull: no space for that file.
    """

    def __init__(self, place: Place) -> None:
        self._handle = _open_lock(place)
        if not self._lock(fcntl.LOCK_SH):
            os.close(self._handle)
            raise CannotStart("the gesture database is being restored; start again afterwards")

    @contextmanager
    def alone(self) -> Iterator[bool]:
        """Whether no other server has it open, which stays so meanwhile."""
        alone = self._lock(fcntl.LOCK_EX)
        try:
            yield alone
        finally:
            fcntl.flock(self._handle, fcntl.LOCK_SH)

    def close(self) -> None:
        """Let go."""
        os.close(self._handle)

    def _lock(self, how: int) -> bool:
        try:
            fcntl.flock(self._handle, how | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True


def open_or_set_aside(place: Place, hold: Hold, make: Callable[[], GestureStore]) -> GestureStore:
    """Open the database; one that is broken is set aside, and a new one made.

    Args:
        place: Of the database.
        hold: Of this server.
        make: Opens the database, or makes it; after :func:`check_there`.

    Raises:
        DatabaseBroken: it is broken, and another server has it open.
        ForeignDatabase: it is of a newer Farhand or of something else.
        CannotStart, StorageFull, WorldError: as :class:`GestureStore`.
    """
    with hold.alone() as alone:
        try:
            return make()
        except ForeignDatabase:
            raise
        except DatabaseBroken as error:
            if not alone:
                raise DatabaseBroken(
                    f"{error.message}. Another server has it open: end that one first"
                ) from error
            set_aside(place, error.message)
        return make()


def set_aside(place: Place, why: str) -> tuple[Path, ...]:
    """Move a broken database away and remember that it was.

    Returns:
        Where its files lie now; none when there were none.

    Raises:
        CannotStart, StorageFull: not even a line can be written; nothing was moved.
    """
    name = f"{place.database.name}.broken-{stamp()}Z"
    is_there = place.database.exists()
    what = (
        f"The gesture database was broken and was set aside as {name}."
        if is_there
        else "The gesture database is gone, although there are backups of it."
    )
    # First the note: whatever breaks off after it, the robot is not armed.
    _write(place.marker, json.dumps({"what": what, "why": why}) + "\n")
    moved = _move(place.database, name)
    log.error("%s (%s) The robot cannot be armed. %s.", what, why, how(place))
    return moved


def restore(place: Place, backup: Path | None = None) -> Restored:
    """Put a backup in the place of the database; what it replaces is kept beside it.

    Args:
        place: Of the database.
        backup: The backup's file; None: the newest that is good.

    Raises:
        NotFound: there is no such backup, or no good one.
        DatabaseBroken: the backup named is damaged; nothing was changed.
        CannotStart: a server has the database open.
        StorageFull: no space for a copy of the backup; nothing was changed.
    """
    with _exclusive(place):
        chosen = newest_good(place).path if backup is None else backup
        if not chosen.is_file():
            raise NotFound(f"there is no backup {chosen}; see them with: farhand gestures backups")
        with copied(chosen, place.database.parent) as copy:
            gestures = verify(copy)
            sync(copy)
            kept = _move(place.database, f"{place.database.name}.replaced-{stamp()}Z")
            copy.replace(place.database)
            sync(place.database.parent)
        accept(place)
    return Restored(chosen, gestures, kept)


def accept(place: Place) -> bool:
    """Keep the new database after the old one was set aside; also while a server runs.

    Returns:
        Whether there was anything to accept.
    """
    try:
        place.marker.unlink()
    except FileNotFoundError:
        return False
    sync(place.marker.parent)
    return True


def check_there(place: Place) -> None:
    """Find what SQLite would not call broken: an empty or missing file, a damaged first page.

    Raises:
        DatabaseBroken: the file is no database, or is gone although there are backups.
    """
    try:
        with place.database.open("rb") as file:
            head = file.read(100)
    except FileNotFoundError:
        head = b""
    except OSError:
        return  # opening it says what is wrong
    name = f"the gesture database {place.database}"
    if not head:
        if found(place) and not place.marker.exists():
            raise DatabaseBroken(f"{name} is empty or gone; {GO_ON}")
        return
    # A damaged byte of the format's version would read as "read-only":
    # https://www.sqlite.org/fileformat.html#file_format_version_numbers
    if not head.startswith(_MAGIC) or not {head[18:19], head[19:20]} <= {b"\1", b"\2"}:
        raise DatabaseBroken(f"{name} is damaged (file is not a database); {GO_ON}")


def _move(path: Path, name: str) -> tuple[Path, ...]:
    """Rename a database with its log; the log first, so that none is left for a new database."""
    moved = []
    for part in reversed(files_of(path)):
        if part.exists():
            to = path.with_name(name + part.name.removeprefix(path.name))
            part.replace(to)
            moved.append(to)
    sync(path.parent)
    return tuple(moved)


def _write(path: Path, text: str) -> None:
    part = path.with_name(f"{path.name}.{secrets.token_hex(4)}")
    try:
        handle = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(handle, "w") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
        sync(path.parent)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise _unwritable(path, error) from error


def _open_lock(place: Place) -> int:
    try:
        place.lock.parent.mkdir(parents=True, exist_ok=True)
        return os.open(place.lock, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except OSError as error:
        raise _unwritable(place.lock, error) from error


def _unwritable(path: Path, error: OSError) -> WorldError:
    if is_full(error):
        return StorageFull(f"the disk that holds {path} is full; free some space and try again")
    return CannotStart(
        f"{path} cannot be written ({error.strerror}); give this user write permission, or choose "
        "another folder with --data-dir"
    )


@contextmanager
def _exclusive(place: Place) -> Iterator[None]:
    handle = _open_lock(place)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise CannotStart(
                "a server has the gesture database open; end it first, then restore"
            ) from error
        yield
    finally:
        os.close(handle)
