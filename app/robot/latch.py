"""Keeps a latched stop over a restart of the node, without ever making the control loop wait."""

import logging
import threading
import time
from pathlib import Path

from pydantic import ValidationError

from app.errors import CannotStart
from app.link.messages import LatchState, StopRequest
from app.robot.latch_file import LatchFile, Unreadable

log = logging.getLogger(__name__)

START_S = 2.0
"""So long the start waits for the disk; a latch that has not been read by then counts as set."""
RETRY_S = 1.0
"""Between two attempts after one that failed."""
CHECK_S = 5.0
"""How often the file is looked at although nothing has changed: somebody may have removed it."""
END_S = 1.0
UNREADABLE = "the file of the latched stop is unreadable"
STOP_WAITS = "the stop is not on the disk yet"
RESET_WAITS = "the reset is not on the disk yet"
LATCH_WAITS = "the stop latch is not on the disk yet"

_NONE = LatchState(status="none")
_KEPT = LatchState(status="kept")


class StopLatch:
    """A small file that says whether a stop is latched.

    :meth:`set` and :meth:`clear` only say what should be in the file; a thread puts it there,
    flushes it to the disk and reads it back. What comes later replaces what has not been written
    yet, so that the file always ends with the newest. :attr:`state` tells how far that has come.

    Args:
        path: The file, or None to keep nothing.

    Raises:
        CannotStart: the file's folder cannot be made.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._changed = threading.Condition()
        self._loaded: StopRequest | None = None
        self._wanted: StopRequest | None = None
        self._asked = 1
        """Number of the newest that is wanted in the file; the first is what is there already."""
        self._kept = 0
        """Number of the newest that is there."""
        self._since = time.monotonic()
        """When they began to differ."""
        self._trouble: str | None = None
        self._no_folder = False
        self._is_read = path is None
        self._ending = False
        if path is None:
            return
        self._file = LatchFile(path)
        self._thread = threading.Thread(target=self._run, name="stop-latch", daemon=True)
        self._thread.start()
        with self._changed:
            self._changed.wait_for(self._is_up, START_S)
            if self._no_folder:
                raise CannotStart(
                    f"the stop latch {path} cannot be written; name a file in a folder of yours",
                    path=str(path),
                )
            if not self._is_read:
                # Whatever is found later: nobody knew it in time.
                self._is_read = True
                self._want_unreadable()

    def load(self) -> StopRequest | None:
        """The stop that was latched when this began, if any; one that cannot be read counts."""
        return self._loaded

    def set(self, stop: StopRequest) -> None:
        """Keep ``stop``. Never waits."""
        self._want(stop)

    def clear(self) -> None:
        """Forget the stop. Never waits."""
        self._want(None)

    @property
    def state(self) -> LatchState:
        """What the disk knows of what is in force."""
        with self._changed:
            if self._path is None:
                return _NONE
            if self._kept == self._asked and self._trouble is None:
                return _NONE if self._wanted is None else _KEPT
            waits = RESET_WAITS if self._wanted is None else STOP_WAITS
            if self._asked == 1:
                waits = LATCH_WAITS
            return LatchState(
                status="pending" if self._trouble is None else "failed",
                reason=self._trouble or waits,
                waiting_ms=round((time.monotonic() - self._since) * 1000),
            )

    def wait(self, timeout_s: float) -> bool:
        """Wait until the disk knows what is in force. Not for the control loop."""
        with self._changed:
            return self._path is None or self._changed.wait_for(
                lambda: self._kept == self._asked and self._trouble is None, timeout_s
            )

    def close(self) -> None:
        """Wait a moment for the disk, then let go of the file."""
        with self._changed:
            if self._path is not None:
                self._changed.wait_for(
                    lambda: self._kept == self._asked or self._trouble is not None, END_S
                )
            self._ending = True
            self._changed.notify_all()

    def _is_up(self) -> bool:
        tried = self._kept == self._asked or self._trouble is not None
        return self._no_folder or (self._is_read and tried)

    def _want(self, stop: StopRequest | None) -> None:
        with self._changed:
            if self._kept == self._asked and self._trouble is None:
                self._since = time.monotonic()
            self._wanted = stop
            self._asked += 1
            self._changed.notify_all()

    def _want_unreadable(self) -> None:
        self._loaded = StopRequest(source="latch", reason=UNREADABLE)
        self._want(self._loaded)

    # On the thread

    def _run(self) -> None:
        if not self._begin():
            return
        while not self._ending:
            with self._changed:
                wanted, number = self._wanted, self._asked
            trouble = self._write(wanted)
            with self._changed:
                if trouble is None:
                    self._kept = number
                    self._trouble = None
                else:
                    if self._trouble is None and self._kept == self._asked:
                        self._since = time.monotonic()
                    self._trouble = trouble
                self._changed.notify_all()
                if self._asked == number and not self._ending:
                    self._changed.wait(CHECK_S if trouble is None else RETRY_S)

    def _begin(self) -> bool:
        """Make the folder and read what was kept before; False when there is no folder."""
        assert self._path is not None
        found, unreadable = None, False
        try:
            if not self._path.parent.is_dir():
                self._path.parent.mkdir(parents=True, exist_ok=True)
        except OSError:
            with self._changed:
                self._no_folder = True
                self._changed.notify_all()
            return False
        try:
            kept = self._file.load()
            if kept:
                found = StopRequest.model_validate_json(kept)
        except (OSError, ValidationError, ValueError, Unreadable) as error:
            log.error("the stop latch %s cannot be read, it counts as set: %s", self._path, error)
            unreadable = True
        with self._changed:
            if not self._is_read:
                self._is_read = True
                self._loaded = self._wanted = found
                if unreadable:
                    self._want_unreadable()
        return True

    def _write(self, wanted: StopRequest | None) -> str | None:
        """Have the file say ``wanted``; why it does not, in plain words, if so."""
        what = b"" if wanted is None else wanted.encode()
        try:
            if not self._is_there(what):
                self._file.keep(what)
        except Exception as error:
            why = (error.strerror if isinstance(error, OSError) else None) or str(error)
            trouble = f"the stop latch cannot be written: {why}"[:300]
            if trouble != self._trouble:
                log.error("%s (%s)", trouble, self._path)
            return trouble
        return None

    def _is_there(self, what: bytes) -> bool:
        """Whether the file says so already, and has room for what may come."""
        return self._kept == self._asked and self._file.holds(what)
