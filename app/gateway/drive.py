"""From what the hand shows to what the robot is asked: one decision a processed frame.

:mod:`app.gateway.held_keys` does the same for keys.
"""

from dataclasses import dataclass

from app.gateway.numbers import Counter
from app.link.actions import Action, Sequence, Stop, TurnJoint
from app.link.messages import COMMAND_TTL_MS, Command, Doubt, State, StopRequest
from app.pipeline.types import Cause

REST_S = 0.5
"""Frames must show no gesture for so long before the same gesture surely is a new showing."""
LONGEST_GAP_S = 0.25
"""Frames farther apart than this leave open what was shown between them."""
DOUBTS: dict[Cause, Doubt] = {
    "no_hand": "no_hand",
    "unknown_hand": "unknown_hand",
    "two_hands": "two_hands",
    "low_margin": "low_margin",
}
"""What the node is told about a frame that shows no gesture. A hand that moves is no doubt: it may
be on its way to the next gesture."""
FROZEN = "the webcam picture is frozen"
BY_KEYS = "you drive by keys: gestures move nothing meanwhile"
_AGAIN = "show no gesture for half a second, then a new one"
_TOO_EARLY = "this gesture began before the robot was ready: let go and show it again"
_REPEATED = f"this was done already: {_AGAIN}"
_CHANGED = f"the gestures changed while a hand was up: {_AGAIN}"


@dataclass(frozen=True)
class Lease:
    """The right to drive, as the node granted it."""

    epoch: int


@dataclass(frozen=True)
class Situation:
    """What the decision rests on, all as of the moment the frame arrived."""

    actions: dict[str, Action]
    lease: Lease | None
    state: State | None
    """Newest state of the robot; None when it is not connected."""
    stale: str | None = None
    """Why the frame is too old to move anything, in plain words."""
    life_ms: int = COMMAND_TTL_MS
    """How long what is commanded now counts, from the newest state on: what the frame was under
    way for is taken off."""
    unseen: str | None = None
    """Why the operator cannot see the robot, in plain words."""
    scale: float = 1.0
    """Part of the ordinary speed that is wanted."""
    at: float = 0.0
    """When the frame arrived, s, monotonic."""
    by_keys: bool = False
    """The session drives by keys: its gestures move nothing, but may stop."""


@dataclass(frozen=True)
class Decision:
    """What to send to the robot, and why nothing moves if a gesture was shown."""

    command: Command | None = None
    stop: StopRequest | None = None
    reason: str | None = None
    doubt: Doubt | None = None
    """Why the arm is to hold still, if anything moves."""


