"""What the processes beside a node have in common: its newest state, and when to end."""

import ctypes
import os
import signal
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import zenoh

CHECK_PERIOD_S = 0.5
"""How often the parent and the link are looked at."""
LINK_PATIENCE_S = 5.0
"""The link may be gone this long (a node that restarts) before the process gives up."""


_PR_SET_PDEATHSIG = 1
"""prctl(2), linux/prctl.h."""


def give_way(niceness: int, autogroup: Path = Path("/proc/self/autogroup")) -> None:
    """Let everything else on this machine go first, and end with the thread that started this.

    Linux weighs sessions against each other before it weighs the processes of one (sched(7), "the
    autogroup feature"): niceness alone would only let this process's own session go before, and
    half a processor would be taken from a browser or a gateway of another one. So this one gets a
    session of its own that is as nice. That takes it out of the group which is killed with a hung
    node; the kernel kills it instead, when its parent is gone.

    Args:
        niceness: 0 to 19.
        autogroup: Where the kernel is told; absent where it groups nothing.
    """
    os.nice(niceness)
    with suppress(PermissionError):  # already the first of its session
        os.setsid()
    with suppress(OSError):
        autogroup.write_text(str(niceness))
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)


class NewestState:
    """The newest State received, still encoded: what is not drawn is never decoded."""

    def __init__(self) -> None:
        self._ready = threading.Condition()
        self._bytes: bytes | None = None
        self._count = 0

    def put(self, message: bytes) -> None:
        """Replace what is there. Called on Zenoh's threads."""
        with self._ready:
            self._bytes, self._count = message, self._count + 1
            self._ready.notify_all()

    def wait(self, seen: int, timeout: float) -> tuple[int, bytes | None]:
        """The newest message and its number, as soon as that differs from ``seen``."""
        with self._ready:
            self._ready.wait_for(lambda: self._count != seen, timeout)
            return self._count, self._bytes


class Alive:
    """Whether there is still somebody to draw for: the parent process and the link.

    Args:
        session: The link.
        parent: Process id of the parent.
    """

    def __init__(self, session: zenoh.Session, parent: int) -> None:
        self._session, self._parent = session, parent
        self._linked_at = time.monotonic()
        self._next_check = 0.0
        self.reason = ""

    def __call__(self) -> bool:
        """False, with the reason kept, when it is time to end. Cheap to call often."""
        now = time.monotonic()
        if now < self._next_check:
            return True
        self._next_check = now + CHECK_PERIOD_S
        if os.getppid() != self._parent:
            self.reason = "the robot node is gone"
            return False
        if self._session.is_closed():
            self.reason = "the link is closed"
            return False
        if self._session.info.routers_zid():
            self._linked_at = now
        elif now - self._linked_at > LINK_PATIENCE_S:
            self.reason = f"the link has been gone for {LINK_PATIENCE_S:g} s"
            return False
        return True
