"""Log lines and whatever else a process writes on its standard streams, without waiting for it.

Whoever reads a log may stop reading: Ctrl-S in the terminal, a pipe whose reader hangs, a full
disk. A thread that writes there then waits, with the locks it holds, and a control loop or an event
loop must never wait. So inside :func:`written_apart` nothing but two daemon threads ever writes to
what the process was given as standard output and standard error. Everybody else puts lines into a
bounded queue (:mod:`app.logs.writer`); what does not fit is dropped and counted.

A process has four ways to its standard streams, and each of them is led there:

- log records of every library, by the root logger's one handler (:mod:`app.logs.records`);
- ``warnings``, which become log records;
- ``print``, tracebacks of threads and all that uses ``sys.stdout`` and ``sys.stderr``, which are
  replaced (:mod:`app.logs.streams`);
- what C and Rust libraries write to file descriptors 1 and 2. These become a pipe that a further
  thread empties, and that drops rather than blocks when it is full.
"""

import contextlib
import faulthandler
import fcntl
import logging
import os
import sys
import time
import warnings
from collections.abc import Iterator
from typing import TextIO

from app.log_text import LineFormatter
from app.logs.records import QueueHandler
from app.logs.streams import LineStream, Pipe
from app.logs.writer import Writer

LINE = "%(asctime)s %(levelname)s %(message)s"
"""How a line of the gateway looks."""
FLUSH_S = 0.5
"""So long the end of a process waits for its last lines to be written."""
_EOF_S = 0.1
_log = logging.getLogger(__name__)


class _Apart:
    """What :func:`written_apart` has replaced, and how to give it back."""

    def __init__(self, pattern: str) -> None:
        # Private copies: the numbers 1 and 2 are about to mean something else.
        error, out = _copy(2), _copy(1)
        self.error = Writer(error, "standard error", LineFormatter(pattern))
        together = os.path.sameopenfile(error, out)  # then their lines keep their order
        self.out = self.error if together else Writer(out, "standard output")
        self._streams = sys.stdout, sys.stderr
        self._handlers, self._level = logging.root.handlers[:], logging.root.level
        self._last_resort = logging.lastResort
        self._warn = warnings.showwarning
        if faulthandler.is_enabled():  # its text comes when no thread can empty a pipe any more
            faulthandler.enable(self.error.handle)
        self._pipe = Pipe(self.error, (1, 2))
        sys.stdout = LineStream(self.out, 1, self._streams[0])
        sys.stderr = LineStream(self.error, 2, self._streams[1])
        handler = QueueHandler(self.error)
        logging.root.handlers[:] = [handler]
        logging.root.setLevel(logging.INFO)
        logging.lastResort = handler  # of loggers that do not propagate
        warnings.showwarning = _warn

    def close(self) -> None:
        """Give everything back once it is written.

        While nobody reads, it stays as it is after :data:`FLUSH_S`: the process can end without
        its last lines, but not if one more thread waits.
        """
        deadline = time.monotonic() + FLUSH_S
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, LineStream):
                stream.flush()
        self._pipe.close(_EOF_S)
        writers = {self.error, self.out}
        if not all(each.drained(deadline - time.monotonic()) for each in writers):
            return
        os.dup2(self.out.handle, 1)
        os.dup2(self.error.handle, 2)
        sys.stdout, sys.stderr = self._streams
        logging.root.handlers[:] = self._handlers
        logging.root.setLevel(self._level)
        logging.lastResort = self._last_resort
        warnings.showwarning = self._warn
        if faulthandler.is_enabled():
            faulthandler.enable(2)
        for each in writers:
            each.close()


_apart: _Apart | None = None


@contextlib.contextmanager
def written_apart(pattern: str = LINE) -> Iterator[None]:
    """Let two daemon threads do all writing to standard output and standard error.

    For the main thread of a process, from its beginning to its end. Leaving takes at most
    :data:`FLUSH_S`.

    Args:
        pattern: How a line of the log looks, as of :class:`logging.Formatter`.
    """
    global _apart
    before, _apart = _apart, _Apart(pattern)
    try:
        yield
    finally:
        _apart.close()
        _apart = before


def standard_error() -> int:
    """The file descriptor of the standard error that this process was started with.

    For the standard streams of processes that it starts: they guard themselves, and what they say
    must not be lost when this process is.
    """
    return 2 if _apart is None else _apart.error.handle


def dropped() -> int:
    """Lines that were not written because nobody read them in time, since the start."""
    if _apart is None:
        return 0
    return sum(writer.dropped for writer in {_apart.error, _apart.out})


def _copy(number: int) -> int:
    """Another descriptor of the same file; of nothing, where the process was started without."""
    try:
        return fcntl.fcntl(number, fcntl.F_DUPFD_CLOEXEC, 3)
    except OSError:
        nothing = os.open(os.devnull, os.O_RDWR)
        os.dup2(nothing, number)
        os.close(nothing)
        return fcntl.fcntl(number, fcntl.F_DUPFD_CLOEXEC, 3)


def _warn(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Take the place of :func:`warnings.showwarning`, which would read the source from disk."""
    _log.warning("%s:%s: %s: %s", filename, lineno, category.__name__, message)
