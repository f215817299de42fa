"""Driving by keys, within one session: the frames of whoever does move nothing meanwhile."""

import time
from collections.abc import Callable
from typing import Any

from app.gateway.diary.session import SessionDiary
from app.gateway.drive import Situation
from app.gateway.frame_age import Age, FrameAge
from app.gateway.held_keys import HeldKeys
from app.gateway.messages import Jog
from app.gateway.metrics import Metrics
from app.gateway.numbers import tick_ms
from app.gateway.outbox import Outbox
from app.gateway.robot_port import RobotPort

KEYS_S = 0.5
"""So long after its last ``jog`` message a session counts as driving by keys, and its frames move
nothing: twice the life of a command."""


class SessionKeys:
    """Commands what a held key asks for. Used on the event loop.

    Args:
        keys: Decides.
        max_age_ms: Oldest key press that may still move the robot.
        robot: Who is commanded.
        outbox: Where it is said that nothing comes of a key, and why.
        metrics: Counts the commands.
        diary: Notes them.
    """

    def __init__(
        self,
        keys: HeldKeys,
        max_age_ms: int,
        robot: RobotPort,
        outbox: Outbox,
        metrics: Metrics,
        diary: SessionDiary,
    ) -> None:
        self._keys = keys
        self._age = FrameAge(max_age_ms, "key press")
        self._robot = robot
        self._outbox = outbox
        self._metrics = metrics
        self._diary = diary
        self._at = float("-inf")
        self._told: tuple[int, str | None] | None = None

    def drive(self, now: float) -> bool:
        """Whether the session drives by keys at ``now`` (s, monotonic)."""
        return now - self._at < KEYS_S

    def take(self, jog: Jog, situate: Callable[[float, Age], Situation]) -> None:
        """Command what a held key asks for, and say when nothing comes of it, and why.

        Args:
            jog: What is held.
            situate: The situation now (s, monotonic), of a key press of this age.
        """
        now = self._at = time.monotonic()
        age = self._age(jog.tick, jog.at or 0.0, tick_ms())
        decision = self._keys.decide(jog, situate(now, age))
        self._diary.jog(jog, decision)
        if decision.command is not None:
            self._robot.send(decision.command)
            self._metrics.commands.inc()
        told: tuple[int, str | None] = (jog.hold, decision.reason)
        if told != self._told:
            self._told = told
            message: dict[str, Any] = {"type": "jog", "hold": jog.hold, "reason": decision.reason}
            self._outbox.put(message)
