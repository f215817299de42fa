"""One operator session: what a browser sends, and what becomes of it."""

import asyncio
import contextlib
import logging
import secrets
import time
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from app.errors import FarhandError, NotAllowed, RequestError
from app.gateway.bad_messages import BadMessages
from app.gateway.busy import Busy
from app.gateway.closing import CLOSE_INTERNAL, CLOSE_TOO_BIG, CLOSE_TOO_SLOW, Closing
from app.gateway.drive import Situation
from app.gateway.errors import INTERNAL_MESSAGE
from app.gateway.eyes import PictureAge
from app.gateway.frame_age import Age
from app.gateway.frame_job import FrameWorker
from app.gateway.frame_slot import FrameSlot
from app.gateway.frame_work import FrameWork
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
from app.gateway.numbers import Counter, tick_ms
from app.gateway.outbox import Outbox
from app.gateway.pace import Pace
from app.gateway.roles import OPERATORS_ONLY, Role, may_send
from app.gateway.session_keys import SessionKeys
from app.gateway.stops import Stops
from app.link.messages import StopRequest

if TYPE_CHECKING:
    from app.gateway.hub import Hub

log = logging.getLogger(__name__)

MAX_REQUESTS = 16
"""Requests to the robot that may wait for those before them."""
MAX_MESSAGES_HZ = 200.0
"""A client that sends more in the long run is read no faster, so that a flood from one does not
take the time of all; a page sends less than half of it."""
MESSAGE_BURST = 100


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
        metrics = hub.metrics
        self._diary = hub.diary.of_session(self.name)
        self._stops = Stops(
            lambda reason, source: hub.stop(self.name, reason, source),
            lambda source: metrics.stops.labels(source).inc(),
            self.tell,
        )
        self._counted = BadMessages(hub.settings.gateway.max_bad_messages, metrics, self.tell)
        self._gallery = GalleryChoice(hub.gallery, hub.learners)
        self._heard_at = time.monotonic()
        self._leases = LeaseKeeper(self.name, hub.robot, hub.ask, self._silent_s, self.tell)
        self._pictures = PictureAge(hub.settings.gateway.picture_age_ms)
        self._scale = 1.0
        sequence = Counter()
        self._keys = SessionKeys(
            HeldKeys(hub.holds, sequence),
            hub.settings.gateway.max_frame_age_ms,
            hub.robot,
            self.outbox,
            metrics,
            self._diary,
        )
        self._slot = FrameSlot(
            role, hub.settings, metrics, lambda: self._gallery.enrolled, self._situation_of_frame
        )
        # A thread of its own, begun by the first frame: whatever others do, and however many of
        # them there are, the system gives each session's frames their turn.
        self._frame_thread = ThreadPoolExecutor(1, f"frames-{self.name}")
        worker = FrameWorker(
            self.name,
            hub.settings,
            hub.gallery.current,
            hub.robot,
            hub.holds,
            sequence,
            self._stop_shown,
        )
        self._work = FrameWork(
            self._slot,
            worker,
            self._frame_thread,
            self.outbox,
            self._counted,
            metrics,
            self._diary,
        )
        self._loop = asyncio.get_running_loop()
        self._choosing: asyncio.Future[None] = self._loop.create_future()
        self._choosing.set_result(None)
        self._requests: asyncio.Queue[ClientMessage] = asyncio.Queue(MAX_REQUESTS)
        self._arrivals = 0
        self._opened_tick = tick_ms()

    async def run(self) -> None:
        """Serve until either side ends; then give the lease back."""
        self.outbox.put(self._hello())
        self._hub.people.add(self)
        tasks = [
            asyncio.create_task(work, name=f"{self.name}-{what}")
            for what, work in (
                ("read", self._read()),
                ("work", self._work.run()),
                ("write", self._write()),
                ("ask", self._answer_requests()),
            )
        ]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            await self._end(done.pop())
        finally:
            self._hub.people.discard(self)
            for task in (*tasks, self._choosing):
                task.cancel()
            await asyncio.gather(*tasks, self._choosing, return_exceptions=True)
            self._frame_thread.shutdown(wait=False)
            self._gallery.close()
            self._diary.close()
            await asyncio.shield(self._leases.close())

    async def _end(self, task: asyncio.Task[None]) -> None:
        """Close the WebSocket for the reason that the first task to end gives."""
        error = task.exception()
        if error is None or isinstance(error, WebSocketDisconnect | OSError):
            return
        if isinstance(error, Closing):
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
            "problem": self._hub.keeper.problem_for(self.role),
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
                raise Closing(CLOSE_TOO_BIG, f"a message may have {limit} bytes, not {size}")
            try:
                if data is not None:
                    self._slot.put(data, self._arrivals)
                else:
                    self._take_text(text or "")
                    self._counted.good(self._arrivals)
            except RequestError as error:
                seq = error.detail.get("seq") if data is not None else None
                self._counted.bad(error, seq, self._arrivals)

    def _stop_shown(self, request: StopRequest) -> None:
        """A frame says stop. Called on the frame's thread."""
        # Sent from here, whatever the event loop is busy with; then made sure of, and told.
        self._hub.robot.send_stop(request)
        with contextlib.suppress(RuntimeError):  # the server has ended
            self._loop.call_soon_threadsafe(self._stops.begin, request.reason, "gesture")

    def _silent_s(self) -> float:
        return time.monotonic() - self._heard_at

    def _situation(
        self, enrolled: Enrolled, now: float, age: Age, *, by_keys: bool = False
    ) -> Situation:
        state = self._hub.robot.live_state
        return Situation(
            actions=enrolled.actions,
            lease=self._leases.lease,
            state=state,
            stale=age.stale,
            life_ms=age.life_ms,
            unseen=None if state is None else self._pictures(state.tick),
            scale=self._scale,
            at=now,
            by_keys=by_keys,
        )

    def _situation_of_frame(self, enrolled: Enrolled, now: float, age: Age) -> Situation:
        return self._situation(enrolled, now, age, by_keys=self._keys.drive(now))

    def _situation_of_key(self, now: float, age: Age) -> Situation:
        return self._situation(self._gallery.enrolled, now, age)

    def _take_text(self, text: str) -> None:
        message = parse_client_message(text)
        if not may_send(message.type, self.role):
            self.tell(NotAllowed(OPERATORS_ONLY))
            return
        match message:
            case Ping():
                self.outbox.put({"type": "pong", "t": message.t, "tick": tick_ms()})
            case View():
                self._slot.detail, self._slot.glass = message.detail, message.glass
            case Speed():
                self._scale = message.scale
            case Jog():
                self._keys.take(message, self._situation_of_key)
            case Picture():
                self._pictures.saw(message.camera, message.tick)
            case UseGallery():
                # Learning it may take long, and must not hold up who disarms or gives control back.
                self._choosing.cancel()
                self._choosing = asyncio.create_task(self._choose(message.gallery))
            case TakeControl() | HandOver():
                self._queue(message)
            case _ if message.type == "stop":
                self._stops.begin("stop was pressed", "button")
            case _:
                self._queue(message)

    def _queue(self, message: ClientMessage) -> None:
        try:
            self._requests.put_nowait(message)
        except asyncio.QueueFull:
            self.tell(Busy("the robot has not answered the requests before this one yet"))

    # Asking the robot

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
        match message.type:
            case "release_control":
                await self.give_up()
            case "ask_control":
                self._hub.people.ask(self)
            case "keep_control":
                self._hub.people.keep(self)
            case "arm":
                if not self._choosing.done():
                    raise Busy("the gallery that you chose is still being learned; arm again then")
                self._hub.check_gestures()
                await self._leases.arm(armed=True)
            case "disarm":
                await self._leases.arm(armed=False)
            case "reset":
                await self._hub.reset(self.name)

    async def _choose(self, gallery: str) -> None:
        try:
            await self._gallery.choose(gallery)
            self.tell_gallery()
        except FarhandError as error:
            self.tell(error)

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
                raise Closing(CLOSE_TOO_SLOW, "the browser reads too slowly")
            await self._socket.send_text(text)

    def tell_gallery(self) -> None:
        """Send the ``gallery`` message; a session whose gallery is gone uses the shared one."""
        self._gallery.check()
        message = {
            "type": "gallery",
            "version": self._hub.gallery.version,
            "gallery": self._gallery.id,
            "problem": self._hub.keeper.problem_for(self.role),
        }
        self.outbox.put(message)

    def tell(self, error: FarhandError, seq: int | None = None) -> None:
        """Send an ``error`` message."""
        self.outbox.put(error_message(error, seq))
