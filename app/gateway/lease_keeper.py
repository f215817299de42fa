"""One session's right to drive: taken, renewed while held, given back."""

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import Literal

from app.errors import FarhandError, NoControl, RequestError
from app.gateway.drive import Lease
from app.gateway.robot_port import RobotPort
from app.link.messages import LeaseReply, LeaseRequest

log = logging.getLogger(__name__)

RENEW_S = 0.5
SILENT_S = 2.0
"""Without a message from the browser for this long control is given back. A link that swallows
everything closes nothing: the socket alone would say that all is well for many seconds."""

Ask = Callable[[LeaseRequest], Awaitable[LeaseReply]]

_WHO = "take control first"


class LeaseRefused(RequestError):
    """The robot's control loop said no; ``code`` and the message are its own."""

    default_code = "refused"
    status = 409


class LeaseKeeper:
    """Asks the node's control loop on behalf of one session. Used on the event loop only.

    Args:
        holder: The session's name.
        robot: The robot.
        ask: Sends a request from a thread and awaits the answer.
        silent_s: How long nothing has been heard from whoever holds the lease, s.
        on_lost: Told why the lease is gone, when it was not given back.
    """

    def __init__(
        self,
        holder: str,
        robot: RobotPort,
        ask: Ask,
        silent_s: Callable[[], float],
        on_lost: Callable[[FarhandError], None],
    ) -> None:
        self._holder = holder
        self._robot = robot
        self._ask = ask
        self._silent_s = silent_s
        self._on_lost = on_lost
        self._lease: Lease | None = None
        self._renewing: asyncio.Task[None] | None = None

    @property
    def lease(self) -> Lease | None:
        """The lease, while it is held as far as anybody here knows."""
        lease, state = self._lease, self._robot.live_state
        if lease is not None and state is not None and state.epoch > lease.epoch:
            who = state.controller
            self._lose(f"{who} took over" if who else "the robot node was started again")
        return self._lease

    async def take(self, *, takeover: bool) -> None:
        """Become the one who drives.

        Raises:
            NoControl: somebody else drives and ``takeover`` is off.
            RobotUnavailable: the robot does not answer.
        """
        lease = self._lease
        reply = await self._ask(
            LeaseRequest(
                kind="take",
                holder=self._holder,
                epoch=None if lease is None else lease.epoch,
                takeover=takeover,
            )
        )
        if not reply.granted or reply.epoch is None:
            raise NoControl(reply.reason or "somebody else has control", reply=reply.code)
        self._lease = Lease(reply.epoch)
        if self._renewing is None or self._renewing.done():
            self._renewing = asyncio.create_task(self._renew())

    async def release(self) -> None:
        """Give the right to drive back.

        Raises:
            NoControl: this session does not have it.
            RobotUnavailable: the robot does not answer; its lease then runs out by itself.
        """
        lease = self._held()
        self._lease = None
        await self._ask(LeaseRequest(kind="release", holder=self._holder, epoch=lease.epoch))

    async def arm(self, *, armed: bool) -> None:
        """Arm or disarm the robot.

        Raises:
            NoControl: this session does not have control.
            LeaseRefused: the robot says why not.
            RobotUnavailable: the robot does not answer.
        """
        lease = self._held()
        reply = await self._ask(
            LeaseRequest(kind="arm" if armed else "disarm", holder=self._holder, epoch=lease.epoch)
        )
        check_reply(reply)

    async def close(self) -> None:
        """Give everything back, without complaint."""
        if self._renewing is not None:
            self._renewing.cancel()
        if self._lease is not None:
            try:
                await self.release()
            except FarhandError as error:
                log.info("%s: the lease was not given back: %s", self._holder, error.message)

    def _held(self) -> Lease:
        lease = self.lease
        if lease is None:
            state = self._robot.live_state
            other = state.controller if state is not None else None
            who = f"{other} drives" if other else "nobody does"
            raise NoControl(f"you do not have control ({who}): {_WHO}", controller=other)
        return lease

    def _lose(self, why: str) -> None:
        self._lease = None
        self._on_lost(NoControl(f"control is lost: {why}", code="control_lost"))

    async def _renew(self) -> None:
        """Say that the holder is still there, until the lease is gone."""
        while True:
            await asyncio.sleep(RENEW_S)
            lease = self.lease
            if lease is None:
                return
            silent = self._silent_s() >= SILENT_S
            kind: Literal["renew", "release"] = "release" if silent else "renew"
            request = LeaseRequest(kind=kind, holder=self._holder, epoch=lease.epoch)
            try:
                reply = await self._ask(request)
            except FarhandError as error:
                # The node decides when a lease runs out; it may be back in time.
                log.info("%s: the lease: %s failed: %s", self._holder, kind, error.message)
                continue
            if silent:
                self._lose(f"nothing was heard from you for {SILENT_S:g} s")
                return
            if not reply.granted and self._lease == lease:
                self._lose(reply.reason or "the robot does not know this lease any more")
                return


def check_reply(reply: LeaseReply) -> None:
    """Do nothing if the node agreed.

    Raises:
        NoControl, LeaseRefused: it did not; with its own code and reason.
    """
    if reply.granted:
        return
    if reply.code == NoControl.default_code:
        raise NoControl(reply.reason or "you do not have control")
    raise LeaseRefused(reply.reason or "the robot refused", code=reply.code)
