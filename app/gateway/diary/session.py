"""What one session makes the robot do: its gestures, programs and keys."""

import time
from typing import Any

from app.gateway.diary.snapshots import Snapshots
from app.gateway.diary.writer import Writer
from app.gateway.drive import Decision, Situation
from app.gateway.frame_job import FrameDone, FrameJob
from app.gateway.messages import Jog
from app.link.actions import ACTION, Action, Sequence, Stop
from app.memory import Kind

KEYS_S = 3.0
"""Presses that follow one another more quickly are one event."""


class SessionDiary:
    """Of one session. Used on the event loop.

    Gestures are told of who has control of an armed robot; that which stops it, of anybody. What
    else a hand shows does nothing and is not written down.

    Args:
        session: Its name.
        writer: Where to.
        snapshots: For pictures of the robot.
    """

    def __init__(self, session: str, writer: Writer, snapshots: Snapshots) -> None:
        self._session = session
        self._writer = writer
        self._snapshots = snapshots
        self._shown: int | None = None
        """Token of the gesture that is held."""
        self._keys: int | None = None
        self._presses = 0
        self._hold: int | None = None
        self._held_at = 0.0

    def saw(self, job: FrameJob, done: FrameDone) -> None:
        """A frame was looked at."""
        for message in done.messages:
            if message["type"] == "gesture" and message["phase"] != "hold":
                self.ended()
            if message["type"] == "gesture" and message["phase"] == "start":
                self._begin(message["gesture"], job, done)

    def ended(self) -> None:
        """The gesture that was held is over."""
        if self._shown is not None:
            self._writer.finish(self._shown)
            self._shown = None

    def jog(self, jog: Jog, decision: Decision) -> None:
        """A ``jog`` message was decided on."""
        now = time.monotonic()
        moves = decision.command is not None and decision.command.action is not None
        if not moves:
            if self._keys is not None and now - self._held_at > KEYS_S:
                self._let_go()
            return
        self._held_at = now
        if self._keys is None:
            self._presses, self._hold = 0, None
            self._keys = self._writer.record("keys", lasts=True, who=self._session)
            self._snapshots.want(self._keys)
        if jog.hold != self._hold:
            self._hold = jog.hold
            self._presses += 1

    def close(self) -> None:
        """The session is over."""
        self.ended()
        self._let_go()

    def _let_go(self) -> None:
        if self._keys is not None:
            self._writer.finish(self._keys, presses=self._presses)
            self._keys = None

    def _begin(self, gesture: str, job: FrameJob, done: FrameDone) -> None:
        action = job.situation.actions.get(gesture)
        if not (isinstance(action, Stop) or _drives(job.situation)):
            return
        command = done.decision.command
        kind: Kind = "program" if isinstance(action, Sequence) else "gesture"
        self._shown = self._writer.record(
            kind,
            lasts=True,
            template=done.template,
            who=self._session,
            gesture=gesture,
            gallery=job.enrolled.gallery,
            action=_json(action),
            moves=command is not None and command.action is not None,
        )
        self._snapshots.want(self._shown)


def _drives(situation: Situation) -> bool:
    """Whether a gesture could move the robot."""
    armed = situation.state is not None and situation.state.armed
    return armed and situation.lease is not None and not situation.by_keys


def _json(action: Action | None) -> Any:
    if action is None:
        return None
    return ACTION.dump_python(action, mode="json", exclude_none=True)
