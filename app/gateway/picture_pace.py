"""How many pictures of the robot one viewer gets, and how large: what its acknowledgements allow.

A viewer that acknowledges what it has shown is sent no more than the link carries: only a few
pictures are under way at once, and rate, size and quality go down while acknowledgements come late
and up again, a step at a time, when they are quick. What is late is judged against the quickest
acknowledgement of the last minute, because a long way is no reason for small pictures; a queue is
(the same reasoning as in BBR, Cardwell et al. 2016).
"""

import asyncio
import json
from typing import NamedTuple

LATE_S = 0.1
"""An acknowledgement that comes this much later than the quickest one waited in a queue."""
QUICK_S = 0.05
LATE_IN_A_ROW = 2
STEADY_S = 3.0
"""So long acknowledgements must be quick before the next larger level is tried."""
MOSTLY = 0.9
"""Part of them: a busy computer holds one up now and then, at any level."""
TRIAL_S = 1.0
"""A level that was just gone up to is left at the first late one: a link that cannot carry it shows
so within a second, and every picture is late until then."""
LONGEST_STEADY_S = 60.0
"""A level that proves too much is tried again after twice as long, and at last after this."""
WINDOW_S = 30.0
"""The quickest acknowledgement is that of this window and the one before it."""
MAX_ACK = 64
"""Characters of an acknowledgement."""
SLOWEST_HZ, FASTEST_HZ = 1.0, 30.0
"""What a viewer can ask for; cameras take no more."""


class Level(NamedTuple):
    """How pictures are sent."""

    rate_hz: float
    """Pictures a second, at most."""
    under_way: int
    """Sent and not acknowledged, at most."""
    scale: float = 1.0
    """Part of the camera's width and height."""
    quality: int | None = None
    """JPEG quality; None: as the camera made it."""


LEVELS = (
    Level(30.0, 4),
    Level(20.0, 3),
    Level(15.0, 2),
    Level(10.0, 2),
    Level(10.0, 2, 0.75, 70),
    Level(10.0, 2, 0.5, 60),
    Level(5.0, 1, 0.5, 40),
)
"""Best first. The rate goes down first: it costs no work, and a still picture stays sharp. Steps
are small, because pictures come late from the one that is too much until it is left."""


class Quickest:
    """The shortest of the last times, over two windows, so that a changed way is noticed."""

    def __init__(self) -> None:
        self._began = float("-inf")
        self._now = self._before = float("inf")

    def __call__(self, took: float, now: float) -> float:
        """Add a time, s, and return the shortest, s."""
        if now - self._began > WINDOW_S:
            self._began, self._before, self._now = now, self._now, float("inf")
        self._now = min(self._now, took)
        return min(self._now, self._before)


class PicturePace:
    """The pace of one viewer. Used on the event loop only; times are monotonic seconds."""

    def __init__(self) -> None:
        self._level = 0
        self._under_way: dict[int, float] = {}
        """When each was sent, in the order of sending."""
        self._judged_from = 0.0
        """Pictures sent before this say nothing about the present level."""
        self._quickest = Quickest()
        self._late = 0
        self._late_from = 0.0
        """Pictures sent before this were held up by what was counted."""
        self._answers = self._quick = 0
        self._since: float | None = None
        """When the first of these answers came."""
        self._steady = STEADY_S
        self._raised_at = float("-inf")
        self._trying = False
        """The level was gone up to, not down."""
        self.due = 0.0
        """When the next picture may be sent."""
        self._wanted_hz = FASTEST_HZ
        self._acknowledged = asyncio.Event()

    @property
    def level(self) -> int:
        """Index in :data:`LEVELS`."""
        return self._level

    async def turn(self) -> None:
        """Wait until the viewer may be sent the next picture."""
        loop = asyncio.get_running_loop()
        while len(self._under_way) >= LEVELS[self._level].under_way:
            self._acknowledged.clear()
            await self._acknowledged.wait()
        await asyncio.sleep(max(0.0, self.due - loop.time()))

    def sent(self, sequence: int, now: float) -> None:
        """A picture is on its way."""
        self._under_way.pop(sequence, None)
        self._under_way[sequence] = now
        # Half an interval of grace: the camera's beat and ours do not agree.
        interval = 1 / min(LEVELS[self._level].rate_hz, self._wanted_hz)
        self.due = max(self.due + interval, now + interval / 2)

    def acknowledge(self, shown: "Shown", now: float) -> None:
        """The viewer has shown this picture, and shows none that was sent before it any more."""
        sequence = shown.sequence
        sent = self._under_way.get(sequence)
        if sent is None:
            return
        self._wanted_hz = shown.wanted_hz
        # By the order of sending: a camera that starts anew counts from the beginning.
        for earlier in tuple(self._under_way):
            del self._under_way[earlier]
            if earlier == sequence:
                break
        self._acknowledged.set()
        took = now - sent
        waited = took - self._quickest(took, now)
        if sent >= self._judged_from:
            self._judge(sent, waited, now)

    def _judge(self, sent: float, waited: float, now: float) -> None:
        if self._since is None:
            self._since = now
        self._answers += 1
        self._quick += waited <= QUICK_S
        if waited <= LATE_S:
            self._late = 0
        elif sent >= self._late_from:
            # What was under way then was held up by the same; a queue is there afterwards, too.
            self._late += 1
            self._late_from = now
        tried_for = now - self._raised_at
        most = 1 if self._trying and tried_for < TRIAL_S else LATE_IN_A_ROW
        if self._late >= most and self._level + 1 < len(LEVELS):
            if tried_for < self._steady:
                self._steady = min(2 * self._steady, LONGEST_STEADY_S)
            self._trying = False
            self._go(self._level + 1, now)
        elif now - self._since >= self._steady:
            if self._quick < MOSTLY * self._answers:
                self._begin()
                return
            if now - self._raised_at > LONGEST_STEADY_S:
                self._steady = STEADY_S
            if self._level:
                self._raised_at, self._trying = now, True
                self._go(self._level - 1, now)
            else:
                self._begin()

    def _go(self, level: int, now: float) -> None:
        self._level = level
        self._judged_from = now
        self._begin()

    def _begin(self) -> None:
        self._late = 0
        self._late_from = 0.0
        self._answers = self._quick = 0
        self._since = None


class Shown(NamedTuple):
    """What a viewer says of a picture."""

    sequence: int
    """The picture's."""
    wanted_hz: float = FASTEST_HZ
    """Pictures a second that it wants at most."""


def acknowledged(text: str | None) -> Shown | None:
    """What a viewer's message acknowledges; None: it is no acknowledgement."""
    if text is None or len(text) > MAX_ACK:
        return None
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(message, dict) or message.get("type") != "shown":
        return None
    sequence, wanted = message.get("seq"), message.get("most", FASTEST_HZ)
    if type(sequence) is not int or type(wanted) not in (int, float):
        return None
    # Written so that what is no number at all becomes the fastest.
    return Shown(sequence, max(SLOWEST_HZ, min(FASTEST_HZ, wanted)))
