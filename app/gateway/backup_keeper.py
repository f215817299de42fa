"""Backs the gesture database up by itself, and knows whether its gestures can be trusted."""

import asyncio
import logging

from app.errors import DatabaseBroken, FarhandError
from app.gateway.roles import Role
from app.gestures import backup, recovery
from app.gestures.backup import Place

log = logging.getLogger(__name__)

CHECK_S = 1.0
SETTLE_S = 5.0
"""A backup is made once nothing has changed for so long, so that teaching makes one, not twenty."""
LATEST_S = 60.0
"""And so long after the first change at the latest."""
RETRY_S = 60.0

OBSERVERS_TOLD = (
    "The gesture database was lost or is broken, and the robot cannot be armed until an operator "
    "has mended that."
)


class BackupKeeper:
    """Of one server. Used on the event loop; copying and checking run in threads.

    Args:
        place: Of the database; None for one that is not SQLite's, which has its own ways.
        keep: How many backups stay.
    """

    def __init__(self, place: Place | None, keep: int) -> None:
        self._place = place
        self._keep = keep
        self._latest = 0.0
        self._due: float | None = None
        self._lost: str | None = None
        self._broken: str | None = None

    @property
    def problem(self) -> str | None:
        """Why the robot must not be armed, and how to go on."""
        return self._lost or self._broken

    def problem_for(self, role: Role) -> str | None:
        """:attr:`problem` as somebody of this role is told it: observers get no paths."""
        if self.problem is None or role == "operator":
            return self.problem
        return OBSERVERS_TOLD

    def look(self) -> None:
        """Notice what another process did about a lost database; reads one small file."""
        self._lost = None if self._place is None else recovery.problem(self._place)

    def broke(self, error: DatabaseBroken) -> None:
        """The database broke while the server runs: a :attr:`problem` until it is started again."""
        self._broken = (
            f"{error.message}. The robot cannot be armed until that is mended and the server "
            "started again."
        )

    def changed(self) -> None:
        """The database holds something new."""
        now = asyncio.get_running_loop().time()
        if self._due is None:
            self._latest = now + LATEST_S
        self._due = min(now + SETTLE_S, self._latest)

    async def tend(self) -> None:
        """Make a backup if it is time to."""
        loop = asyncio.get_running_loop()
        if self._due is not None and loop.time() >= self._due:
            self._due = None
            if not await asyncio.to_thread(self.make):
                self._due = self._latest = loop.time() + RETRY_S

    def finish(self) -> None:
        """Make the backup that was still to come. Not for the event loop."""
        if self._due is not None:
            self.make()

    def make(self) -> bool:
        """Make a backup now, unless the newest holds the same. Not for the event loop.

        While the gestures are not those that were taught there is none: it would push out the good.

        Returns:
            Whether that went well.
        """
        if self._place is None or self.problem is not None:
            return True
        try:
            made = backup.make(self._place, self._keep)
        except DatabaseBroken as error:
            self.broke(error)
            return False
        except (FarhandError, OSError) as error:
            log.error("the gesture database was not backed up: %s", error)
            return False
        if made is not None:
            log.info("the gesture database is backed up as %s", made.name)
        return True
