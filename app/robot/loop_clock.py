"""Keeps a loop at its rate, and knows how well that went."""

import gc
import logging
import os
import time
from collections import deque

from app import logs
from app.link.messages import LoopState

log = logging.getLogger(__name__)

_GIVE_UP_CYCLES = 12
"""A loop this far behind (50 ms at 240 Hz) lets the lost cycles go; less is caught up."""
LATE_S = 0.005
"""A cycle that begins later than this after its time counts as late."""
_SLACK_FOR_GC_S = 0.002
_FULL_GC_CYCLES = 240 * 60
"""What keep_time() froze is not looked at again, so that this takes about a millisecond."""
_FIFO_PRIORITY = 10


class LoopClock:
    """Absolute deadlines on the monotonic clock.

    Args:
        dt: s; one cycle.
    """

    def __init__(self, dt: float) -> None:
        self._dt = dt
        self._deadline = time.monotonic()
        self._lateness: deque[tuple[float, float]] = deque()
        self._cycles = 0
        self._let_go = 0
        self._late = 0

    def wait(self) -> float:
        """Sleep until the next cycle is due.

        Returns:
            The time, s, on the monotonic clock.
        """
        self._deadline += self._dt
        self._cycles += 1
        slack = self._deadline - time.monotonic()
        if slack > _SLACK_FOR_GC_S and self._cycles % 240 == 0:
            # Rubbish is taken out where nobody waits; see keep_time().
            gc.collect(2 if self._cycles % _FULL_GC_CYCLES == 0 else 1)
            slack = self._deadline - time.monotonic()
        if slack > 0:
            time.sleep(slack)
        now = time.monotonic()
        late = now - self._deadline
        self._lateness.append((now, late))
        while self._lateness[0][0] < now - 1.0:
            self._lateness.popleft()
        self._late += late > LATE_S
        if late > _GIVE_UP_CYCLES * self._dt:
            log.warning("the control loop was %.0f ms late", late * 1000)
            lost = int(late / self._dt)
            self._let_go += lost
            self._late += lost
            self._deadline = now
        return now

    def state(self) -> LoopState:
        """Rate and worst lateness of the last second, and what was counted since the start."""
        if len(self._lateness) < 2:
            return LoopState(rate_hz=0.0, late_max_ms=0.0)
        span = self._lateness[-1][0] - self._lateness[0][0]
        worst = max(late for _, late in self._lateness)
        return LoopState(
            rate_hz=round((len(self._lateness) - 1) / max(span, 1e-6), 1),
            late_max_ms=round(max(0.0, worst) * 1000, 2),
            cycles=self._cycles + self._let_go,
            late=self._late,
            log_lines_dropped=logs.dropped(),
        )


def keep_time() -> None:
    """Make the calling thread as punctual as the system permits.

    Garbage collection happens only in the slack of :meth:`LoopClock.wait`. Real-time priority where
    that is permitted (children do not inherit it), else a better nice value, else none.
    """
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(_FIFO_PRIORITY))
        log.info("the control loop runs at real-time priority %d", _FIFO_PRIORITY)
    except (OSError, AttributeError):
        try:
            os.nice(-10)
            log.info("the control loop runs at nice -10")
        except OSError:
            log.info("the control loop runs at ordinary priority; more is not permitted")
