"""How old a frame, or a sign of a held key, is when it arrives, without comparing clocks."""

from typing import NamedTuple

from app.link.messages import COMMAND_TTL_MS

SPARE_MS = 30
"""Of the 500 ms that are promised from sending to standstill a command's life and the ramp leave
46; so much of them is for the way, and the rest for a loop that is late."""
WAY_MS = 50
"""At most so much is taken off for the shortest way up. Over a longer one the two frames that a
page has under way come so far apart that nothing would be left until the next."""
JUMP_MS = 250
"""A capture clock that disagrees with the bound by more has stood still, or was set."""
DRIFT = 200e-6
"""By so much two clocks may run apart: what is known of their difference fades at this rate."""


class Age(NamedTuple):
    """What is known of how long something was under way when it arrived."""

    known_ms: int = 0
    """As near as can be known."""
    life_ms: int = COMMAND_TTL_MS
    """What is left of the life of what it commands."""
    stale: str | None = None
    """Why it is too old to move anything, in plain words."""


class FrameAge:
    """Judges the frames of one session; too old ones move nothing.

    A frame carries the newest server tick that its sender had seen. That bounds the frame's age by
    the server's own clock, ``now - tick``, from above: the way down, and the wait for the next
    frame, are in it. And it carries when it was captured, on its sender's clock. With
    ``o = now - captured``, it came ``o - min(o)`` later than the promptest one: its age but for
    the shortest way up. That is taken for half of the smallest ``now - tick``, which is a round
    trip. So::

        age = o - min(o) + min(now - tick) / 2,    at most now - tick

    What is over :data:`SPARE_MS` of it is taken off the life of the command, where the second part
    counts for :data:`WAY_MS` at most.

    The minimum of ``o`` rises with :data:`DRIFT`, because clocks do not run alike, and begins anew
    where it is over the bound by :data:`JUMP_MS`: a clock that stood still makes nobody old.

    A sender that gives no tick (0) is judged by its capture times alone, which say nothing of a
    delay that was always there. One whose capture times do not rise is judged by ticks alone: its
    age is what is over half of the smallest ``now - tick``, the wait of a tick to be used included.

    Args:
        limit_ms: Oldest tick that may still move the robot.
        what: What is judged, for the reasons given.
    """

    def __init__(self, limit_ms: int, what: str = "frame") -> None:
        self._limit = limit_ms
        self._what = what
        self._captured = -1.0
        self._least_offset = float("inf")
        self._least_at = 0
        self._least_trip = float("inf")

    def __call__(self, seen_tick: int, captured_ms: float, now_ms: int) -> Age:
        """How old the frame is.

        Args:
            seen_tick: Newest server tick the sender had seen, ms; 0: none.
            captured_ms: On the sender's own monotonic clock.
            now_ms: The server's tick.
        """
        if seen_tick > now_ms:
            return Age(stale=f"the {self._what} names a server tick that has not come yet")
        advanced = captured_ms > self._captured
        self._captured = max(self._captured, captured_ms)
        if not seen_tick and not advanced:
            return Age(
                stale=f"the {self._what}'s age is not known, so it cannot move the robot: give "
                "the newest server tick, or at least a capture time that rises"
            )
        bound = float(now_ms - seen_tick) if seen_tick else float("inf")
        self._least_trip = min(self._least_trip, bound)
        way = self._least_trip / 2 if seen_tick else 0.0
        late = bound - self._least_trip
        if advanced:
            late = self._lateness(now_ms - captured_ms, bound, way, now_ms)
            late = min(late, bound - way)
        known = round(late + way)
        life = COMMAND_TTL_MS - max(0, round(late + min(way, WAY_MS)) - SPARE_MS)
        if seen_tick and bound > self._limit:
            return self._stale(
                known, f"its sender had seen nothing newer than {round(bound)} ms ago", self._limit
            )
        if life <= 0:
            how = f"it came {known} ms later than others did"
            if seen_tick:
                how = f"it was under way for {known} ms"
            return self._stale(known, how, known + life)
        return Age(known, life)

    def _lateness(self, offset: float, bound: float, way: float, now_ms: int) -> float:
        """By how much an offset is over the least, ms; takes it in."""
        self._least_offset += DRIFT * (now_ms - self._least_at)
        self._least_at = now_ms
        if offset - self._least_offset + way > bound + JUMP_MS:
            self._least_offset = offset - bound + way
        self._least_offset = min(self._least_offset, offset)
        return offset - self._least_offset

    def _stale(self, known: int, how: str, limit_ms: int) -> Age:
        return Age(
            known,
            0,
            f"the {self._what} is too old to move the robot: {how}, at most {limit_ms} ms are "
            "allowed",
        )
