"""The gesture database: what is enrolled, in SQLite or any database that SQLAlchemy speaks to."""

import builtins
import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from sqlalchemy import URL, func, select

from app.errors import CannotStart, DatabaseBroken, FarhandError, Invalid, NotFound
from app.gestures import database
from app.gestures.galleries import Galleries
from app.gestures.history import History, Recorder
from app.gestures.putting import check_free, put, teaching_ms, touch
from app.gestures.reading import read_all, read_gesture, read_version, row_of
from app.gestures.records import (
    SHARED,
    ActionVersion,
    Gesture,
    NewGesture,
    check_landmarks,
    check_templates,
    checked_entry,
    clean_name,
    name_key,
)
from app.gestures.rows import append, ms_of, now_ms, seal_gallery
from app.gestures.samples import Samples
from app.gestures.setfile import read_set
from app.gestures.tables import GestureRow
from app.gestures.transactions import Transactions
from app.gestures.undoing import undo
from app.gestures.versions import check_version, set_action
from app.link.actions import Action

log = logging.getLogger(__name__)


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
        self.base = Transactions(url)
        self.galleries = Galleries(self.base)
        self.history = History(self.base)
        self.samples = Samples(self.base, self.history)
        try:
            self._open(starter, actions or {})
        except BaseException as error:
            self.base.close()
            if isinstance(error, FarhandError) or not isinstance(error, Exception):
                raise
            # Damage shows in many ways: text that is not UTF-8, a number that is none.
            raise DatabaseBroken(
                f"{self.base.name} is damaged ({type(error).__name__}); {database.GO_ON}"
            ) from error

    def _open(self, starter: Path | None, actions: Mapping[str, Action]) -> None:
        name = self.base.name
        with self.base.write(migrate=True) as session:
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
                shared = self.galleries.row(session, SHARED)
                nobody = Recorder(self.base, None)
                gestures = put(self.base, session, shared, entries, nobody, replace=False)
                if gestures:
                    # Nobody has taught these.
                    shared.created_ms = ms_of(gestures[-1].created)
                    seal_gallery(shared)
                log.info("%s is new: filled with %d starter gestures", name, len(gestures))
        self.check()

    def close(self) -> None:
        """Close all connections. SQLite then folds its log into the main file."""
        self.base.close()

    @property
    def version(self) -> int:
        """Rises with every change, whichever process makes it."""
        return self.base.version

    def check(self) -> builtins.list[Gesture]:
        """Read everything but former actions, which :meth:`versions` checks.

        Returns:
            The gestures of all galleries.

        Raises:
            DatabaseBroken: with the first part that is not as it was written.
        """
        with self.base.read() as session:
            homes = self.galleries.rows(session)
            found = [gesture for home in homes for gesture in read_all(self.base, session, home)]
            count = session.scalar(select(func.count()).select_from(GestureRow))
        if count != len(found):
            raise self.base.damaged("a gesture belongs to no gallery")
        return found

    def list(self, gallery: str = SHARED) -> builtins.list[Gesture]:
        """All gestures of a gallery, in the order in which they were made.

        Raises:
            NotFound: no gallery has this id.
        """
        with self.base.read() as session:
            return read_all(self.base, session, self.galleries.row(session, gallery))

    def get(self, id: str) -> Gesture:
        """One gesture, of whichever gallery.

        Raises:
            NotFound: no gesture has this id.
        """
        with self.base.read() as session:
            return read_gesture(self.base, row_of(session, id))

    def templates(self, gallery: str = SHARED) -> builtins.list[tuple[str, bytes]]:
        """Name and template (600 bytes) of every active sample, in a stable order.

        Raises:
            NotFound: no gallery has this id.
        """
        return [(name, template) for name, template, _ in self.active_samples(gallery)]

    def active_samples(
        self, gallery: str = SHARED
    ) -> builtins.list[tuple[str, bytes, bytes | None]]:
        """The same with the landmarks of each, None where it has none.

        Raises:
            NotFound: no gallery has this id.
        """
        return [
            (gesture.name, sample.template, sample.landmarks)
            for gesture in self.list(gallery)
            if gesture.active
            for sample in gesture.samples
        ]

    def create(
        self,
        name: str,
        action: Action,
        templates: Sequence[bytes],
        *,
        landmarks: Sequence[bytes | None] = (),
        active: bool = True,
        gallery: str = SHARED,
        undo_as: str | None = None,
    ) -> Gesture:
        """Enrol a gesture.

        Args:
            name: Made NFC and trimmed; 1 to 60 printable characters.
            action: What it makes the robot do.
            templates: At least one, 600 bytes each.
            landmarks: Of each template, 254 bytes, or None; or empty for none at all.
            active: Whether it is matched from now on.
            gallery: Id of the gallery that it belongs to.
            undo_as: Id under which :meth:`undo` can take it back.

        Raises:
            NotFound: no gallery has this id.
            Invalid: the name or a template is not what it should be, or there are too many.
            Duplicate: the name is taken, upper and lower case being the same.
            StorageFull: no space is left; nothing was changed.
        """
        entry = checked_entry(NewGesture(name, action, tuple(templates), active, tuple(landmarks)))
        with self.history.recording("enrol", undo_as) as seen, self.base.write() as session:
            home = self.galleries.row(session, gallery)
            return put(self.base, session, home, [entry], seen, replace=False)[0]

    def put_all(
        self, entries: Sequence[NewGesture], *, replace: bool = False, gallery: str = SHARED
    ) -> builtins.list[Gesture]:
        """Enrol many gestures at once: all of them or, when one is refused, none.

        Args:
            entries: What to enrol.
            replace: A gesture whose name is taken gets the new action and samples and keeps its
                id; without, it is refused.
            gallery: Id of the gallery that they belong to.

        Raises:
            NotFound, Invalid, Duplicate, StorageFull: as in :meth:`create`.
        """
        checked = [checked_entry(entry) for entry in entries]
        with self.base.write() as session:
            home = self.galleries.row(session, gallery)
            nobody = Recorder(self.base, None)
            return put(self.base, session, home, checked, nobody, replace=replace)

    def update(
        self,
        id: str,
        *,
        name: str | None = None,
        action: Action | None = None,
        active: bool | None = None,
        version: int | None = None,
        undo_as: str | None = None,
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
            undo_as: As in :meth:`create`.

        Raises:
            NotFound: no gesture has this id.
            ChangedMeanwhile: ``version`` is not the newest.
            Invalid, Duplicate: as in :meth:`create`.
        """
        clean = None if name is None else clean_name(name)
        with self.history.recording("change", undo_as) as seen, self.base.write() as session:
            row = row_of(session, id)
            check_version(row, version)
            seen.before(row)
            if clean is not None:
                check_free(session, row.gallery, clean, besides=row.number)
                row.name, row.name_key = clean, name_key(clean)
            if action is not None:
                set_action(row, action, now_ms())
            if active is not None:
                row.active = active
            return seen.after(touch(self.base, session, row))

    def versions(self, id: str) -> builtins.list[ActionVersion]:
        """The actions that a gesture had, oldest first; the last is in force.

        Raises:
            NotFound: no gesture has this id.
        """
        with self.base.read() as session:
            row = row_of(session, id)
            return [read_version(self.base, row, number) for number in range(len(row.versions))]

    def restore(self, id: str, version: int, *, undo_as: str | None = None) -> Gesture:
        """Give a gesture the action that it had as ``version``, as its newest version.

        Raises:
            NotFound: no gesture has this id, or it has no such version.
        """
        with self.history.recording("change", undo_as) as seen, self.base.write() as session:
            row = row_of(session, id)
            seen.before(row)
            for number, former in enumerate(row.versions):
                if former.version == version:
                    set_action(row, read_version(self.base, row, number).action, now_ms())
                    return seen.after(touch(self.base, session, row))
            raise NotFound(
                f"{row.name} has no version {version} of its action; the newest is {row.version}",
                version=version,
                newest=row.version,
            )

    def add_samples(
        self,
        id: str,
        templates: Sequence[bytes],
        *,
        landmarks: Sequence[bytes | None] = (),
        replace: bool = False,
        undo_as: str | None = None,
    ) -> Gesture:
        """Enrol more pictures of a gesture, or with ``replace`` others in place of all so far.

        Raises:
            NotFound: no gesture has this id.
            Invalid: a template is not one, or there would be more than 1000.
        """
        checked, hands = check_templates(templates), check_landmarks(landmarks, templates)
        with self.history.recording("samples", undo_as) as seen, self.base.write() as session:
            row = row_of(session, id)
            seen.before(row)
            if replace:
                row.samples.clear()
            append(row, checked, teaching_ms(row.home), hands)
            return seen.after(touch(self.base, session, row))

    def delete(self, id: str, *, undo_as: str | None = None) -> None:
        """Forget a gesture and its samples.

        Raises:
            NotFound: no gesture has this id.
        """
        with self.history.recording("delete", undo_as) as seen, self.base.write() as session:
            row = row_of(session, id)
            seen.before(row)
            session.delete(row)
            self.base.rise(session)

    def undo(self, id: str, *, undo_as: str | None = None) -> builtins.list[Gesture]:
        """Take a change back, see :func:`app.gestures.undoing.undo`."""
        return undo(self.base, self.galleries, self.history, id, undo_as)
