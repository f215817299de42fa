"""One database, read and written in whole transactions."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy import URL, select, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from app.errors import DatabaseBroken, Duplicate
from app.gestures import database
from app.gestures.tables import CounterRow


class Transactions:
    """Safe to use from any thread, and by two processes on one database.

    Args:
        url: SQLAlchemy URL.

    Raises:
        DatabaseBroken: the file is no database, or is damaged.
        CannotStart: the URL is none, its driver is missing, or the folder is.
    """

    def __init__(self, url: str | URL) -> None:
        self.engine = database.open_engine(url)
        self._writer = self.engine.execution_options(write=True)
        self._migrator = self.engine.execution_options(write=True, migrate=True)
        # Within the process, threads wait here; SQLite's own waiting polls and is not fair.
        self._writing = threading.Lock()

    @property
    def name(self) -> str:
        """The database as messages call it."""
        return database.describe(self.engine)

    def close(self) -> None:
        """Close all connections. SQLite then folds its log into the main file."""
        self.engine.dispose()

    @contextmanager
    def read(self) -> Iterator[Session]:
        """A session that sees the database as of one moment."""
        with database.plain_errors(self.engine), Session(self.engine) as session:
            yield session

    @contextmanager
    def write(self, *, migrate: bool = False) -> Iterator[Session]:
        """A session whose changes are made when the block ends; none when it raises.

        Args:
            migrate: Tables may be changed; what refers to what is not checked meanwhile.

        Raises:
            Duplicate: another process took the same name at the same time.
            StorageFull: no space is left; nothing was changed.
        """
        writer = self._migrator if migrate else self._writer
        with self._writing, database.plain_errors(self.engine):
            try:
                with Session(writer) as session, session.begin():
                    yield session
            except IntegrityError as error:
                # Two processes on a database without SQLite's single writer met.
                raise Duplicate("the name has just been taken; choose another") from error

    @property
    def version(self) -> int:
        """Rises with every change, whichever process makes it."""
        with self.read() as session:
            return session.execute(select(CounterRow.version)).scalar_one()

    def rise(self, session: Session) -> None:
        """Count the change that ``session`` makes."""
        session.execute(update(CounterRow).values(version=CounterRow.version + 1))

    def damaged(self, what: str) -> DatabaseBroken:
        """The error for content that is not what was written; ``what`` names it."""
        return DatabaseBroken(
            f"{self.name} is damaged ({what}: its content has changed on the disk); "
            f"{database.GO_ON}"
        )
