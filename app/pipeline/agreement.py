"""Agreement: N of the last M frames make a gesture start; it holds, and it ends."""

from collections import deque

from app.config import AgreementSettings
from app.pipeline.types import GestureEvent


class Agreement:
    """Start, hold and end, so that a flicker moves nothing.

    A gesture starts when N of the last M frames show it. It is held until no frame has shown it
    for the release time, or until another gesture has N of the last M frames; then it ends, and
    the other starts with the next frame.
    """

    def __init__(self, settings: AgreementSettings) -> None:
        self._settings = settings
        self._votes: deque[str | None] = deque(maxlen=settings.window)
        self.reset()

    def reset(self) -> None:
        """Forget everything, without an event."""
        self._votes.clear()
        self.gesture: str | None = None
        self._shown_at = float("-inf")
        self._seq = 0

    def __call__(self, gesture: str | None, seq: int, now: float) -> GestureEvent | None:
        """Count one frame.

        Args:
            gesture: What the frame shows, or None.
            seq: The frame's number.
            now: Seconds, monotonic.
        """
        self._votes.append(gesture)
        self._seq = seq
        agreed = gesture is not None and self._votes.count(gesture) >= self._settings.votes
        if self.gesture is None:
            if not agreed or gesture is None:
                return None
            self.gesture = gesture
            self._shown_at = now
            return GestureEvent(gesture, "start", seq)
        if gesture == self.gesture:
            self._shown_at = now
        elif agreed or now - self._shown_at >= self._settings.release_s:
            return self._end()
        return GestureEvent(self.gesture, "hold", seq)

    def tick(self, now: float) -> GestureEvent | None:
        """End a held gesture whose release time is over although no frame came."""
        if self.gesture is not None and now - self._shown_at >= self._settings.release_s:
            self._votes.clear()
            return self._end()
        return None

    def _end(self) -> GestureEvent:
        assert self.gesture is not None
        event = GestureEvent(self.gesture, "end", self._seq)
        self.gesture = None
        return event
