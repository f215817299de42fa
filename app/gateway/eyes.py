"""Whether the two pictures that driving rests on are alive: the operator's, and the robot's."""

from collections.abc import Mapping

LIVE_FRAMES = 10
"""Frames in a row, each with other pixels than the one before: only a camera sends that."""
LONGEST_GAP_S = 0.25
"""Frames farther apart than this leave open what the camera saw between them."""


class FrozenCamera:
    """Notices a webcam that sends the same picture over and over.

    A sensor never gives the same pixels twice. So a session that has once sent
    :data:`LIVE_FRAMES` different pictures in a row has a camera, and one that then sends the very
    same pixels for a while has a camera that froze (or a driver, or a browser that did). A program
    that shows one image file again and again never had a camera; there is nothing to freeze.

    Args:
        limit_ms: So long the pixels may stay the same; 0: for ever.
    """

    def __init__(self, limit_ms: int) -> None:
        self._limit_s = limit_ms / 1000
        self._digest: int | None = None
        self._since = 0.0
        self._last = float("-inf")
        self._changes = 0

    @property
    def live(self) -> bool:
        """Whether this session has shown that it has a camera."""
        return self._changes >= LIVE_FRAMES

    def __call__(self, digest: int, now: float) -> bool:
        """Whether the picture is frozen.

        Args:
            digest: Checksum of the frame's pixels.
            now: When it arrived, s, monotonic.
        """
        if digest != self._digest:
            in_time = now - self._last <= LONGEST_GAP_S
            if not self.live:
                self._changes = self._changes + 1 if in_time else 0
            self._digest, self._since = digest, now
        elif not self.live:
            self._changes = 0
        self._last = now
        return bool(self._limit_s) and self.live and now - self._since >= self._limit_s


class PictureAge:
    """How old the newest picture of the robot is that the operator has seen.

    The page says which it has shown (``picture`` messages); a client that never does is not judged.

    Args:
        limit_ms: Oldest picture by which one may drive; 0: any.
    """

    def __init__(self, limit_ms: int) -> None:
        self._limit = limit_ms
        self._shown: dict[str, int] = {}

    @property
    def shown(self) -> Mapping[str, int]:
        """Newest tick of the robot that was shown, by camera."""
        return self._shown

    def saw(self, camera: str, tick: int) -> None:
        """A picture of the robot at ``tick`` (ms on its clock) is in front of the operator."""
        self._shown[camera] = tick

    def __call__(self, tick: int) -> str | None:
        """Why the operator cannot see the robot, in plain words; None when that is not so.

        Args:
            tick: Of the robot's newest state, ms.
        """
        if not self._shown or not self._limit:
            return None
        # What names the future is from before the robot's node was started again.
        ages = [tick - shown for shown in self._shown.values() if shown <= tick]
        age = min(ages, default=None)
        if age is not None and age <= self._limit:
            return None
        how = "not a new one" if age is None else f"{age / 1000:.1f} s old"
        return (
            f"the picture of the robot that you see is {how}, at most {self._limit / 1000:g} s are "
            "allowed"
        )
