"""Agreement: N of the last M frames, for long enough, make a gesture start; it holds, it ends."""

from collections import deque

from app.config import AgreementSettings
from app.pipeline.types import Cause, GestureEvent

LONGEST_GAP_S = 0.35
"""Frames farther apart than this leave open what was shown between them."""


class Agreement:
    """Start, hold and end, so that a flicker moves nothing.

    A gesture starts when

    - N of the last M frames show it,
    - it has been shown for ``settle_s + doubt_s * strangeness`` without another gesture between,
      the strangeness (0 to 1) being the mean over its frames: what is matched clearly starts soon,
      what is barely accepted must stay longer,
    - that mean is inside the limit: rejection is calibrated for one picture, and a hand on its very
      edge gets a new chance with every frame,
    - the hand has settled (:class:`~app.pipeline.motion.MotionGate`).

    :attr:`pending` says which of these is missing while a gesture is shown that has not started.

    It is held until no frame has shown it for the release time, or until another gesture has N of
    the last M frames; then it ends, at once, because to stop early is safe. Only to start takes
    time.
    """

    def __init__(self, settings: AgreementSettings) -> None:
        self._settings = settings
        self._votes: deque[str | None] = deque(maxlen=settings.window)
        self.reset()

    def reset(self) -> None:
        """Forget everything, without an event."""
        self.gesture: str | None = None
        self.pending: Cause | None = None
        self._shown_at = float("-inf")
        self._last_at = float("-inf")
        self._seq = 0
        self._forget()

    def _forget(self) -> None:
        self._votes.clear()
        self._candidate: str | None = None
        self._since = 0.0
        self._strangeness: list[float] = []

    def __call__(
        self,
        gesture: str | None,
        seq: int,
        now: float,
        *,
        strangeness: float = 0.0,
        settled: bool = True,
    ) -> GestureEvent | None:
        """Count one frame.

        Args:
            gesture: What the frame shows, or None.
            seq: The frame's number.
            now: Seconds, monotonic.
            strangeness: Of the match, 0 (as enrolled) to 1 (barely accepted).
            settled: Whether a gesture may start with this frame.
        """
        if now - self._last_at > LONGEST_GAP_S:
            self._forget()
        self._last_at = now
        self._votes.append(gesture)
        self._seq = seq
        self._follow(gesture, strangeness, now)
        agreed = gesture is not None and self._votes.count(gesture) >= self._settings.votes
        self.pending = None
        if self.gesture is None:
            if gesture is None:
                return None
            self.pending = self._why_not_yet(agreed, settled, now)
            if self.pending is not None:
                return None
            self.gesture = gesture
            self._shown_at = now
            return GestureEvent(gesture, "start", seq)
        if gesture == self.gesture:
            self._shown_at = now
        elif agreed or now - self._shown_at >= self._settings.release_s:
            self.pending = None if gesture is None else "agreeing"
            return self._end()
        return GestureEvent(self.gesture, "hold", seq)

    def tick(self, now: float) -> GestureEvent | None:
        """End a held gesture whose release time is over although no frame came."""
        if self.gesture is not None and now - self._shown_at >= self._settings.release_s:
            self._forget()
            return self._end()
        return None

    def _follow(self, gesture: str | None, strangeness: float, now: float) -> None:
        """Keep account of which gesture may start next, and since when it is shown."""
        if gesture is None:
            # As many empty frames as N of M forgives leave the account as it is.
            if not any(self._votes):
                self._candidate = None
            return
        if gesture != self._candidate:
            self._candidate, self._since, self._strangeness = gesture, now, []
        self._strangeness.append(min(max(strangeness, 0.0), 1.0))

    def _why_not_yet(self, agreed: bool, settled: bool, now: float) -> Cause | None:
        """Why the gesture that is shown does not start with this frame; None when it does."""
        mean = sum(self._strangeness) / len(self._strangeness)
        if not agreed or not self._lasted(mean, now):
            return "agreeing"
        if mean > self._settings.max_strangeness:
            return "doubtful"
        return None if settled else "settling"

    def _lasted(self, mean: float, now: float) -> bool:
        needed = self._settings.settle_s + self._settings.doubt_s * mean
        # Half a millisecond for times that were rounded on their way.
        return now - self._since >= needed - 0.0005

    def _end(self) -> GestureEvent:
        assert self.gesture is not None
        event = GestureEvent(self.gesture, "end", self._seq)
        self.gesture = None
        return event
