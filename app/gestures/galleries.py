"""Galleries: several people, each with gestures of their own."""

import builtins

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.errors import Duplicate, Invalid, NotFound, RequestError
from app.gestures.putting import new_gesture
from app.gestures.reading import read_all
from app.gestures.records import MAX_GALLERIES, SHARED, Gallery, clean_name, name_key
from app.gestures.rows import (
    append,
    check_gallery,
    ms_of,
    new_id,
    now_ms,
    seal_gallery,
    seal_gesture,
    time_of,
)
from app.gestures.tables import SHARED_NUMBER, GalleryRow, GestureRow, SampleRow
from app.gestures.transactions import Transactions
from app.gestures.versions import set_action


class SharedGallery(RequestError):
    """The shared gallery was to be deleted."""

    default_code = "shared_gallery"
    status = 409


class Galleries:
    """The galleries of one database; part of :class:`app.gestures.GestureStore`.

    There is always the shared one. A new one begins as a copy of it, so that its owner can drive at
    once, and teaches gesture after gesture; from then on neither notices changes of the other.
    """

    def __init__(self, base: Transactions) -> None:
        self._base = base

    def list(self) -> builtins.list[Gallery]:
        """All galleries, the shared one first, then in the order in which they were made."""
        with self._base.read() as session:
            return [self._record(session, row) for row in self.rows(session)]

    def get(self, id: str) -> Gallery:
        """One gallery.

        Raises:
            NotFound: no gallery has this id.
        """
        with self._base.read() as session:
            return self._record(session, self.row(session, id))

    def named(self, name: str) -> Gallery:
        """The gallery of this name, upper and lower case being the same, or of this id.

        Raises:
            NotFound: there is none; the message says which there are.
        """
        galleries = self.list()
        for gallery in galleries:
            if name_key(name.strip()) == name_key(gallery.name) or name == gallery.id:
                return gallery
        names = ", ".join(gallery.name for gallery in galleries)
        raise NotFound(f"there is no gallery {name[:64]!r}; there are: {names}")

    def create(self, name: str) -> Gallery:
        """Make a gallery: a copy of the shared one, with the samples' own times.

        Args:
            name: By the rules for names of gestures.

        Raises:
            Invalid: the name is not one, or there are too many galleries.
            Duplicate: the name is taken, upper and lower case being the same.
            StorageFull: no space is left; nothing was changed.
        """
        clean = clean_name(name, "gallery")
        with self._base.write() as session:
            self._check_free(session, clean)
            count = session.scalar(select(func.count()).select_from(GalleryRow)) or 0
            if count >= MAX_GALLERIES:
                raise Invalid(f"there are {count} galleries, which is the most; delete one first")
            shared = self.row(session, SHARED)
            newest = session.scalar(
                select(func.max(SampleRow.created_ms))
                .join(GestureRow, SampleRow.gesture == GestureRow.number)
                .where(GestureRow.gallery == shared.number)
            )
            # Never older than what it begins with, even if the clock was set back.
            now = max(now_ms(), newest or 0)
            row = GalleryRow(id=new_id(), name=clean, name_key=name_key(clean), created_ms=now)
            seal_gallery(row)
            session.add(row)
            session.flush()
            self._copy(session, shared, row)
            self._base.rise(session)
            session.flush()
            return self._record(session, row)

    def rename(self, id: str, name: str) -> Gallery:
        """Give a gallery another name.

        Raises:
            NotFound: no gallery has this id.
            Invalid, Duplicate: as in :meth:`create`.
        """
        clean = clean_name(name, "gallery")
        with self._base.write() as session:
            row = self.row(session, id)
            self._check_free(session, clean, besides=row.number)
            row.name, row.name_key = clean, name_key(clean)
            seal_gallery(row)
            self._base.rise(session)
            return self._record(session, row)

    def delete(self, id: str) -> None:
        """Forget a gallery with all its gestures.

        Raises:
            NotFound: no gallery has this id.
            SharedGallery: it is the shared one.
        """
        if id == SHARED:
            raise SharedGallery("the shared gallery stays; delete gestures in it one by one")
        with self._base.write() as session:
            session.delete(self.row(session, id))
            self._base.rise(session)

    def rows(self, session: Session) -> builtins.list[GalleryRow]:
        """The rows of all galleries, within a transaction, the shared one first.

        Raises:
            DatabaseBroken: one is not as it was written, or the shared one is gone.
        """
        rows = session.scalars(select(GalleryRow).order_by(GalleryRow.number)).all()
        if not rows or (rows[0].number, rows[0].id) != (SHARED_NUMBER, SHARED):
            raise self._base.damaged("the shared gallery")
        return [self._checked(row) for row in rows]

    def row(self, session: Session, id: str) -> GalleryRow:
        """The row of a gallery, within a transaction.

        Raises:
            NotFound: no gallery has this id.
            DatabaseBroken: it is not as it was written, or is the shared one and gone.
        """
        row = session.scalar(select(GalleryRow).where(GalleryRow.id == id))
        if row is None and id == SHARED:
            raise self._base.damaged("the shared gallery")
        if row is None:
            raise NotFound(f"there is no gallery with the id {id[:64]!r}", id=id[:64])
        return self._checked(row)

    def _checked(self, row: GalleryRow) -> GalleryRow:
        try:
            check_gallery(row)
        except (ValueError, TypeError) as error:
            raise self._base.damaged(f"gallery {row.name!r}") from error
        return row

    def _copy(self, session: Session, shared: GalleryRow, to: GalleryRow) -> None:
        # Read first: what is damaged would get a good checksum by being copied.
        for gesture in read_all(self._base, session, shared):
            copy = new_gesture(to, to.created_ms)
            copy.name, copy.name_key = gesture.name, name_key(gesture.name)
            copy.active = gesture.active
            copy.updated_ms = to.created_ms
            set_action(copy, gesture.action, to.created_ms)
            for sample in gesture.samples:
                append(copy, [sample.template], ms_of(sample.created), [sample.landmarks])
            seal_gesture(copy)
            session.add(copy)

    def _check_free(self, session: Session, name: str, besides: int | None = None) -> None:
        found = session.execute(
            select(GalleryRow.number, GalleryRow.name).where(GalleryRow.name_key == name_key(name))
        ).first()
        if found is not None and found.number != besides:
            raise Duplicate(
                f"there is a gallery {found.name!r} already; choose another name", name=found.name
            )

    def _record(self, session: Session, row: GalleryRow) -> Gallery:
        mine = select(func.count(GestureRow.number.distinct())).where(
            GestureRow.gallery == row.number
        )
        newer = SampleRow.created_ms > row.created_ms
        taught = mine.join(SampleRow, SampleRow.gesture == GestureRow.number).where(newer)
        return Gallery(
            id=row.id,
            name=row.name,
            created=time_of(row.created_ms),
            gestures=session.scalar(mine) or 0,
            taught=session.scalar(taught) or 0,
        )
