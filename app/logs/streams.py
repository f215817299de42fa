"""What takes the place of standard output and standard error, for Python and for C."""

import contextlib
import io
import os
import threading
from collections.abc import Sequence
from typing import TextIO

from app.logs.writer import LONGEST, Writer


class LineStream(io.TextIOBase):
    """Text that goes into a writer's queue line by line; never waits.

    What a thread writes is put together to lines of its own, so that those of several threads do
    not mix.

    Args:
        writer: Where lines go.
        number: File descriptor whose place it takes.
        like: The stream whose place it takes.
    """

    def __init__(self, writer: Writer, number: int, like: TextIO | None) -> None:
        super().__init__()
        self._writer = writer
        self._number = number
        self._terminal = os.isatty(writer.handle)
        self._encoding = getattr(like, "encoding", None) or "utf-8"
        self._begun = threading.local()

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """That of the stream whose place it takes."""
        return self._encoding

    @property
    def errors(self) -> str:  # type: ignore[override]
        """What is printed must not fail for a letter."""
        return "backslashreplace"

    def writable(self) -> bool:
        """Yes."""
        return True

    def isatty(self) -> bool:
        """Whether a person reads at a terminal what is written."""
        return self._terminal

    def fileno(self) -> int:
        """The descriptor whose place it takes, which does not block either."""
        return self._number

    def write(self, text: str) -> int:
        """Put the lines that are complete into the queue; keep the rest until it is."""
        lines, newline, rest = (getattr(self._begun, "text", "") + text).rpartition("\n")
        if len(rest) > LONGEST:
            lines, newline, rest = lines + newline + rest, "", ""
        self._begun.text = rest
        self._put(lines + newline)
        return len(text)

    def flush(self) -> None:
        """Put into the queue what this thread has begun to write."""
        rest, self._begun.text = getattr(self._begun, "text", ""), ""
        self._put(rest)

    def _put(self, text: str) -> None:
        data = text.encode(self._encoding, self.errors)
        for start in range(0, len(data), LONGEST):
            self._writer.put(data[start : start + LONGEST])


class Pipe:
    """A pipe in the place of some file descriptors, for what is not written by Python.

    Its end for writing drops what does not fit (``O_NONBLOCK``), so that not even a thread that
    holds the interpreter's lock while it writes can wait for the one that reads.

    Args:
        writer: Where the lines go.
        numbers: File descriptors whose place it takes.
    """

    def __init__(self, writer: Writer, numbers: Sequence[int]) -> None:
        self._writer = writer
        self._numbers = numbers
        self._from, to = os.pipe()
        os.set_blocking(to, False)
        self._replace(to)
        self._thread = threading.Thread(target=self._run, name="descriptor reader", daemon=True)
        self._thread.start()

    def close(self, seconds: float) -> None:
        """Let the descriptors write nowhere, and wait shortly for what was written before."""
        self._replace(os.open(os.devnull, os.O_WRONLY))
        self._thread.join(seconds)

    def _replace(self, by: int) -> None:
        for number in self._numbers:
            os.dup2(by, number)
        os.close(by)

    def _run(self) -> None:
        rest = b""
        with contextlib.closing(os.fdopen(self._from, "rb", buffering=0)) as end:
            while data := end.read(LONGEST):
                lines, newline, rest = (rest + data).rpartition(b"\n")
                if len(lines) >= LONGEST:
                    self._put(lines[:LONGEST])
                    lines = lines[LONGEST:]
                self._put(lines + newline)
                if len(rest) >= LONGEST:
                    self._put(rest)
                    rest = b""
        self._put(rest)

    def _put(self, data: bytes) -> None:
        if data:
            self._writer.put(data)
