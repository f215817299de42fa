"""One node to a stop latch: a reset at a second one would delete what was stopped at the first."""

import errno
import logging
import threading
from pathlib import Path

from app.errors import CannotStart
from app.process_lock import ProcessLock

log = logging.getLogger(__name__)

HANDOVER_S = 3.0
"""A node waits so long for one before it that is just ending."""
START_S = 2.0
"""And so long for the disk. A latch on a disk that does not answer counts as set without it."""
_STORAGE = (errno.EROFS, errno.EACCES, errno.EPERM, errno.ENOSPC, errno.EDQUOT, errno.EIO)
"""Trouble of the disk's, of which the latch itself tells; while it lasts nothing can be reset."""


def lock_latch(latch: Path) -> ProcessLock | None:
    """Keep every other node from the same stop latch.

    Returns:
        The lock; None where the disk makes none, or does not answer.

    Raises:
        CannotStart: another node has it and does not end, or the lock cannot be made.
    """
    found: list[ProcessLock | CannotStart] = []

    def take() -> None:
        try:
            found.append(_take(latch))
        except CannotStart as error:
            found.append(error)

    # Who waits for a frozen disk waits inside the kernel, and nothing ends that.
    thread = threading.Thread(target=take, name="latch-lock", daemon=True)
    thread.start()
    thread.join(HANDOVER_S + START_S)
    match found:
        case [ProcessLock() as lock]:
            return lock
        case [CannotStart() as error] if error.detail.get("errno") not in _STORAGE:
            raise error
        case [CannotStart() as error]:
            log.warning("another robot node would not be kept out: %s", error.message)
        case _:
            log.warning("another robot node would not be kept out: the disk does not answer")
    return None


def _take(latch: Path) -> ProcessLock:
    what = f"the stop latch {latch}"
    try:
        latch.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CannotStart(
            f"the folder of {what} cannot be made ({error.strerror}); name a file in a folder of "
            "yours",
            path=str(latch),
        ) from error
    return ProcessLock(
        latch.with_name(latch.name + ".lock"),
        what,
        "end that robot node first, or give this one a latch of its own",
        wait_s=HANDOVER_S,
    )
