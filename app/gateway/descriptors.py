"""How many file descriptors there are, and for whom: some are always left for what must go on."""

import logging
import os
import resource
from pathlib import Path
from typing import NamedTuple

from app.errors import CannotStart

log = logging.getLogger(__name__)

MOST = 8192
"""More are not asked for: what walks through all possible descriptors would take its time."""
LEAST = 256
"""With fewer the server does not start."""
TIGHT = 512
RESERVE = 96
"""Beside what is open at the start: files, pipes of a node that starts anew, jobs, the 3D view."""


class Shares(NamedTuple):
    """How many connections there may be at once."""

    connections: int
    """In all."""
    strangers: int
    """Of these, of those who are not signed in."""


def raise_limit() -> int:
    """Ask for as many descriptors as this process may have, at most :data:`MOST`.

    Returns:
        The limit in force.

    Raises:
        CannotStart: it is below :data:`LEAST`.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = MOST if hard == resource.RLIM_INFINITY else min(hard, MOST)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
        soft = wanted
    limit = MOST if soft == resource.RLIM_INFINITY else soft
    if limit < LEAST:
        raise CannotStart(
            f"this process may open {limit} files, too few to keep a stop possible while others "
            f"connect; allow at least {LEAST} (ulimit -n, or LimitNOFILE= of systemd)",
            limit=limit,
        )
    if limit < TIGHT:
        log.warning(
            "this process may open %d files: few can connect at once; "
            "allow %d or more (ulimit -n, or LimitNOFILE= of systemd)",
            limit,
            TIGHT,
        )
    return limit


def count_open() -> int:
    """Descriptors that this process has open; a guess where the system does not tell."""
    folder = Path("/proc/self/fd") if Path("/proc/self/fd").exists() else Path("/dev/fd")
    try:
        return len(os.listdir(folder))
    except OSError:
        return 64


def share(limit: int, open_now: int, wanted: int) -> Shares:
    """Divide the descriptors that are left.

    A quarter, and no less than :data:`RESERVE`, stays for what is no connection; of the others at
    least half for who is signed in.

    Args:
        limit: Descriptors that the process may have.
        open_now: Of these, open before anybody connects.
        wanted: Connections of strangers, if there is room.
    """
    left = limit - open_now
    connections = max(16, left - max(RESERVE, left // 4))
    return Shares(connections, min(wanted, connections // 2))


def current_shares(wanted: int) -> Shares:
    """:func:`share` of this process as it is now."""
    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    limit = 1 << 20 if soft == resource.RLIM_INFINITY else soft
    return share(limit, count_open(), wanted)
