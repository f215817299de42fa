"""From a session's newest frame to what the browser is told of it, one frame at a time."""

import asyncio
import time
from concurrent.futures import Executor

from app.errors import FrameRefused
from app.gateway.bad_messages import BadMessages
from app.gateway.diary.session import SessionDiary
from app.gateway.frame_job import FrameWorker
from app.gateway.frame_slot import FrameSlot
from app.gateway.metrics import Metrics
from app.gateway.outbox import Outbox

IDLE_CHECK_S = 0.05


class FrameWork:
    """Takes the newest frame to a thread; ends a gesture when none comes.

    Args:
        slot: Where the frames come from.
        worker: What looks at them.
        thread: For that, and for nothing else.
        outbox: Where its messages go.
        counted: Where good and bad frames are counted.
        metrics: Of the whole server.
        diary: Notes what was seen.
    """

    def __init__(
        self,
        slot: FrameSlot,
        worker: FrameWorker,
        thread: Executor,
        outbox: Outbox,
        counted: BadMessages,
        metrics: Metrics,
        diary: SessionDiary,
    ) -> None:
        self._slot = slot
        self._worker = worker
        self._thread = thread
        self._outbox = outbox
        self._counted = counted
        self._metrics = metrics
        self._diary = diary

    async def run(self) -> None:
        """Work for ever.

        Raises:
            Closing: too many frames in a row were bad.
        """
        loop = asyncio.get_running_loop()
        while True:
            job = await self._slot.take(IDLE_CHECK_S)
            if job is None:
                ended = self._worker.end(time.monotonic())
                if ended is not None:
                    self._outbox.put(ended)
                    if ended["phase"] == "end":
                        self._diary.ended()
                continue
            running = loop.run_in_executor(self._thread, self._worker.run, job)
            try:
                # Shielded: a stop that is shown counts although the browser goes meanwhile.
                done = await asyncio.shield(running)
            except FrameRefused as error:
                self._counted.bad(error, job.seq, job.arrival)
                continue
            self._counted.good(job.arrival)
            self._metrics.frames.labels("processed").inc()
            self._metrics.frame_times(done.timing_ms)
            if done.decision.command is not None:
                self._metrics.commands.inc()
            for message in done.messages:
                self._outbox.put(message)
            self._diary.saw(job, done)
