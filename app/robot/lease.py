"""Who may drive: one holder at a time, for as long as it shows that it is there."""

from app.errors import NoControl
from app.link.messages import LeaseReply

LEASE_S = 2.0
"""A lease ends this long after the last sign of its holder."""


class Lease:
    """The right to drive. Times are seconds on the node's monotonic clock.

    Every lease has an epoch of its own; a command of another epoch counts for nothing, so that
    nobody who has lost the lease can move the arm with what is still under way.

    Args:
        first_epoch: Epochs rise from here. A node passes its clock (ms), so that they also rise
            over a restart.
    """

    def __init__(self, first_epoch: int = 0) -> None:
        self.epoch = first_epoch
        self.holder: str | None = None
        self._seen = 0.0

    def take(self, holder: str, now: float, *, takeover: bool = False) -> LeaseReply:
        """Give the lease to ``holder``: when it is free, theirs already, or with ``takeover``."""
        if self.holder == holder:
            self._seen = now
            return LeaseReply(granted=True, epoch=self.epoch)
        if self.holder is not None and not takeover:
            return self._refuse(f"{self.holder} drives")
        self.epoch += 1
        self.holder = holder
        self._seen = now
        return LeaseReply(granted=True, epoch=self.epoch)

    def check(self, holder: str, epoch: int | None) -> LeaseReply:
        """Whether ``holder`` has the lease of ``epoch``."""
        if self.holder is None:
            return self._refuse("nobody has control: take control first")
        if self.holder != holder or self.epoch != epoch:
            return self._refuse(f"you do not have control: {self.holder} drives")
        return LeaseReply(granted=True, epoch=self.epoch)

    def renew(self, holder: str, epoch: int | None, now: float) -> LeaseReply:
        """Show that ``holder`` is still there."""
        reply = self.check(holder, epoch)
        if reply.granted:
            self._seen = now
        return reply

    def release(self, holder: str, epoch: int | None) -> LeaseReply:
        """Give the lease back."""
        reply = self.check(holder, epoch)
        if reply.granted:
            self.holder = None
        return reply

    def seen(self, now: float) -> None:
        """A valid command arrived: the holder is there."""
        self._seen = now

    def expire(self, now: float) -> str | None:
        """Free the lease when its holder has not been seen for too long; tells whose it was."""
        if self.holder is None or now - self._seen <= LEASE_S:
            return None
        gone, self.holder = self.holder, None
        return gone

    def _refuse(self, reason: str) -> LeaseReply:
        return LeaseReply(granted=False, code=NoControl.default_code, reason=reason)
