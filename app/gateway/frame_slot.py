"""The newest frame of one session that is worth looking at: one slot, never a queue."""

import asyncio
import time
from collections.abc import Callable

from app.config import Settings
from app.errors import FrameRefused, NotAllowed
from app.gateway.drive import Situation
from app.gateway.frame_age import Age, FrameAge
from app.gateway.frame_job import FrameJob
from app.gateway.gallery import Enrolled
from app.gateway.metrics import Metrics
from app.gateway.numbers import newer, tick_ms
from app.gateway.roles import FRAME, Role, may_send
from app.link.header import HEADER_SIZE, FrameHeader
from app.pipeline.decode import read_within

Situate = Callable[[Enrolled, float, Age], Situation]
"""With this gallery, now (s, monotonic), of a frame of this age."""


class FrameSlot:
    """Takes a session's frames in as they arrive. Used on the event loop.

    Args:
        role: Whose frames these are.
        settings: Of the whole server.
        metrics: Counts the frames that nobody looks at.
        enrolled: The gallery that the session uses at the moment.
        situate: What is known at the moment of lease, robot and operator.
    """

    def __init__(
        self,
        role: Role,
        settings: Settings,
        metrics: Metrics,
        enrolled: Callable[[], Enrolled],
        situate: Situate,
    ) -> None:
        self.detail = self.glass = False
        """Whether the session wants to see the masks, and every step between."""
        self._role = role
        self._limits = settings.pipeline.decode
        self._detail_s = 1 / settings.gateway.detail_rate_hz
        self._next_detail = 0.0
        self._metrics = metrics
        self._enrolled = enrolled
        self._situate = situate
        self._age = FrameAge(settings.gateway.max_frame_age_ms)
        self._last_seq: int | None = None
        self._job: FrameJob | None = None
        self._filled = asyncio.Event()

    def put(self, message: bytes, arrival: int) -> None:
        """Put a frame into the slot, unless its header says that it is of no use.

        All that can be judged without decoding is judged here, because a frame in the slot may be
        replaced before anybody looks at it.

        Args:
            message: Header and JPEG.
            arrival: Number of the message within its session.

        Raises:
            RequestError: it is no frame, too large, or not from an operator; with the frame's
                number as ``seq`` in its detail, where there is one.
        """
        header = FrameHeader.unpack(message)
        seq = header.sequence
        if not may_send(FRAME, self._role):
            raise NotAllowed("an observer's frames are not looked at", seq=seq)
        jpeg = message[HEADER_SIZE:]
        try:
            read_within(jpeg, self._limits)
        except FrameRefused as error:
            error.detail["seq"] = seq
            raise
        if not newer(seq, self._last_seq):
            self._metrics.frames.labels("out_of_order").inc()
            return
        self._last_seq = seq
        if self._job is not None:
            self._metrics.frames.labels("replaced").inc()
        now = time.monotonic()
        detail = self.detail and now >= self._next_detail
        if detail:
            self._next_detail = now + self._detail_s
        enrolled = self._enrolled()
        age = self._age(header.tick, header.captured_ms, tick_ms())
        self._job = FrameJob(
            seq=seq,
            jpeg=jpeg,
            arrived=now,
            arrival=arrival,
            situation=self._situate(enrolled, now, age),
            enrolled=enrolled,
            detail=detail,
            glass=self.glass,
        )
        self._filled.set()

    async def take(self, wait_s: float) -> FrameJob | None:
        """Take the frame out; None when none comes for so long."""
        try:
            async with asyncio.timeout(wait_s):
                await self._filled.wait()
        except TimeoutError:
            return None
        self._filled.clear()
        job, self._job = self._job, None
        return job
