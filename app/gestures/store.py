"""The gesture database: what is enrolled, in SQLite or any database that SQLAlchemy speaks to."""

import builtins
import logging
import threading
import time
import uuid
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

from pydantic import ValidationError
from sqlalchemy import URL, func, select, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session, selectinload

from app.errors import (
    CannotStart,
    DatabaseBroken,
    Duplicate,
    FarhandError,
    Invalid,
    NotFound,
)
from app.gestures import database
from app.gestures.records import (
    MAX_GESTURES,
    MAX_SAMPLES,
    TEMPLATE_BYTES,
    ActionVersion,
    Gesture,
    NewGesture,
    Sample,
    check_templates,
    clean_name,
    name_key,
)
from app.gestures.setfile import read_set
from app.gestures.tables import GalleryRow, GestureRow, SampleRow
from app.gestures.versions import check_version, set_action, version_of
from app.link.actions import ACTION, Action

log = logging.getLogger(__name__)

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class GestureStore:
    """Gestures with their actions and samples. Safe to use from any thread, and by two processes.

    Every change is one transaction: whole or not at all, and on the disk when the call returns.

    Args:
        url: SQLAlchemy URL, such as ``sqlite:////data/farhand.db`` or
            ``postgresql+psycopg://user@host/farhand``.
        starter: A set in the exchange format; fills a database that did not exist before. None
            leaves a new database empty.
        actions: What gestures of the starter set do in place of what is written there, by name.

    Raises:
        DatabaseBroken: the database is damaged, of a newer version, or of something else.
        CannotStart: the folder or the starter set is missing, or writing is not allowed.
        StorageFull: no space to make the database.
    """

    def __init__(
        self, url: str | URL, starter: Path | None, actions: Mapping[str, Action] | None = None
    ) -> None:
        self._engine = database.open_engine(url)
        self._writer = self._engine.execution_options(write=True)
        # Within the process, threads wait here; SQLite's own waiting polls and is not fair.
        self._writing = threading.Lock()
        try:
            self._open(starter, actions or {})
        except BaseException as error:
            self._engine.dispose()
            if isinstance(error, FarhandError) or not isinstance(error, Exception):
                raise
            # Damage shows in many ways: text that is not UTF-8, a number that is none.
            name = database.describe(self._engine)
            raise DatabaseBroken(
                f"{name} is damaged ({type(error).__name__}); {database.GO_ON}"
            ) from error

    def _open(self, starter: Path | None, actions: Mapping[str, Action]) -> None:
        name = database.describe(self._engine)
        with self._write() as session:
            if database.migrate(session.connection(), name) and starter is not None:
                try:
                    entries = read_set(starter)
                except Invalid as error:
                    raise CannotStart(
                        f"the starter set {starter} cannot be read: {error.message}"
                    ) from error
                entries = [
                    replace(entry, action=actions.get(entry.name, entry.action))
                    for entry in entries
                ]
                self._put(session, entries, replace=False)
                log.info("%s is new: filled with %d starter gestures", name, len(entries))
        self.list()

    def close(self) -> None:
        """Close all connections. SQLite then folds its log into the main file."""
        self._engine.dispose()

    @property
    def version(self) -> int:
        """Rises with every change, whichever process makes it."""
        with self._read() as session:
            return session.execute(select(GalleryRow.version)).scalar_one()

    def list(self) -> builtins.list[Gesture]:
        """All gestures, in the order in which they were made."""
        with self._read() as session:
            rows = session.scalars(
                select(GestureRow)
                .order_by(GestureRow.number)
                .options(selectinload(GestureRow.samples))
            )
            return [self._record(row) for row in rows]

    def get(self, id: str) -> Gesture:
        """One gesture.

        Raises:
            NotFound: no gesture has this id.
        """
        with self._read() as session:
            return self._record(self._row(session, id))

    def templates(self) -> builtins.list[tuple[str, bytes]]:
        """Name and template (600 bytes) of every active sample, in a stable order."""
        return [
            (gesture.name, sample.template)
            for gesture in self.list()
            if gesture.active
            for sample in gesture.samples
        ]

    def create(
        self, name: str, action: Action, templates: Sequence[bytes], *, active: bool = True
    ) -> Gesture:
        """Enrol a gesture.

        Args:
            name: Made NFC and trimmed; 1 to 60 printable characters.
            action: What it makes the robot do.
            templates: At least one, 600 bytes each.
            active: Whether it is matched from now on.

        Raises:
            Invalid: the name or a template is not what it should be, or there are too many.
            Duplicate: the name is taken, upper and lower case being the same.
            StorageFull: no space is left; nothing was changed.
        """
        entry = NewGesture(clean_name(name), action, check_templates(templates), active)
        with self._write() as session:
            return self._put(session, [entry], replace=False)[0]

    def put_all(
        self, entries: Sequence[NewGesture], *, replace: bool = False
    ) -> builtins.list[Gesture]:
        """Enrol many gestures at once: all of them or, when one is refused, none.

        Args:
            entries: What to enrol.
            replace: A gesture whose name is taken gets the new action and samples and keeps its
                id; without, it is refused.

        Raises:
            Invalid, Duplicate, StorageFull: as in :meth:`create`.
        """
        checked = [
            NewGesture(
                clean_name(entry.name), entry.action, check_templates(entry.templates), entry.active
            )
            for entry in entries
        ]
        with self._write() as session:
            return self._put(session, checked, replace=replace)

    def update(
        self,
        id: str,
        *,
        name: str | None = None,
        action: Action | None = None,
        active: bool | None = None,
        version: int | None = None,
    ) -> Gesture:
        """Change a gesture's name, its action, or whether it is matched; None leaves it.

        The action that was there before is kept, see :meth:`versions`.

        Args:
            id: The gesture.
            name: As in :meth:`create`.
            action: As in :meth:`create`.
            active: Whether it is matched from now on.
            version: What the caller takes for the newest version of the action; nothing is changed
                when it is not.

        Raises:
            NotFound: no gesture has this id.
            ChangedMeanwhile: ``version`` is not the newest.
            Invalid, Duplicate: as in :meth:`create`.
        """
        clean = None if name is None else clean_name(name)
        with self._write() as session:
            row = self._row(session, id)
            check_version(row, version)
            if clean is not None:
                self._check_free(session, clean, besides=row.number)
                row.name, row.name_key = clean, name_key(clean)
            if action is not None:
                set_action(row, action, _now_ms())
            if active is not None:
                row.active = active
            return self._touch(session, row)

    def versions(self, id: str) -> builtins.list[ActionVersion]:
        """The actions that a gesture had, oldest first; the last is in force.

        Raises:
            NotFound: no gesture has this id.
        """
        with self._read() as session:
            row = self._row(session, id)
            return [self._version(row, number) for number in range(len(row.versions))]

    def restore(self, id: str, version: int) -> Gesture:
        """Give a gesture the action that it had as ``version``, as its newest version.

        Raises:
            NotFound: no gesture has this id, or it has no such version.
        """
        with self._write() as session:
            row = self._row(session, id)
            for number, former in enumerate(row.versions):
                if former.version == version:
                    set_action(row, self._version(row, number).action, _now_ms())
                    return self._touch(session, row)
            raise NotFound(
                f"{row.name} has no version {version} of its action; the newest is {row.version}",
                version=version,
                newest=row.version,
            )

    def add_samples(self, id: str, templates: Sequence[bytes]) -> Gesture:
        """Enrol more pictures of a gesture.

        Raises:
            NotFound: no gesture has this id.
            Invalid: a template is not one, or there would be more than 1000.
        """
        checked = check_templates(templates)
        with self._write() as session:
            row = self._row(session, id)
            self._append(row, checked)
            return self._touch(session, row)

    def delete(self, id: str) -> None:
        """Forget a gesture and its samples.

        Raises:
            NotFound: no gesture has this id.
        """
        with self._write() as session:
            session.delete(self._row(session, id))
            self._rise(session)

    # -- inside a transaction ------------------------------------------------------------------

    def _put(
        self, session: Session, entries: Sequence[NewGesture], *, replace: bool
    ) -> builtins.list[Gesture]:
        rows = []
        now = _now_ms()
        for entry in entries:
            row = session.scalar(
                select(GestureRow).where(GestureRow.name_key == name_key(entry.name))
            )
            if row is None:
                row = GestureRow(
                    id=uuid.uuid4().hex, created_ms=now, version=0, samples=[], versions=[]
                )
                session.add(row)
            elif not replace:
                self._check_free(session, entry.name)
            row.name, row.name_key = entry.name, name_key(entry.name)
            set_action(row, entry.action, now)
            row.active = entry.active
            row.samples.clear()
            self._append(row, entry.templates)
            row.updated_ms = now
            row.checksum = _gesture_checksum(row)
            session.flush()
            rows.append(row)
        count = session.scalar(select(func.count()).select_from(GestureRow)) or 0
        if count > MAX_GESTURES:
            raise Invalid(f"there would be {count} gestures; at most {MAX_GESTURES} are allowed")
        self._rise(session)
        return [self._record(row) for row in rows]

    def _check_free(self, session: Session, name: str, besides: int | None = None) -> None:
        found = session.execute(
            select(GestureRow.number, GestureRow.name).where(GestureRow.name_key == name_key(name))
        ).first()
        if found is not None and found.number != besides:
            raise Duplicate(
                f"there is a gesture {found.name!r} already; choose another name",
                name=found.name,
            )

    def _append(self, row: GestureRow, templates: Sequence[bytes]) -> None:
        count = len(row.samples) + len(templates)
        if count > MAX_SAMPLES:
            raise Invalid(
                f"the gesture would have {count} samples; at most {MAX_SAMPLES} are allowed",
                field="templates",
            )
        for template in templates:
            sample = SampleRow(id=uuid.uuid4().hex, template=template, created_ms=_now_ms())
            sample.checksum = _sample_checksum(sample)
            row.samples.append(sample)

    def _touch(self, session: Session, row: GestureRow) -> Gesture:
        row.updated_ms = _now_ms()
        row.checksum = _gesture_checksum(row)
        self._rise(session)
        return self._record(row)

    def _rise(self, session: Session) -> None:
        session.execute(update(GalleryRow).values(version=GalleryRow.version + 1))

    def _row(self, session: Session, id: str) -> GestureRow:
        row = session.scalar(select(GestureRow).where(GestureRow.id == id))
        if row is None:
            raise NotFound(f"there is no gesture with the id {id[:64]!r}", id=id[:64])
        return row

    def _version(self, row: GestureRow, number: int) -> ActionVersion:
        try:
            found = version_of(row.versions[number])
        except ValueError as error:
            raise self._damaged(row) from error
        return ActionVersion(found.version, found.action, _time(found.created_ms))

    def _damaged(self, row: GestureRow) -> DatabaseBroken:
        return DatabaseBroken(
            f"{database.describe(self._engine)} is damaged (gesture {row.name!r}: its content "
            f"has changed on the disk); {database.GO_ON}"
        )

    def _record(self, row: GestureRow) -> Gesture:
        try:
            sound = row.checksum == _gesture_checksum(row) and all(
                sample.checksum == _sample_checksum(sample)
                and len(sample.template) == TEMPLATE_BYTES
                for sample in row.samples
            )
            if not sound:
                raise ValueError("wrong checksum")
            action = ACTION.validate_json(row.action)
        except (ValidationError, ValueError, TypeError, AttributeError) as error:
            raise self._damaged(row) from error
        samples = tuple(
            Sample(sample.id, bytes(sample.template), _time(sample.created_ms))
            for sample in row.samples
        )
        created, updated = _time(row.created_ms), _time(row.updated_ms)
        return Gesture(row.id, row.name, action, samples, created, updated, row.active, row.version)

    # -- transactions --------------------------------------------------------------------------

    @contextmanager
    def _read(self) -> Iterator[Session]:
        with database.plain_errors(self._engine), Session(self._engine) as session:
            yield session

    @contextmanager
    def _write(self) -> Iterator[Session]:
        with self._writing, database.plain_errors(self._engine):
            try:
                with Session(self._writer) as session, session.begin():
                    yield session
            except IntegrityError as error:
                # Two processes on a database without SQLite's single writer met.
                raise Duplicate("the name has just been taken; choose another") from error


def _now_ms() -> int:
    return time.time_ns() // 1_000_000


def _time(ms: int) -> datetime:
    try:
        return EPOCH + timedelta(milliseconds=ms)
    except (OverflowError, TypeError) as error:
        raise DatabaseBroken(f"the gesture database holds an impossible time ({ms})") from error


def _gesture_checksum(row: GestureRow) -> int:
    fields = (row.id, row.name, row.name_key, row.action, row.created_ms, row.updated_ms)
    # Added only where they say something: rows older than the columns keep their checksums.
    state = () if row.active else ("inactive",)
    version = () if row.version == 1 else (row.version,)
    return zlib.crc32(repr(fields + state + version).encode())


def _sample_checksum(row: SampleRow) -> int:
    return zlib.crc32(repr((row.id, bytes(row.template), row.created_ms)).encode())
