"""All connections there are: whose, in which phase, and which one goes when there are too many.

Somebody who is not signed in is never refused a connection because others hold too many: the one
that has been silent longest, of the address that holds most, is closed in its place. So whoever
fills the server with silence cannot keep anybody out, and what they hold is bounded.
"""

import logging
import time
from collections import OrderedDict
from collections.abc import Callable

log = logging.getLogger(__name__)

PROXY = "proxy"
"""Stands for the address of a proxy, behind which are many."""
KNOWN_S = 600.0
"""So long after its last signed-in request an address counts as one of somebody signed in."""
MAX_KNOWN = 1024
"""Addresses remembered as such."""
CLOSE_S = 3.0
"""A connection that is being closed is cut when what was sent has not been read after this."""
LOG_EVERY_S = 10.0


class Connection:
    """One connection, from its acceptance to its end.

    Args:
        address: Where it comes from: see :func:`app.gateway.machine.address_group`.
        deadline: When what it does now must have been done, s, monotonic.
    """

    __slots__ = (
        "address", "deadline", "end", "expire", "is_closing", "pay_back", "signed_in", "spoke",
        "write_deadline",
    )  # fmt: skip

    def __init__(self, address: str, deadline: float) -> None:
        self.address = address
        self.signed_in = False
        """Whether its newest request came from somebody who is signed in."""
        self.spoke = False
        """Whether anything has come on it."""
        self.deadline: float | None = deadline
        self.write_deadline: float | None = None
        """When what was sent must have been read."""
        self.end: Callable[[], None] = _nothing
        """Closes it at once, whatever it does."""
        self.expire: Callable[[], None] = _nothing
        """Called when :attr:`deadline` has passed."""
        self.is_closing: Callable[[], bool] = bool
        """Whether it is closed as soon as what was sent has been read."""
        self.pay_back: Callable[[], None] = _nothing
        """Called when it turns out to be of somebody signed in."""


def _nothing() -> None:
    """What a connection does that has not been handed over yet."""


class _Held:
    """Connections of one address that are not signed in, the longest silent first."""

    def __init__(self) -> None:
        self.silent: OrderedDict[Connection, None] = OrderedDict()
        self.spoke: OrderedDict[Connection, None] = OrderedDict()

    def __len__(self) -> int:
        return len(self.silent) + len(self.spoke)

    def oldest(self) -> Connection:
        return next(iter(self.silent or self.spoke))


class ConnectionTable:
    """Counts connections, and makes room. Used on the event loop.

    Args:
        connections: There may be in all.
        strangers: Of these, of those who are not signed in.
        per_address: Of these, from one address.
        clock: Seconds that only rise.
    """

    def __init__(
        self,
        connections: int,
        strangers: int,
        per_address: int,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._most = connections
        self._most_strangers = strangers
        self._per_address = per_address
        self._clock = clock
        self._all: set[Connection] = set()
        self._strangers = 0
        self._held: dict[str, _Held] = {}
        self._known: OrderedDict[str, float] = OrderedDict()
        self._told_at = float("-inf")
        self.evicted = 0
        """Connections closed to make room."""

    def __len__(self) -> int:
        return len(self._all)

    def __contains__(self, connection: Connection) -> bool:
        return connection in self._all

    @property
    def strangers(self) -> int:
        """Connections of those who are not signed in."""
        return self._strangers

    def admit(self, address: str, deadline: float) -> Connection | None:
        """Count a new connection, and close another where there are too many.

        Returns:
            The connection; None when all there may be are signed in.
        """
        held = self._held.get(address)
        if held and len(held) >= self._per_address and not self.is_known(address):
            self._evict(held.oldest())
        elif self._strangers >= self._most_strangers or (
            self._strangers and len(self._all) >= self._most
        ):
            self.make_room()
        if len(self._all) >= self._most:
            self._tell("a connection was refused: all %d are of people signed in", self._most)
            return None
        connection = Connection(address, deadline)
        self._all.add(connection)
        self._hold(connection)
        return connection

    def make_room(self) -> bool:
        """Close a stranger's connection; False when there is none.

        The address that holds most gives up first. One from which somebody is signed in is
        forgiven as many as any address may have.
        """

        def excess(address: str) -> int:
            count = len(self._held[address])
            return count - self._per_address if self.is_known(address) else count

        if not self._held:
            return False
        self._evict(self._held[max(self._held, key=excess)].oldest())
        return True

    def is_known(self, address: str) -> bool:
        """Whether somebody is signed in from there, or a proxy is there."""
        at = self._known.get(address)
        return address == PROXY or (at is not None and self._clock() - at < KNOWN_S)

    def heard(self, connection: Connection) -> None:
        """Something has come on a connection."""
        held = None if connection.signed_in else self._held.get(connection.address)
        if held is None:
            connection.spoke = True
        elif connection in held.spoke:
            held.spoke.move_to_end(connection)
        elif connection in held.silent:
            del held.silent[connection]
            held.spoke[connection] = None
            connection.spoke = True

    def judged(self, connection: Connection, signed_in: bool) -> None:
        """Whose a connection is, by its newest request."""
        if signed_in:
            self._known.pop(connection.address, None)
            self._known[connection.address] = self._clock()
            if len(self._known) > MAX_KNOWN:
                self._known.popitem(last=False)
        if connection in self._all and signed_in != connection.signed_in:
            if signed_in:
                self._let_go(connection)
                connection.pay_back()
            connection.signed_in = signed_in
            if not signed_in:
                self._hold(connection)

    def remove(self, connection: Connection) -> None:
        """A connection has ended."""
        if connection in self._all:
            self._all.discard(connection)
            if not connection.signed_in:
                self._let_go(connection)

    def close(self) -> None:
        """End all there are."""
        for connection in tuple(self._all):
            self.remove(connection)
            connection.end()

    def expire(self) -> None:
        """End what has not done in time what it had to."""
        now = self._clock()
        for connection in tuple(self._all):
            if connection.write_deadline is None and connection.is_closing():
                connection.write_deadline = now + CLOSE_S
            if connection.write_deadline is not None and now >= connection.write_deadline:
                self.remove(connection)
                connection.end()
            elif connection.deadline is not None and now >= connection.deadline:
                connection.deadline = None
                connection.expire()

    def _hold(self, connection: Connection) -> None:
        held = self._held.setdefault(connection.address, _Held())
        (held.spoke if connection.spoke else held.silent)[connection] = None
        self._strangers += 1

    def _let_go(self, connection: Connection) -> None:
        held = self._held[connection.address]
        (held.spoke if connection.spoke else held.silent).pop(connection, None)
        self._strangers -= 1
        if not len(held):
            del self._held[connection.address]

    def _evict(self, connection: Connection) -> None:
        self.remove(connection)
        self.evicted += 1
        self._tell("connections of who is not signed in make room (%d so far)", self.evicted)
        connection.end()

    def _tell(self, message: str, *values: object) -> None:
        now = self._clock()
        if now - self._told_at >= LOG_EVERY_S:
            self._told_at = now
            log.warning(message, *values)
