"""One operator session: what a browser sends, and what becomes of it."""

import asyncio
import logging
import secrets
import time
from typing import TYPE_CHECKING, Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from app.errors import FarhandError, FrameRefused, NotAllowed, RequestError
from app.gateway.drive import Situation
from app.gateway.errors import INTERNAL_MESSAGE
from app.gateway.eyes import PictureAge
from app.gateway.frame_age import FrameAge
from app.gateway.frame_job import FrameDone, FrameJob, FrameWorker
from app.gateway.gallery import Enrolled
from app.gateway.gallery_choice import GalleryChoice
from app.gateway.held_keys import HeldKeys
from app.gateway.lease_keeper import LeaseKeeper
from app.gateway.messages import (
    ClientMessage,
    HandOver,
    Jog,
    Picture,
    Ping,
    Speed,
    TakeControl,
    UseGallery,
    View,
    error_message,
    parse_client_message,
)
from app.gateway.numbers import Counter, newer, tick_ms
from app.gateway.outbox import Outbox
from app.gateway.pace import Pace
from app.gateway.roles import FRAME, OPERATORS_ONLY, Role, may_send
from app.link.header import HEADER_SIZE, FrameHeader
from app.pipeline.decode import read_header

if TYPE_CHECKING:
    from app.gateway.hub import Hub

log = logging.getLogger(__name__)

MAX_STOPS = 8
"""Stops of one session under way at once; one more would tell the robot nothing new."""
MAX_REQUESTS = 16
"""Requests to the robot that may wait for those before them."""
MAX_MESSAGES_HZ = 200.0
"""A client that sends more in the long run is read no faster, so that a flood from one does not
take the time of all; a page sends less than half of it."""
MESSAGE_BURST = 100
IDLE_CHECK_S = 0.05
KEYS_S = 0.5
"""So long after its last ``jog`` message a session counts as driving by keys, and its frames move
nothing: twice the life of a command."""
CLOSE_BAD = 1007
CLOSE_TOO_BIG = 1009
CLOSE_TOO_SLOW = 1013
CLOSE_INTERNAL = 1011


class Busy(RequestError):
    """Too much was asked at once."""

    default_code = "busy"
    status = 429


