"""Temporary folders that do not stay behind when their process is killed.

The owner holds a lock on a file in the folder for as long as it lives; the kernel lets go of it
whatever the process died of. Who starts next removes the folders of this kind and of this user
whose lock is free. Nothing else is touched: not what has no such file, not what another user owns.
"""

import contextlib
import fcntl
import logging
import os
import shutil
import stat
import tempfile
from pathlib import Path

log = logging.getLogger(__name__)

PREFIX = "farhand-"
OWNER = ".owner"


class ScratchFolder:
    """A folder of mode 0700 in the system's folder for temporary files, until it is closed.

    Raises:
        OSError: it cannot be made.
    """

    def __init__(self) -> None:
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX))
        # Locked before it has its name, so that no other process finds it free.
        draft = self.path / f"{OWNER}.new"
        self._lock = os.open(draft, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        draft.rename(self.path / OWNER)

    def close(self) -> None:
        """Remove it."""
        if self._lock >= 0:
            shutil.rmtree(self.path, ignore_errors=True)
            os.close(self._lock)
            self._lock = -1


def remove_left_behind(parent: Path | None = None) -> int:
    """Remove the folders of owners that are gone; says how many. Never raises.

    Args:
        parent: Where to look; the system's folder for temporary files unless given.
    """
    removed = 0
    with contextlib.suppress(OSError):
        for path in (parent or Path(tempfile.gettempdir())).glob(f"{PREFIX}*"):
            with contextlib.suppress(OSError):
                removed += _remove_if_left(path)
    if removed:
        log.info("removed %d temporary folders that an earlier run left behind", removed)
    return removed


def _remove_if_left(path: Path) -> bool:
    found = path.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid():
        return False
    # No link is followed, and a named pipe in its place does not hold us up.
    flags = os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK
    lock = os.open(path / OWNER, flags)
    try:
        if not stat.S_ISREG(os.fstat(lock).st_mode):
            return False
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(path)
        return True
    finally:
        os.close(lock)
