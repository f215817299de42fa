"""From held keys to what the robot is asked, for those who do not drive by gestures.

The way is that of a frame from :mod:`app.gateway.drive` on: a command for every message, also when
nothing is held, so that the node's watchdog sees that the client is alive; a new number for every
press; and a press that began before the robot was ready moves nothing.
"""

from app.gateway.drive import Decision, Situation, obstacle
from app.gateway.messages import Jog
from app.gateway.numbers import Counter
from app.link.messages import Command, Doubt

TOO_EARLY = "this key was pressed before the robot was ready: let go and press it again"
SHOWN = "a held key"
"""What the node is told in place of a gesture's name, for its log."""
LOWEST_SCALE = 0.05
"""Of the ordinary speed, as for the ``speed`` message."""


class HeldKeys:
    """Turns one session's ``jog`` messages into commands.

    Args:
        holds: Numbers of presses and showings; shared by all sessions, so that none comes twice.
        sequence: Numbers of commands; shared by all that commands for this session.
    """

    def __init__(self, holds: Counter, sequence: Counter) -> None:
        self._holds = holds
        self._sequence = sequence
        self._pressed: int | None = None
        """The client's number of the press that is held."""
        self._hold = 0
        self._barred: str | None = None
        """Why this press moves nothing."""

    def decide(self, jog: Jog, situation: Situation) -> Decision:
        """Decide on one message.

        Args:
            jog: What is held.
            situation: As of its arrival; ``stale`` says of the message what it says of a frame.
        """
        reason = obstacle(situation) or situation.unseen
        if jog.action is None:
            self._pressed = None
        elif jog.hold != self._pressed:
            self._pressed, self._hold = jog.hold, self._holds.next()
            self._barred = None if reason is None else TOO_EARLY
        elif reason is not None and not situation.stale:
            self._barred = TOO_EARLY
        reason = situation.stale if jog.action is None else reason or self._barred
        if situation.stale or situation.lease is None or situation.state is None:
            return Decision(reason=reason)
        unseen = jog.action is not None and situation.unseen is not None
        doubt: Doubt | None = "stale_picture" if unseen else None
        command = Command(
            epoch=situation.lease.epoch,
            sequence=self._sequence.next(),
            tick=situation.state.tick,
            ttl_ms=situation.life_ms,
            hold=self._hold,
            gesture=None if jog.action is None else SHOWN,
            action=jog.action if reason is None else None,
            reason=None if reason is None else reason[:300],
            doubt=doubt,
            scale=max(LOWEST_SCALE, situation.scale * jog.scale),
        )
        return Decision(command=command, reason=reason, doubt=doubt)
