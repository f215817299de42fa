"""Keeps a latched stop over a restart of the node."""

import contextlib
import logging
import os
import threading
from pathlib import Path

from pydantic import ValidationError

from app.errors import CannotStart
from app.link.messages import StopRequest

log = logging.getLogger(__name__)


class StopLatch:
    """A small file that exists while a stop is latched.

    Written and removed at once, so that it outlives a crash of the process; flushed to the disk by
    a thread, because the control loop must not wait for a disk.

    Args:
        path: The file, or None to keep nothing.

    Raises:
        CannotStart: the file cannot be written where it should be.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        if path is None:
            return
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            writable = os.access(path.parent, os.W_OK)
        except OSError:
            writable = False
        if not writable:
            raise CannotStart(
                f"the stop latch {path} cannot be written; name a file in a folder of yours",
                path=str(path),
            )

    def load(self) -> StopRequest | None:
        """The stop that is latched, if any. A file that cannot be read counts as one."""
        if self._path is None or not self._path.exists():
            return None
        try:
            return StopRequest.model_validate_json(self._path.read_bytes())
        except (OSError, ValidationError, ValueError):
            log.exception("the stop latch %s cannot be read; it counts as set", self._path)
            return StopRequest(source="latch", reason="the file of the latched stop is unreadable")

    def set(self, stop: StopRequest) -> None:
        """Keep ``stop``."""
        if self._path is None:
            return
        part = self._path.with_name(self._path.name + ".part")
        try:
            part.write_bytes(stop.encode())
            part.replace(self._path)
        except OSError:
            log.exception("the stop latch %s cannot be written", self._path)
            return
        threading.Thread(target=_flush, args=(self._path,), daemon=True).start()

    def clear(self) -> None:
        """Forget the stop."""
        if self._path is not None:
            try:
                self._path.unlink(missing_ok=True)
            except OSError:
                log.exception("the stop latch %s cannot be removed", self._path)


def _flush(path: Path) -> None:
    for each in (path, path.parent):
        with contextlib.suppress(OSError):
            handle = os.open(each, os.O_RDONLY)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)
