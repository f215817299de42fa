"""Log records on their way into the queue."""

import copy
import logging
from traceback import TracebackException

from app.logs.writer import LONGEST, Line, Writer

FRAMES = 30
"""Innermost calls of a traceback that are kept: a recursion without end has a thousand."""


class QueueHandler(logging.Handler):
    """Puts records into a writer's queue; never waits, has no lock, raises nothing.

    The message is completed and the exception taken down here, because what they speak of may have
    changed or be gone by the time the line is written. Dates and form are given to it there.
    """

    def __init__(self, writer: Writer) -> None:
        super().__init__()
        self._writer = writer

    def createLock(self) -> None:
        """Have none: a thread that is interrupted here would hold up all others."""
        self.lock = None

    def emit(self, record: logging.LogRecord) -> None:
        """Put a record into the queue."""
        try:
            text = record.getMessage()
        except Exception as error:
            text = f"a line of {record.name} cannot be put together: {type(error).__name__}"
        if len(text) > LONGEST:
            text = f"{text[:LONGEST]} … ({len(text) - LONGEST} more characters)"
        settled = copy.copy(record)
        settled.msg, settled.args = text, None
        settled.exc_info, settled.exc_text, settled.stack_info = None, None, record.stack_info
        self._writer.put(Line(settled, _trace(record)))

    def handleError(self, record: logging.LogRecord) -> None:
        """Not even an error in here may be written at once."""


def _trace(record: logging.LogRecord) -> TracebackException | None:
    if not record.exc_info or record.exc_info[0] is None:
        return None
    try:
        return TracebackException(*record.exc_info, limit=-FRAMES, lookup_lines=False, compact=True)
    except Exception:  # of an exception whose own text fails
        return None