class _Closing(Exception):
    """The session ends now, with this close code."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code = code
        self.reason = reason


class OperatorSession:
    """Speaks the operator protocol on one accepted WebSocket. Lives on the event loop.

    Four tasks: the reader only sorts what arrives, so that the newest frame and a stop are always
    seen at once; the worker takes the newest frame to a thread; the writer empties the outbox; the
    asker puts requests to the robot one after another. The first to end ends the session.
    """

    def __init__(self, hub: "Hub", socket: WebSocket, role: Role = "operator") -> None:
        self.name = f"{role}-{secrets.token_hex(3)}"
        self.role: Role = role
        self.outbox = Outbox()
        self._hub = hub
        self._socket = socket
        self._settings = hub.settings
        sequence = Counter()
        self._worker = FrameWorker(
            self.name, hub.settings, hub.gallery.current, hub.robot, hub.holds, sequence
        )
        self._keys = HeldKeys(hub.holds, sequence)
        self._keys_at = float("-inf")
        self._keys_age = FrameAge(hub.settings.gateway.max_frame_age_ms, "key press")
        self._keys_told: tuple[int, str | None] | None = None
        self._gallery = GalleryChoice(hub.gallery)
        self._heard_at = time.monotonic()
        self._leases = LeaseKeeper(self.name, hub.robot, hub.ask, self._silent_s, self.tell)
        self._requests: asyncio.Queue[ClientMessage] = asyncio.Queue(MAX_REQUESTS)
        self._stops: set[asyncio.Task[None]] = set()
        self._slot: FrameJob | None = None
        self._slot_filled = asyncio.Event()
        self._last_seq: int | None = None
        self._arrivals = 0
        self._last_bad = 0
        self._bad_in_a_row = 0
        self._opened_tick = tick_ms()
        self._age = FrameAge(hub.settings.gateway.max_frame_age_ms)
        self._pictures = PictureAge(hub.settings.gateway.picture_age_ms)
        self._scale = 1.0
        self._detail = self._glass = False
        self._next_detail = 0.0

    async def run(self) -> None:
        """Serve until either side ends; then give the lease back."""
        self.outbox.put(self._hello())
        self._hub.people.add(self)
        tasks = [
            asyncio.create_task(work, name=f"{self.name}-{what}")
            for what, work in (
                ("read", self._read()),
                ("work", self._work()),
                ("write", self._write()),
                ("ask", self._answer_requests()),
            )
        ]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            await self._end(done.pop())
        finally:
            self._hub.people.discard(self)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            self._gallery.close()
            await asyncio.shield(self._leases.close())

    async def _end(self, task: asyncio.Task[None]) -> None:
        """Close the WebSocket for the reason that the first task to end gives."""
        error = task.exception()
        if error is None or isinstance(error, WebSocketDisconnect | OSError):
            return
        if isinstance(error, _Closing):
            log.info("%s is closed: %s", self.name, error.reason)
            await self._close(error.code, error.reason)
        else:
            log.error("%s failed", self.name, exc_info=error)
            await self._close(CLOSE_INTERNAL, INTERNAL_MESSAGE)

    async def _close(self, code: int, reason: str) -> None:
        try:
            async with asyncio.timeout(1.0):
                # What is said already should arrive, above all the reason for closing.
                while len(self.outbox) and not self.outbox.overflowed:
                    text = await self.outbox.get()
                    if text is not None:
                        await self._socket.send_text(text)
                await self._socket.close(code, reason[:120])
        except (TimeoutError, RuntimeError, OSError):
            log.debug("%s: the browser was gone before it was closed", self.name)

    def _hello(self) -> dict[str, Any]:
        decode = self._settings.pipeline.decode
        return {
            "type": "hello",
            "tick": self._opened_tick,
            "role": self.role,
            "robot": self._hub.robot.id,
            "session": self.name,
            "version": self._hub.version,
            "gallery": self._hub.gallery.version,
            "problem": self._hub.keeper.problem,
            "limits": {
                "frame_bytes": decode.max_bytes,
                "frame_width": decode.max_width,
                "frame_height": decode.max_height,
                "message_bytes": self._settings.gateway.max_message_bytes,
                "frame_age_ms": self._settings.gateway.max_frame_age_ms,
                "bad_messages": self._settings.gateway.max_bad_messages,
            },
        }

    # Reading

    async def _read(self) -> None:
        pace = Pace(MAX_MESSAGES_HZ, MESSAGE_BURST)
        while True:
            message = await self._socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            self._heard_at = time.monotonic()
            if (wait := pace.wait_s(self._heard_at)) > 0:
                await asyncio.sleep(wait)
            self._arrivals += 1
            data, text = message.get("bytes"), message.get("text")
            size = len(data) if data is not None else len(text or "")
            limit = self._settings.gateway.max_message_bytes
            if size > limit:
                raise _Closing(CLOSE_TOO_BIG, f"a message may have {limit} bytes, not {size}")
            try:
                if data is not None:
                    self._take_frame(data)
                else:
                    self._take_text(text or "")
                    self._good(self._arrivals)
            except RequestError as error:
                seq = error.detail.get("seq") if data is not None else None
                self._bad(error, seq, self._arrivals)

    def _silent_s(self) -> float:
        return time.monotonic() - self._heard_at

    def _take_frame(self, message: bytes) -> None:
        """Put a frame into the slot, unless its header says that it is of no use.

        All that can be judged without decoding is judged here, because a frame in the slot may be
        replaced before anybody looks at it.
        """
        header = FrameHeader.unpack(message)
        seq = header.sequence
        if not may_send(FRAME, self.role):
            raise NotAllowed("an observer's frames are not looked at", seq=seq)
        jpeg = message[HEADER_SIZE:]
        try:
            self._check_frame(jpeg)
        except FrameRefused as error:
            error.detail["seq"] = seq
            raise
        if not newer(seq, self._last_seq):
            self._hub.metrics.frames.labels("out_of_order").inc()
            return
        self._last_seq = seq
        if self._slot is not None:
            self._hub.metrics.frames.labels("replaced").inc()
        now = time.monotonic()
        detail = self._detail and now >= self._next_detail
        if detail:
            self._next_detail = now + 1 / self._settings.gateway.detail_rate_hz
        enrolled = self._gallery.enrolled
        stale = self._age(header.tick, header.captured_ms, tick_ms())
        by_keys = now - self._keys_at < KEYS_S
        self._slot = FrameJob(
            seq=seq,
            jpeg=jpeg,
            arrived=now,
            arrival=self._arrivals,
            situation=self._situation(enrolled, now, stale, by_keys=by_keys),
            enrolled=enrolled,
            detail=detail,
            glass=self._glass,
        )
        self._slot_filled.set()

    def _situation(
        self, enrolled: Enrolled, now: float, stale: str | None, *, by_keys: bool
    ) -> Situation:
        state = self._hub.robot.live_state
        return Situation(
            actions=enrolled.actions,
            lease=self._leases.lease,
            state=state,
            stale=stale,
            unseen=None if state is None else self._pictures(state.tick),
            scale=self._scale,
            at=now,
            by_keys=by_keys,
        )

    def _take_jog(self, jog: Jog) -> None:
        """Command what a held key asks for, and say when nothing comes of it, and why."""
        now = self._keys_at = time.monotonic()
        stale = self._keys_age(jog.tick, 0.0, tick_ms())
        situation = self._situation(self._gallery.enrolled, now, stale, by_keys=False)
        decision = self._keys.decide(jog, situation)
        if decision.command is not None:
            self._hub.robot.send(decision.command)
            self._hub.metrics.commands.inc()
        told = (jog.hold, decision.reason)
        if told != self._keys_told:
            self._keys_told = told
            self.outbox.put({"type": "jog", "hold": jog.hold, "reason": decision.reason})

    def _check_frame(self, jpeg: bytes) -> None:
        limits = self._settings.pipeline.decode
        if len(jpeg) > limits.max_bytes:
            raise FrameRefused(
                f"the frame has {len(jpeg)} bytes: at most {limits.max_bytes} are accepted",
                code="frame_too_large",
                bytes=len(jpeg),
                max_bytes=limits.max_bytes,
            )
        header = read_header(jpeg)
        if header.width > limits.max_width or header.height > limits.max_height:
            raise FrameRefused(
                f"the frame is {header.width}x{header.height}: "
                f"at most {limits.max_width}x{limits.max_height} is accepted",
                code="frame_too_large",
                width=header.width,
                height=header.height,
            )

    def _take_text(self, text: str) -> None:
        message = parse_client_message(text)
        if not may_send(message.type, self.role):
            self.tell(NotAllowed(OPERATORS_ONLY))
            return
        match message:
            case Ping():
                self.outbox.put({"type": "pong", "t": message.t, "tick": tick_ms()})
            case View():
                self._detail, self._glass = message.detail, message.glass
            case Speed():
                self._scale = message.scale
            case Jog():
                self._take_jog(message)
            case Picture():
                self._pictures.saw(message.camera, message.tick)
            case TakeControl() | HandOver() | UseGallery():
                self._queue(message)
            case _ if message.type == "stop":
                self._begin_stop("stop was pressed", "button")
            case _:
                self._queue(message)

    def _queue(self, message: ClientMessage) -> None:
        try:
            self._requests.put_nowait(message)
        except asyncio.QueueFull:
            self.tell(Busy("the robot has not answered the requests before this one yet"))

    # Working

    async def _work(self) -> None:
        """Take the newest frame to a thread, one at a time; end a gesture when none comes."""
        loop = asyncio.get_running_loop()
        while True:
            try:
                async with asyncio.timeout(IDLE_CHECK_S):
                    await self._slot_filled.wait()
            except TimeoutError:
                ended = self._worker.end(time.monotonic())
                if ended is not None:
                    self.outbox.put(ended)
                continue
            self._slot_filled.clear()
            job, self._slot = self._slot, None
            if job is None:
                continue
            running = loop.run_in_executor(self._hub.images, self._worker.run, job)
            running.add_done_callback(self._heed_stop)
            try:
                # Shielded: a stop that is shown counts although the browser goes meanwhile.
                done = await asyncio.shield(running)
            except FrameRefused as error:
                self._bad(error, job.seq, job.arrival)
                continue
            self._good(job.arrival)
            metrics = self._hub.metrics
            metrics.frames.labels("processed").inc()
            metrics.frame_times(done.timing_ms)
            if done.decision.command is not None:
                metrics.commands.inc()
            for message in done.messages:
                self.outbox.put(message)

    def _heed_stop(self, running: asyncio.Future[FrameDone]) -> None:
        """A frame has been looked at: if it says stop, stop."""
        if running.cancelled() or running.exception() is not None:
            return
        stop = running.result().decision.stop
        if stop is not None:
            self._begin_stop(stop.reason, "gesture")

    def _begin_stop(self, reason: str, source: str) -> None:
        """Stop the robot, behind nothing else; goes on even if this session ends."""
        if len(self._stops) >= MAX_STOPS:
            return
        task = asyncio.create_task(self._stop(reason, source))
        self._stops.add(task)
        task.add_done_callback(self._stops.discard)

    async def _stop(self, reason: str, source: str) -> None:
        self._hub.metrics.stops.labels(source).inc()
        try:
            await self._hub.stop(self.name, reason)
        except FarhandError as error:
            self.tell(error)

    async def _answer_requests(self) -> None:
        while True:
            message = await self._requests.get()
            try:
                await self._request(message)
            except FarhandError as error:
                self.tell(error)

    async def _request(self, message: ClientMessage) -> None:
        if isinstance(message, TakeControl):
            await self.take(takeover=message.takeover)
            return
        if isinstance(message, HandOver):
            await self._hub.people.hand_over(self, message.to)
            return
        if isinstance(message, UseGallery):
            await self._gallery.choose(message.gallery)
            self.tell_gallery()
            return
        match message.type:
            case "release_control":
                await self.give_up()
            case "ask_control":
                self._hub.people.ask(self)
            case "keep_control":
                self._hub.people.keep(self)
            case "arm":
                self._hub.check_gestures()
                await self._leases.arm(armed=True)
            case "disarm":
                await self._leases.arm(armed=False)
            case "reset":
                await self._hub.reset(self.name)

    async def take(self, *, takeover: bool = False) -> None:
        """Become the one who drives; raises what :meth:`LeaseKeeper.take` does."""
        await self._leases.take(takeover=takeover)

    async def give_up(self) -> None:
        """Give control back; raises what :meth:`LeaseKeeper.release` does."""
        await self._leases.release()

    # Writing

    async def _write(self) -> None:
        while True:
            text = await self.outbox.get()
            if text is None:
                raise _Closing(CLOSE_TOO_SLOW, "the browser reads too slowly")
            await self._socket.send_text(text)

    def tell_gallery(self) -> None:
        """Send the ``gallery`` message; a session whose gallery is gone uses the shared one."""
        self._gallery.check()
        message = {
            "type": "gallery",
            "version": self._hub.gallery.version,
            "gallery": self._gallery.id,
            "problem": self._hub.keeper.problem,
        }
        self.outbox.put(message)

    def tell(self, error: FarhandError, seq: int | None = None) -> None:
        """Send an ``error`` message."""
        self.outbox.put(error_message(error, seq))

    # Counting what is bad

    def _bad(self, error: FarhandError, seq: int | None, arrival: int) -> None:
        self._hub.metrics.bad_messages.labels(error.code).inc()
        if seq is not None:
            self._hub.metrics.frames.labels("refused").inc()
        error.detail.pop("seq", None)
        self.tell(error, seq)
        self._last_bad = max(self._last_bad, arrival)
        self._bad_in_a_row += 1
        limit = self._settings.gateway.max_bad_messages
        if self._bad_in_a_row >= limit:
            raise _Closing(CLOSE_BAD, f"{limit} bad messages in a row")

    def _good(self, arrival: int) -> None:
        """A message was good. One that a bad message overtook says nothing about those after it."""
        if arrival > self._last_bad:
            self._bad_in_a_row = 0
