"""One process at a time: a lock on a file that ends with the process, however that ends.

The lock is the kernel's (``flock``), on a file that stays. It holds while its process is stopped,
and is gone when that is killed; no file has to be removed by hand. Children do not have it.
"""

import contextlib
import errno
import fcntl
import json
import os
import socket
import time
import weakref
from datetime import datetime
from pathlib import Path

from app.errors import CannotStart

_CHECK_S = 0.05
_READ_BYTES = 4096


class ProcessLock:
    """Held from making it until :meth:`close`, or until the process is gone.

    Args:
        path: Of the file; made if it is not there, in a folder that is.
        what: What is locked, for the message "WHAT is in use by process 123 since ...; ADVICE".
        advice: What to do when somebody else has it.
        wait_s: s; how long to wait for a holder that is just ending.

    Raises:
        CannotStart: another process has it, the file cannot be written, or the file system has no
            locks.
    """

    def __init__(self, path: Path, what: str, advice: str, wait_s: float = 0.0) -> None:
        self.path = path
        self._handle = _open(path, what)
        try:
            self._lock(what, advice, time.monotonic() + wait_s)
            self._sign()
        except BaseException:
            os.close(self._handle)
            raise
        _held.add(self)

    def close(self) -> None:
        """Let go. Closing twice does no harm."""
        if self._handle >= 0:
            _held.discard(self)
            with contextlib.suppress(OSError):
                os.ftruncate(self._handle, 0)
            os.close(self._handle)
            self._handle = -1

    def _lock(self, what: str, advice: str, until: float) -> None:
        while True:
            try:
                fcntl.flock(self._handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return
            except BlockingIOError as error:
                if time.monotonic() >= until:
                    holder, pid = _holder(self._handle)
                    raise CannotStart(
                        f"{what} is in use by {holder}; {advice}", path=str(self.path), pid=pid
                    ) from error
            except OSError as error:
                raise CannotStart(
                    f"{what} cannot be locked ({error.strerror}), and nothing would keep a second "
                    "process out; put it on a file system that has locks, such as a local disk",
                    path=str(self.path),
                ) from error
            time.sleep(_CHECK_S)

    def _sign(self) -> None:
        """Write down who has it, for whoever comes second. Not having it written is no failure."""
        since = datetime.now().astimezone().isoformat(" ", "seconds")
        text = json.dumps({"pid": os.getpid(), "host": socket.gethostname(), "since": since})
        with contextlib.suppress(OSError):
            os.ftruncate(self._handle, 0)
            os.pwrite(self._handle, text.encode() + b"\n", 0)

    def _forked(self) -> None:
        """A forked child is no holder, and must not keep the lock when its parent is gone."""
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1


_held: "weakref.WeakSet[ProcessLock]" = weakref.WeakSet()


def _let_go_in_child() -> None:
    for lock in list(_held):
        lock._forked()
    _held.clear()


os.register_at_fork(after_in_child=_let_go_in_child)


def _open(path: Path, what: str) -> int:
    flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK
    try:
        return os.open(path, flags, 0o600)
    except OSError as error:
        reason = "it is a link" if error.errno == errno.ELOOP else error.strerror
        raise CannotStart(
            f"{what} cannot be used: its lock {path} cannot be opened ({reason}); give this user "
            "write permission, or choose another place",
            path=str(path),
            errno=error.errno,
        ) from error


def _holder(handle: int) -> tuple[str, int | None]:
    """Who has the lock, in words, and the process id if it is known."""
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        found = json.loads(os.pread(handle, _READ_BYTES, 0))
        pid, host, since = int(found["pid"]), str(found["host"]), str(found["since"])
        there = "" if host == socket.gethostname() else f" on {host}"
        return f"process {pid}{there} since {since}", pid
    return "another process", None