class Driver:
    """Turns one session's recognised gestures into commands.

    Every showing of a gesture has a number (``hold``). One that began before the robot was armed
    for this session, or during which it was not, moves nothing any more: neither arming nor the
    end of a fault starts a motion by itself.

    A gesture may seem to end although the hand stays up: frames are lost, or show it badly. So one
    that comes back before frames have shown none for :data:`REST_S` is the same showing, where that
    matters: when it was not to move anything, and when its action adds up. Likewise a hand that was
    up when the gestures changed begins nothing.

    Args:
        session: Name of the session, for the log of stops.
        holds: Numbers of showings; shared by all sessions, so that none comes twice.
        sequence: Numbers of commands; shared by all that commands for this session.
    """

    def __init__(self, session: str, holds: Counter, sequence: Counter) -> None:
        self._session = session
        self._holds = holds
        self._sequence = sequence
        self._gesture: str | None = None
        self._last: str | None = None
        self._hold = 0
        self._barred: str | None = None
        """Why this showing moves nothing."""
        self._changed = False
        self._last_frame = float("-inf")
        self._none_since: float | None = None

    def end(self) -> None:
        """The gesture is over: frames stopped coming."""
        self._gesture = None

    def gestures_changed(self, *, all_of_them: bool = False) -> None:
        """A hand that is up may now show another gesture than before.

        Args:
            all_of_them: These are another person's: what is held now ends, too.
        """
        self._changed = True
        self._none_since = None
        if all_of_them and self._gesture is not None:
            self._barred = _CHANGED

    def decide(
        self,
        gesture: str | None,
        frame: int,
        situation: Situation,
        *,
        cause: Cause | None = None,
        frozen: bool = False,
    ) -> Decision:
        """Decide on one processed frame.

        Args:
            gesture: Name of the gesture that is held, after N-of-M agreement.
            frame: The frame's sequence number.
            situation: As of the frame's arrival.
            cause: Why the frame itself shows no gesture. Counts only when none is held any more.
            frozen: The webcam has been sending the same picture. A gesture in it counts no more.
        """
        blind = FROZEN if frozen else situation.unseen
        begins = gesture is not None and gesture != self._gesture
        self._gesture = gesture
        action = None if gesture is None else situation.actions.get(gesture)
        rested = self._rested(gesture, situation.at)
        self._changed = self._changed and not rested
        reason = obstacle(situation) or blind
        if begins:
            self._begin(gesture, action, rested=rested, ready=reason is None)
        elif reason is not None and not situation.stale:
            self._barred = _TOO_EARLY
        stop = None
        if gesture is not None and isinstance(action, Stop):
            # Anybody's stop counts, with or without control, and however late it comes.
            if begins:
                stop = StopRequest(
                    source=self._session, reason=f"the gesture {gesture!r} was shown"
                )
            reason = None
            action = None
        elif gesture is not None and action is None:
            reason = f"the gesture {gesture!r} is no longer enrolled"
        elif gesture is not None and reason is None:
            reason = self._barred
        if gesture is None or reason is not None:
            action = None
        doubt: Doubt | None = None
        if gesture is None:
            doubt = None if cause is None else DOUBTS.get(cause)
        elif action is None and blind is not None:
            doubt = "frozen" if frozen else "stale_picture"
        if (
            situation.stale
            or situation.lease is None
            or situation.state is None
            or situation.by_keys
        ):
            return Decision(stop=stop, reason=reason if gesture else situation.stale)
        command = Command(
            epoch=situation.lease.epoch,
            sequence=self._sequence.next(),
            tick=situation.state.tick,
            ttl_ms=situation.life_ms,
            frame=frame,
            hold=self._hold,
            gesture=gesture,
            action=action,
            reason=reason[:300] if gesture and reason else None,
            doubt=doubt,
            scale=situation.scale,
        )
        return Decision(command=command, stop=stop, reason=reason if gesture else None, doubt=doubt)

    def _begin(
        self, gesture: str | None, action: Action | None, *, rested: bool, ready: bool
    ) -> None:
        """A gesture is seen that was not held a frame ago."""
        again = gesture == self._last and not rested
        self._last = gesture
        if again and (self._barred or isinstance(action, TurnJoint | Sequence)):
            self._barred = self._barred or _REPEATED
            return
        self._hold = self._holds.next()
        if not ready:
            self._barred = _TOO_EARLY
        else:
            self._barred = _CHANGED if self._changed else None

    def _rested(self, gesture: str | None, now: float) -> bool:
        """Whether the frames up to now have shown no gesture for long enough."""
        if now - self._last_frame > LONGEST_GAP_S:
            self._none_since = None
        self._last_frame = now
        since = self._none_since
        if gesture is not None:
            self._none_since = None
        elif since is None:
            self._none_since = now
        return since is not None and now - since >= REST_S


def obstacle(situation: Situation) -> str | None:
    """Why nothing that the session asks for could move the robot now, in plain words, if so."""
    state = situation.state
    if situation.stale:
        return situation.stale
    if situation.by_keys:
        return BY_KEYS
    if state is None:
        return "the robot is not connected"
    if situation.lease is None:
        if state.controller is None:
            return "nobody has control: take control first"
        return f"you do not have control: {state.controller} drives"
    match state.mode:
        case "faulted":
            return f"the robot has a fault: {state.fault or 'see its log'}"
        case "stopped":
            return "the robot is stopped: reset it, then arm it"
        case "disarmed":
            return "the robot is not armed"
        case "holding":
            reason = state.reason or "it was stopped gently"
            how = "" if "show no gesture" in reason else f": {_AGAIN}"
            return f"the robot holds still: {reason}{how}"
    return None if state.armed else "the robot is not armed"
