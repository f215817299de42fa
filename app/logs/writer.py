"""The one thread that writes to a file descriptor, and the bounded queue before it."""

import logging
import os
import queue
import select
import threading
from traceback import TracebackException
from typing import NamedTuple

from app.log_text import indented

WAITING = 1000
"""Pieces that wait to be written, at most; each of a line or a few."""
LONGEST = 4096
"""Bytes of a piece, at most: PIPE_BUF of Linux (pipe(7)). So much is written to a pipe as a whole,
whoever else writes there, and no more than 4 MB are ever kept."""
_log = logging.getLogger(__name__)


class Line(NamedTuple):
    """A log record of which nothing changes any more, still without its form."""

    record: logging.LogRecord
    """Its message is complete; it has neither arguments nor an exception."""
    trace: TracebackException | None = None
    """The source that stands in it is read from disk by whoever formats it."""


class Writer:
    """Writes to ``handle`` from a daemon thread. Everything else here is done at once.

    Args:
        handle: File descriptor; its own from now on.
        name: What it is, for the log.
        formatter: Makes the text of log records; None: gets none, and drops are told in the log.
    """

    def __init__(self, handle: int, name: str, formatter: logging.Formatter | None = None) -> None:
        self.handle = handle
        self._name = name
        self._formatter = formatter
        # Safe in a signal handler, unlike queue.Queue.
        self._queue: queue.SimpleQueue[tuple[int, Line | bytes | threading.Event | None]]
        self._queue = queue.SimpleQueue()
        self._counting = threading.RLock()
        self.dropped = 0
        """Lines that were not written."""
        self._told = 0
        threading.Thread(target=self._run, name=f"{name} writer", daemon=True).start()

    def put(self, piece: Line | bytes) -> None:
        """Write this when its turn comes, or drop and count it."""
        if self._queue.qsize() >= WAITING:
            self._drop(piece)
        else:
            self._queue.put((self.dropped, piece))

    def drained(self, seconds: float) -> bool:
        """Wait until all that was put is written, but no longer than that; whether it was."""
        reached = threading.Event()
        self._queue.put((self.dropped, reached))
        return reached.wait(max(0.0, seconds))

    def close(self) -> None:
        """End the thread, when it has written what waits, and close the descriptor."""
        self._queue.put((self.dropped, None))

    def _drop(self, piece: Line | bytes) -> None:
        lines = 1 if isinstance(piece, Line) else max(1, piece.count(b"\n"))
        with self._counting:
            self.dropped += lines

    def _run(self) -> None:
        while True:
            before, piece = self._queue.get()
            self._tell(before)  # where the gap is
            if piece is None:
                os.close(self.handle)
                return
            if isinstance(piece, threading.Event):
                self._tell(self.dropped)
                piece.set()
            elif not self._write(self._text(piece)):
                self._drop(piece)
            if self._queue.empty():
                self._tell(self.dropped)

    def _tell(self, dropped: int) -> None:
        """Tell of what was dropped since it was told last."""
        count = dropped - self._told
        if count <= 0:
            return
        message = "%d lines for %s were dropped: nobody took them in time"
        if self._formatter is None:
            _log.warning(message, count, self._name)
            self._told = dropped
            return
        text = message % (count, self._name)
        record = logging.LogRecord(__name__, logging.WARNING, __file__, 0, text, None, None)
        if self._write(self._text(Line(record))):
            self._told = dropped

    def _text(self, piece: Line | bytes) -> bytes:
        if isinstance(piece, bytes):
            return piece
        record, trace = piece
        formatter = self._formatter or logging.Formatter()
        try:
            if trace is not None:
                record.exc_text = indented("".join(trace.format()).rstrip("\n"))
            text = formatter.format(record)
        except Exception as error:  # the thread has to go on
            text = f"a line of {record.name} cannot be formatted: {type(error).__name__}"
        return f"{text}\n".encode(errors="backslashreplace")

    def _write(self, data: bytes) -> bool:
        """Wait until all is written; whether it was."""
        rest = memoryview(data)
        while rest:
            try:
                rest = rest[os.write(self.handle, rest) :]
            except BlockingIOError:  # what we were given does not block: wait all the same
                ready = select.poll()
                ready.register(self.handle, select.POLLOUT)
                ready.poll()
            except OSError:
                return False
        return True
