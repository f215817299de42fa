"""Heavy work in processes of its own: bounded, behind everything else, and it can be ended.

What computes for long holds Python's interpreter lock, and with it every frame and every stop that
this process is to pass on. So pictures that were uploaded, files that are imported, galleries that
are learned and tried are worked on elsewhere: in at most so many processes, each with a thread here
that hands it one piece after another and kills it when the piece takes too long, or when nobody
waits for it any more.
"""

import contextlib
import logging
import signal
import socket
import subprocess
import sys
import threading
import time
from asyncio import CancelledError, wrap_future
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from app.errors import RequestError
from app.gateway.busy import Busy
from app.gateway.node_process import node_environment
from app.gateway.work_messages import Piece, Told

log = logging.getLogger(__name__)

T = TypeVar("T")
Progress = Callable[[int, int], None]

CPU_S = 30.0
"""Processor time of an ordinary piece, s: a picture, or reading a file."""
LONG_CPU_S = 600.0
"""The same of learning or trying a whole gallery."""
PATIENCE = 20.0
"""Times its processor time that a piece may take by the clock: everything else goes first."""
CHECK_S = 0.02
"""How soon it is noticed that nobody waits any more."""
GRACE_S = 2.0
"""A picture that nobody waits for any more may still be finished for so long: a new process takes
as long to start."""
IDLE_S = 60.0
"""A process without work for so long gives its memory back."""


class TooMuchWork(RequestError):
    """What was sent takes more time or memory to work on than it may; nothing was changed."""

    default_code = "too_much_work"
    status = 422


class Task:
    """A piece of work that was handed in. ``cancel`` may be called from any thread."""

    def __init__(self, piece: Piece, progress: Progress | None) -> None:
        self.piece = piece
        self.progress = progress
        self.future: Future[Any] = Future()
        self.over_at: float | None = None
        """When to end it although it is not done (s, monotonic)."""

    def cancel(self, grace_s: float = 0.0) -> None:
        """End it: now, or when it is not done in so many seconds."""
        if not self.future.cancel():
            self.over_at = time.monotonic() + grace_s


class WorkPool:
    """The processes for heavy work. Safe to use from any thread.

    Args:
        processes: At most so many at once; started when there is work for them.
        waiting: Pieces that may wait; one more is refused.
        memory: Bytes that a piece may take.
        niceness: Of the processes, 0 to 19.
    """

    def __init__(self, processes: int, waiting: int, memory: int, niceness: int) -> None:
        self._most = processes
        self._waiting = waiting
        self._memory = memory
        self._niceness = niceness
        self._changed = threading.Condition()
        self._queue: deque[Task] = deque()
        self._threads: set[threading.Thread] = set()
        self._idle = 0
        self._closing = False

    def submit(
        self,
        function: Callable[..., Any],
        *arguments: Any,
        progress: Progress | None = None,
        cpu_s: float = CPU_S,
        memory: int | None = None,
    ) -> Task:
        """Hand in ``function(*arguments)``; with ``progress``, it is called with that as well.

        Args:
            function: Of a module, by its name: it is called in another process.
            arguments: What can be pickled.
            progress: Told, on a thread, what the function tells; what it raises ends the work.
            cpu_s: Processor time that it may take.
            memory: Bytes that it may take; None: what the pool allows.

        Raises:
            Busy: too much waits already.
        """
        most = memory or self._memory
        piece = Piece(function, arguments, progress is not None, most, cpu_s)
        task = Task(piece, progress)
        with self._changed:
            if self._closing:
                raise Busy("the server is ending")
            if len(self._queue) >= self._waiting:
                self._queue = deque(task for task in self._queue if not task.future.cancelled())
            if len(self._queue) >= self._waiting:
                raise Busy("too much waits to be worked on; try again in a moment")
            self._queue.append(task)
            if self._idle < len(self._queue) and len(self._threads) < self._most:
                thread = threading.Thread(target=self._serve, name="work", daemon=True)
                self._threads.add(thread)
                thread.start()
            self._changed.notify()
        return task

    async def run(
        self,
        function: Callable[..., T],
        *arguments: Any,
        grace_s: float = GRACE_S,
        cpu_s: float = CPU_S,
    ) -> T:
        """Have ``function(*arguments)`` done, and await it; cancelling this cancels the work.

        Raises:
            Busy: too much waits already.
            TooMuchWork: it takes more time or memory than it may.
        """
        task = self.submit(function, *arguments, cpu_s=cpu_s)
        try:
            result: T = await wrap_future(task.future)
        except CancelledError:
            task.cancel(grace_s)
            raise
        return result

    def call(self, function: Callable[..., T], *arguments: Any, cpu_s: float = LONG_CPU_S) -> T:
        """Have ``function(*arguments)`` done, and wait for it. Not for the event loop.

        Raises:
            Busy, TooMuchWork: as :meth:`run`.
        """
        result: T = self.submit(function, *arguments, cpu_s=cpu_s).future.result()
        return result

    def close(self) -> None:
        """End everything, at once. Not for the event loop."""
        with self._changed:
            self._closing = True
            for task in self._queue:
                task.future.cancel()
            self._queue.clear()
            self._changed.notify_all()
            threads = tuple(self._threads)
        for thread in threads:
            thread.join(5.0)

    # A thread for each process

    def _serve(self) -> None:
        with contextlib.ExitStack() as stack:
            process: _Process | None = None
            while True:
                task = self._next()
                if task is None:
                    return
                if not task.future.set_running_or_notify_cancel():
                    continue
                try:
                    if process is None:
                        process = stack.enter_context(_process(self._niceness))
                    _settle(task, process.do(task, lambda: self._closing))
                except Exception as error:
                    # It was ended, or ended by itself: the next piece gets a new one.
                    stack.close()
                    process = None
                    with contextlib.suppress(Exception):
                        task.future.set_exception(error)

    def _next(self) -> Task | None:
        """What is to be done next; None: this thread is to end."""
        with self._changed:
            self._idle += 1
            try:
                self._changed.wait_for(lambda: self._queue or self._closing, IDLE_S)
            finally:
                self._idle -= 1
            if self._queue and not self._closing:
                return self._queue.popleft()
            self._threads.discard(threading.current_thread())
            return None


