"""Long work: started by one request, asked about by others, and cancelled by one more.

A job runs to its end whether or not somebody asks; how it ended is kept for a while. So a page that
is closed or loses its connection half-way leaves nothing half done.
"""

import asyncio
import logging
import secrets
import threading
import time
from collections.abc import Awaitable, Callable
from typing import Any, Literal, TypeVar

from app.errors import FarhandError, NotFound, RequestError
from app.gateway.busy import Busy
from app.gateway.errors import INTERNAL_MESSAGE, error_body
from app.gateway.work_pool import LONG_CPU_S, Ended, Task, WorkPool

log = logging.getLogger(__name__)

MOST_RUNNING = 2
"""At once, whoever started them: driving goes first on the machine."""
KEPT_S = 600.0
"""How long it can be asked how a job ended."""
MOST_KEPT = 20

T = TypeVar("T")
State = Literal["running", "done", "failed", "cancelled"]
_CANCELLED = "it was cancelled; nothing was changed"
Work = Callable[["Job"], Awaitable[dict[str, Any]]]


class Cancelled(RequestError):
    """Somebody cancelled the work; nothing of it was done."""

    default_code = "cancelled"
    status = 409


class Job:
    """One piece of long work. ``progress`` may be called from any thread.

    Args:
        kind: What it does, as a word.
    """

    def __init__(self, kind: str) -> None:
        self.id = secrets.token_hex(16)
        self.kind = kind
        self.state: State = "running"
        self.done, self.total = 0, 0
        self.result: dict[str, Any] | None = None
        self.error: dict[str, Any] | None = None
        self.ended_at = 0.0
        self._cancel = threading.Event()
        self._task: Task | None = None

    def progress(self, done: int, total: int) -> None:
        """Say how far it is, and end here if somebody cancelled it.

        Raises:
            Cancelled: somebody did.
        """
        if self._cancel.is_set():
            raise Cancelled(_CANCELLED)
        self.done, self.total = done, total

    def cancel(self) -> None:
        """End it: what runs in a process at once, else where it next says how far it is.

        Once it has done its work nothing changes.
        """
        self._cancel.set()
        if self._task is not None:
            self._task.cancel()

    async def run(
        self,
        pool: WorkPool,
        function: Callable[..., T],
        *arguments: Any,
        progress: Callable[[int, int], None] | None = None,
        cpu_s: float = LONG_CPU_S,
        memory: int | None = None,
    ) -> T:
        """Have a part of the job done in a process, which ends when the job is cancelled.

        Args:
            pool: Whose process.
            function: See :meth:`WorkPool.submit <app.gateway.work_pool.WorkPool.submit>`.
            arguments: Of the function.
            progress: In place of :meth:`progress`.
            cpu_s: Processor time that it may take.
            memory: Bytes that it may take; None: what the pool allows.

        Raises:
            Cancelled: somebody cancelled the job.
            Busy, TooMuchWork: as :meth:`WorkPool.run <app.gateway.work_pool.WorkPool.run>`.
        """
        self._task = pool.submit(
            function, *arguments, progress=progress or self.progress, cpu_s=cpu_s, memory=memory
        )
        try:
            if self._cancel.is_set():
                self._task.cancel()
            result: T = await asyncio.wrap_future(self._task.future)
        except (Ended, asyncio.CancelledError):
            if not self._cancel.is_set():
                raise
            raise Cancelled(_CANCELLED) from None
        finally:
            self._task = None
        return result

    def as_json(self) -> dict[str, Any]:
        """As the REST interface shows it."""
        return {
            "id": self.id,
            "kind": self.kind,
            "state": self.state,
            "done": self.done,
            "total": self.total,
            "result": self.result,
            "error": self.error,
        }


class Jobs:
    """The jobs of one server. Used on the event loop."""

    def __init__(self) -> None:
        self._jobs: dict[str, Job] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    def check_free(self) -> None:
        """Do nothing if another job may start.

        Raises:
            Busy: as many run as may.
        """
        running = sum(job.state == "running" for job in self._jobs.values())
        if running >= MOST_RUNNING:
            raise Busy(
                f"{running} pieces of long work are under way, which is the most; "
                "try again when one has ended"
            )

    def start(self, kind: str, work: Work) -> Job:
        """Start a job.

        Args:
            kind: What it does, as a word.
            work: Does it: gives the result, and calls :meth:`Job.progress` between steps that take
                no longer than a second.

        Raises:
            Busy: as many run as may.
        """
        self.check_free()
        self._forget()
        job = Job(kind)
        self._jobs[job.id] = job
        task = asyncio.create_task(self._run(job, work))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return job

    def get(self, id: str) -> Job:
        """A job that runs, or ended lately.

        Raises:
            NotFound: there is none.
        """
        self._forget()
        job = self._jobs.get(id)
        if job is None:
            raise NotFound(f"there is no job with the id {id[:64]!r}, or not any more", id=id[:64])
        return job

    async def close(self) -> None:
        """Cancel all, and wait until each has ended or undone what it began."""
        for job in self._jobs.values():
            job.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _run(self, job: Job, work: Work) -> None:
        try:
            job.result = await work(job)
            job.state = "done"
        except Cancelled:
            job.state = "cancelled"
        except FarhandError as error:
            job.state = "failed"
            job.error = error_body(error.code, error.message, error.detail)["error"]
        except Exception:
            log.exception("a job (%s) failed", job.kind)
            job.state = "failed"
            job.error = error_body("internal", INTERNAL_MESSAGE)["error"]
        finally:
            job.ended_at = time.monotonic()

    def _forget(self) -> None:
        now = time.monotonic()
        ended = [job for job in self._jobs.values() if job.state != "running"]
        for number, job in enumerate(ended):
            if now - job.ended_at > KEPT_S or number < len(ended) - MOST_KEPT:
                del self._jobs[job.id]
