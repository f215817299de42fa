"""When the arm may move, and how it stops: one state machine.

::

    phase     | arm      disarm    lease   stop S2,   stop S1,  N: no gesture  reset
              |                    gone    watchdog,  stop S0   for 0.5 s
              |                            doubt
    ----------+--------------------------------------------------------------------------
    DISARMED  | *        -         -       -          STOPPED   -              -
    HOLDING   | HOLDING  DISARMED  DISARM  HOLDING    STOPPED   ARMED          -
    ARMED     | ARMED    DISARMED  DISARM  HOLDING    STOPPED   -              -
    STOPPED   | refused  -         -       -          worst     -              DISARMED

    * ARMED if nothing was ever stopped, or N was met since; else HOLDING.

Arming is also refused while the latch could not keep a stop, or does not know of a reset yet.

Only in ARMED does anything move. The three categories of a stop:

- S2: ramp to standstill within 200 ms, hold with power. Resumes by N, then a new gesture.
- S1: ramp, then brakes on and motors off. Latched: resumes by a reset, then arm, then N.
- S0: brakes on and motors off at once. Latched like S1.

Every way back from a stop ends in N. And arming never begins a motion: a gesture that was shown
before it counts no more (see :mod:`app.robot.controller`). Times are seconds on the node's
monotonic clock, and nothing else.
"""

import enum
import logging
from collections import deque

from app.link.messages import LatchState, LeaseReply, StopCategory, StopRequest, Transition
from app.robot.latch import StopLatch

log = logging.getLogger(__name__)

NO_GESTURE_S = 0.5
"""N: commands must show no gesture for so long."""
KEPT_TRANSITIONS = 5
"""The newest steps, which every state tells again, so that one that is lost is no loss."""


class Phase(enum.Enum):
    """What the arm may do."""

    DISARMED = "disarmed"
    HOLDING = "holding"
    ARMED = "armed"
    STOPPED = "stopped"


_WORST: dict[StopCategory | None, int] = {None: 0, "S2": 2, "S1": 3, "S0": 4}


class Safety:
    """Holds the phase, the category of stop in force and the reason for both.

    Args:
        latch: Where a latched stop is kept; one that is there from before stays in force.
        tick: ms on the node's monotonic clock.
    """

    def __init__(self, latch: StopLatch, tick: int = 0) -> None:
        self._latch = latch
        self.tick = tick
        """ms; its owner keeps it up to date. Only for telling when a transition was."""
        self.transitions: deque[Transition] = deque(maxlen=KEPT_TRANSITIONS)
        """The newest steps, oldest first."""
        self._steps = 0
        self.phase = Phase.DISARMED
        self.category: StopCategory | None = None
        """The stop in force."""
        self.reason: str | None = "not armed yet"
        self.stops = 0
        """Stop requests received."""
        self.resets = 0
        """Latched stops that were left."""
        self._no_gesture_since: float | None = None
        self._owes_n = False
        """There was a stop, and N has not been met since."""
        if (before := latch.load()) is not None:
            category: StopCategory = "S0" if before.category == "S0" else "S1"
            self._go(Phase.STOPPED, category, f"{before.reason} (from before the node started)")

    @property
    def armed(self) -> bool:
        """Somebody armed the robot, and nothing has disarmed it since."""
        return self.phase in (Phase.ARMED, Phase.HOLDING)

    @property
    def may_move(self) -> bool:
        """Motion is allowed."""
        return self.phase is Phase.ARMED

    @property
    def latch(self) -> LatchState:
        """What the disk knows of the latched stop."""
        return self._latch.state

    def request(self, stop: StopRequest) -> None:
        """Somebody asks for a stop."""
        self.stops += 1
        self.stop(stop)

    def stop(self, stop: StopRequest) -> None:
        """Stop now. The worst category in force wins; S1 and S0 latch, armed or not."""
        why = f"{stop.reason} ({stop.source})"
        if stop.category == "S2":
            self.hold(why)
            return
        if _WORST[stop.category] <= _WORST[self.category]:
            log.info("stop %s changes nothing, %s is in force: %s", stop.category, self.phase, why)
            return
        self._go(Phase.STOPPED, stop.category, why)
        self._latch.set(stop)  # waits for nothing: the ramp begins in this very cycle

    def hold(self, reason: str) -> None:
        """S2: stand until N. Changes nothing where the arm may not move anyway."""
        self._no_gesture_since = None
        if self.armed:
            self._go(Phase.HOLDING, "S2", reason)

    def arm(self) -> LeaseReply:
        """A: the operator arms. Whether the operator may was checked before."""
        if self.phase is Phase.ARMED:
            return LeaseReply(granted=True, reason="armed already")
        if self.phase is Phase.STOPPED:
            return LeaseReply(
                granted=False, code="latched", reason=f"stopped: {self.reason}; reset it first"
            )
        if (latch := self._latch.state).reason is not None:
            # What moves must be able to be stopped for good; and a reset that the disk does not
            # know yet is not over.
            return LeaseReply(granted=False, code="latch_not_kept", reason=latch.reason)
        if self._owes_n:
            self._no_gesture_since = None
            why = "armed: show no gesture for half a second, then a new gesture"
            self._go(Phase.HOLDING, "S2", why)
        else:
            self._go(Phase.ARMED, None, None)
        return LeaseReply(granted=True)

    def disarm(self, reason: str) -> None:
        """Nothing moves until somebody arms again."""
        if self.phase is not Phase.STOPPED:
            self._go(Phase.DISARMED, None, reason)

    def lease_gone(self, reason: str) -> None:
        """S2, and whoever drives next must arm again."""
        if self.armed:
            self._go(Phase.DISARMED, "S2", reason)

    def reset(self, *, at_rest: bool) -> LeaseReply:
        """Leave the latched stop. Moves nothing, and leaves the robot disarmed.

        Until the disk knows, :attr:`latch` says so, and nobody can arm.
        """
        if self.phase is not Phase.STOPPED:
            return LeaseReply(granted=True, reason="nothing to reset")
        if not at_rest:
            return LeaseReply(granted=False, code="moving", reason="the arm has not come to rest")
        self._latch.clear()
        self.resets += 1
        self._go(Phase.DISARMED, None, "reset; not armed yet")
        return LeaseReply(granted=True)

    def saw(self, now: float, *, gesture: bool) -> None:
        """A valid command arrived, with or without a gesture: N."""
        if gesture:
            self._no_gesture_since = None
            return
        if self._no_gesture_since is None:
            self._no_gesture_since = now
        if self.phase is Phase.HOLDING and now - self._no_gesture_since >= NO_GESTURE_S:
            self._owes_n = False
            self._go(Phase.ARMED, None, None)

    def silence(self) -> None:
        """No valid command for longer than one lives: N begins anew."""
        self._no_gesture_since = None

    def _go(self, phase: Phase, category: StopCategory | None, reason: str | None) -> None:
        before = (self.phase, self.category, self.reason)
        self.phase, self.category, self.reason = phase, category, reason
        self._owes_n |= category is not None
        if before == (phase, category, reason):
            return
        self._steps += 1
        # Values of our own need no checking; this runs in the control loop.
        self.transitions.append(
            Transition.model_construct(
                number=self._steps,
                tick=self.tick,
                before=before[0].value,
                after=phase.value,
                stop=category,
                reason=reason,
            )
        )
        log.info(
            "step %d: %s %s -> %s %s: %s",
            self._steps,
            before[0].value,
            before[1] or "",
            phase.value,
            category or "",
            reason or "ready",
        )