def _settle(task: Task, told: Told) -> None:
    match told.kind:
        case "done":
            task.future.set_result(told.value)
        case "refused":
            task.future.set_exception(told.value)
        case "memory":
            task.future.set_exception(_too_much_memory(task))
        case _:
            task.future.set_exception(RuntimeError(f"in a process for work: {told.value}"))


def _too_much_memory(task: Task) -> TooMuchWork:
    most = task.piece.memory >> 20
    return TooMuchWork(
        f"this takes more than {most} MiB of memory to work on, which is the most", mib=most
    )


class Ended(Exception):
    """Nobody waits for it any more."""


class _Process:
    """A process that does one piece of work after another."""

    def __init__(self, process: "subprocess.Popen[bytes]", connection: Connection) -> None:
        self._process = process
        self._connection = connection

    def do(self, task: Task, is_closing: Callable[[], bool]) -> Told:
        """Have a piece done.

        Raises:
            TooMuchWork: it took too long.
            Exception: what ``progress`` raised; or the process ended. It is of no use then.
        """
        deadline = time.monotonic() + PATIENCE * task.piece.cpu_s
        try:
            self._connection.send(task.piece)
            while True:
                if self._connection.poll(CHECK_S):
                    told: Told = self._connection.recv()
                    if told.kind != "progress":
                        return told
                    if task.progress is not None:
                        task.progress(*told.value)
                now = time.monotonic()
                if is_closing() or (task.over_at is not None and now >= task.over_at):
                    raise Ended("it was cancelled")
                if now >= deadline:
                    raise _too_long(task)
        except (EOFError, OSError):
            code = self._process.wait(5.0)
            if code == -signal.SIGXCPU:
                raise _too_long(task) from None
            if code in (-signal.SIGKILL, -signal.SIGSEGV, -signal.SIGABRT, -signal.SIGBUS):
                raise TooMuchWork(
                    "a process ended while it worked on this, as it does when memory runs out; "
                    "nothing was changed"
                ) from None
            raise RuntimeError(f"a process for work ended by itself ({code})") from None


def _too_long(task: Task) -> TooMuchWork:
    most = task.piece.cpu_s
    return TooMuchWork(
        f"this takes more than {most:g} s of computing, which is the most", seconds=most
    )


@contextmanager
def _process(niceness: int) -> Iterator[_Process]:
    """A process for work; killed at the end."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        number = theirs.fileno()
        process = subprocess.Popen(
            [sys.executable, "-m", "app.gateway.work_process", str(number), str(niceness)],
            pass_fds=[number],
            env=node_environment(),
            # Decoders write what they think of a picture to standard error.
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        theirs.close()
        try:
            yield _Process(process, Connection(ours.detach()))
        finally:
            process.kill()
            process.wait()
