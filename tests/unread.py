"""Somebody who reads a program's output, and stops reading when told to."""

import os
import pty
import select
import threading
import time
from contextlib import suppress
from typing import Self

CTRL_S, CTRL_Q = b"\x13", b"\x11"


class Reader:
    """Reads what is written to ``handle``, until :meth:`stop` and after :meth:`go_on`."""

    handle: int
    """What to give to a program as its output."""

    def __init__(self, reading: int, handle: int) -> None:
        self.handle = handle
        self._end = reading
        self._read: list[bytes] = []
        self._closing = self._stopped = False
        self._idle = 0
        self._reading = threading.Lock()
        self._thread = threading.Thread(target=self._run, name="reader")
        self._thread.start()

    @property
    def text(self) -> str:
        """What was read."""
        return b"".join(self._read).decode(errors="replace").replace("\r\n", "\n")

    def stop(self) -> None:
        """Let everybody wait who writes from now on."""
        self._stopped = True
        self._stop()

    def go_on(self) -> None:
        """Read on."""
        self._stopped = False
        self._go_on()

    def _stop(self) -> None:
        raise NotImplementedError

    def _go_on(self) -> None:
        raise NotImplementedError

    def finish(self) -> None:
        """Return when all is read that was written."""
        seen = self._idle
        while self._idle < seen + 2:
            time.sleep(0.005)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._closing = True
        if self._stopped:
            self.go_on()
        self._thread.join()
        os.close(self.handle)
        os.close(self._end)

    def _run(self) -> None:
        while not self._closing:
            with self._reading:
                if not select.select([self._end], [], [], 0.02)[0]:
                    self._idle += 1
                    continue
                with suppress(OSError):  # a terminal that nobody has open any more
                    self._read.append(os.read(self._end, 65536))


class PipeReader(Reader):
    """At the other end of a pipe; when it stops, the pipe is full."""

    def __init__(self) -> None:
        super().__init__(*os.pipe())

    def _stop(self) -> None:
        self._reading.acquire()
        # A description of its own: that of the program has to block.
        own = os.open(f"/proc/self/fd/{self.handle}", os.O_WRONLY | os.O_NONBLOCK)
        for size in (4096, 1):
            with suppress(BlockingIOError):
                while True:
                    os.write(own, b"\n" * size)
        os.close(own)

    def _go_on(self) -> None:
        self._reading.release()


class TerminalReader(Reader):
    """At a terminal, with Ctrl-S and Ctrl-Q."""

    def __init__(self) -> None:
        super().__init__(*pty.openpty())

    def _stop(self) -> None:
        os.write(self._end, CTRL_S)

    def _go_on(self) -> None:
        os.write(self._end, CTRL_Q)
