"""How old a frame, or a sign of a held key, is when it arrives, without comparing clocks."""


class FrameAge:
    """Judges the frames of one session; too old ones move nothing.

    A frame carries the newest server tick that its sender had seen, which bounds its age by the
    server's own clock: ``now - tick``. A sender that never reads the server's messages (tick 0) is
    judged by its own capture clock: with ``o = now - captured``, a frame is late by ``o - min(o)``
    over the session. That sees a burst after a stall, though not a delay that was always there.

    Args:
        limit_ms: Oldest age that may still move the robot.
        what: What is judged, for the reasons given.
    """

    def __init__(self, limit_ms: int, what: str = "frame") -> None:
        self._limit = limit_ms
        self._what = what
        self._captured = -1.0
        self._least_offset = float("inf")

    def __call__(self, seen_tick: int, captured_ms: float, now_ms: int) -> str | None:
        """Why the frame is too old, in plain words, or None.

        Args:
            seen_tick: Newest server tick the sender had seen, ms; 0: none.
            captured_ms: On the sender's own monotonic clock.
            now_ms: The server's tick.
        """
        advanced = captured_ms > self._captured
        self._captured = max(self._captured, captured_ms)
        self._least_offset = min(self._least_offset, now_ms - captured_ms)
        if seen_tick > now_ms:
            return f"the {self._what} names a server tick that has not come yet"
        if seen_tick:
            age = now_ms - seen_tick
            how = f"its sender had seen nothing newer than {age} ms ago"
        elif advanced:
            age = round(now_ms - captured_ms - self._least_offset)
            how = f"it came {age} ms later than others did"
        else:
            return (
                f"the {self._what}'s age is not known, so it cannot move the robot: give the "
                "newest server tick, or at least a capture time that rises"
            )
        if age <= self._limit:
            return None
        return (
            f"the {self._what} is too old to move the robot: {how}, at most {self._limit} ms are "
            "allowed"
        )
