"""The second place that remembers a latched stop: a robot that was stopped comes back stopped."""

import threading
import time
from collections.abc import Callable
from pathlib import Path

from app.link.messages import LatchState, State, StopRequest
from app.robot.latch import StopLatch

AGAIN_S = 0.1
"""A stop that the robot does not show is sent again this often."""


class StopMemory:
    """Compares each state of a robot with what it said before. Safe to use from any thread.

    A robot that said *stopped*, or was asked to stop, owes that until it says so or a reset was
    granted. Granted it is when the robot answers so to us, or when it counts one more reset than
    when it was last seen stopped; a node that has lost its latch counts from 0. Kept in memory, and
    by a thread in a file of its own, so that it outlives this process too.

    Args:
        path: The file; not that of the node.
        clock: Seconds that only rise.

    Raises:
        CannotStart: the file's folder cannot be made.
    """

    def __init__(self, path: Path, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._latch = StopLatch(path)
        self._lock = threading.Lock()
        self._stop = self._latch.load()
        """What is remembered, whether the robot says so or not."""
        self._resets: int | None = 0
        """Resets the robot had counted when it was last seen stopped; None: since it was asked to
        stop it has not been."""
        self._owed = self._stop is not None
        self._sent_at = float("-inf")

    @property
    def owed(self) -> StopRequest | None:
        """The stop that the robot should show and does not, as far as is known."""
        with self._lock:
            return self._stop if self._owed else None

    @property
    def remembered(self) -> StopRequest | None:
        """The stop that is in force, or should be."""
        with self._lock:
            return self._stop

    @property
    def kept(self) -> LatchState:
        """Whether this, too, is on the disk."""
        return self._latch.state

    def asked(self, stop: StopRequest) -> None:
        """Somebody asks the robot to stop, and it was sent."""
        with self._lock:
            self._sent_at = self._clock()
            self._owed, self._resets = True, None
            if self._stop is None:
                self._remember(stop)

    def saw(self, state: State) -> StopRequest | None:
        """Take a state in; returns the stop to send again now, if any."""
        with self._lock:
            if state.mode == "stopped" or state.stop in ("S0", "S1"):
                self._owed, self._resets = False, state.resets
                if self._stop is None:
                    reason = (state.reason or "it was stopped")[:300]
                    category = state.stop or "S1"
                    self._remember(StopRequest(category=category, source="gateway", reason=reason))
                return None
            if self._stop is None:
                return None
            if self._resets is not None and state.resets > self._resets:
                self._forget()
                return None
            self._owed = True
            now = self._clock()
            if now - self._sent_at < AGAIN_S:
                return None
            self._sent_at = now
            return self._stop

    def was_reset(self) -> None:
        """The robot has granted a reset."""
        with self._lock:
            self._forget()

    def wait(self, timeout_s: float) -> bool:
        """Wait until the disk knows what is remembered."""
        return self._latch.wait(timeout_s)

    def close(self) -> None:
        """Wait a moment for the disk, and end."""
        self._latch.close()

    def _remember(self, stop: StopRequest) -> None:
        self._stop = stop
        self._latch.set(stop)

    def _forget(self) -> None:
        if self._stop is not None:
            self._stop = None
            self._latch.clear()
        self._owed = False
