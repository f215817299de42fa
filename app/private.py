"""Keeps what Farhand writes from the other users of the machine.

Databases, pictures of the timeline, hashes of tokens and latches are their owner's alone: folders
0700, files 0600. What was made with other modes, by an older version, is mended when it is opened.
"""

import logging
import os
import stat
from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path

from app.errors import CannotStart

log = logging.getLogger(__name__)

_OURS = (
    "address",
    "gestures.*",
    "memory.*",
    "server.lock",
    "stop-*",
    "tokens.*",
)
"""Names of files in a data folder that are Farhand's. Others are left alone: somebody may keep more
there."""
_OUR_FOLDERS = ("backups", "tls")
_OTHERS = 0o077


def keep_private() -> None:
    """Whatever this process and its children make from now on is their user's alone."""
    os.umask(_OTHERS)


def private_folder(folder: Path) -> None:
    """Make a data folder, or close one that is there to other users: it and what is ours in it.

    Links are not followed, and files of other users are left as they are.

    Raises:
        CannotStart: it cannot be made, belongs to another user, or is for everybody, as ``/tmp``.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.stat()
    except OSError as error:
        raise CannotStart(
            f"the data folder {folder} cannot be made ({error.strerror}); choose another with "
            "--data-dir",
            path=str(folder),
        ) from error
    if found.st_uid != os.geteuid():
        raise CannotStart(
            f"the data folder {folder} belongs to user {found.st_uid}, and this is user "
            f"{os.geteuid()}; run Farhand as that user, or choose a folder of your own with "
            "--data-dir",
            path=str(folder),
        )
    if found.st_mode & stat.S_ISVTX:
        raise CannotStart(
            f"the data folder {folder} is one that all users share (mode "
            f"{stat.S_IMODE(found.st_mode):04o}); choose a folder of your own with --data-dir",
            path=str(folder),
        )
    # The folder first: after that nobody else can put a link in a file's place.
    mended = _close(folder, found)
    for path in _ours_in(folder):
        mended |= _close(path)
    if mended:
        log.info("%s was open to other users of this machine; it is closed now", folder)


def private_file(path: Path) -> None:
    """Close a file that is there to other users, with what SQLite keeps beside it."""
    for suffix in ("", "-wal", "-shm", "-journal"):
        _close(Path(f"{path}{suffix}"))


def _ours_in(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.iterdir()):
        if path.name in _OUR_FOLDERS:
            yield path
            yield from _entries(path)
        elif any(fnmatchcase(path.name, pattern) for pattern in _OURS):
            yield path


def _entries(folder: Path) -> list[Path]:
    try:
        # Not in a link, nor in a folder whose owner could put one in a file's place.
        if folder.lstat().st_uid != os.geteuid() or folder.is_symlink():
            return []
        return sorted(folder.iterdir())
    except OSError:
        return []


def _close(path: Path, found: os.stat_result | None = None) -> bool:
    """Take the rights of others away; returns whether they had any.

    By name: to open a database's file, and to close it again, would drop SQLite's own locks on it.
    """
    try:
        found = found or path.lstat()
        kind = stat.S_IFMT(found.st_mode)
        if kind not in (stat.S_IFREG, stat.S_IFDIR) or found.st_uid != os.geteuid():
            return False
        mode = stat.S_IMODE(found.st_mode)
        if not mode & _OTHERS:
            return False
        path.chmod(mode & ~_OTHERS & 0o777)
        if path.stat().st_mode & _OTHERS:
            raise PermissionError(None, "the file system keeps no modes")
    except FileNotFoundError:
        return False
    except OSError as error:
        log.warning(
            "%s is open to other users of this machine and cannot be closed to them: %s",
            path,
            error.strerror,
        )
        return False
    return True
