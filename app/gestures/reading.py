"""Gestures out of the tables, within a transaction; what was damaged on the disk is an error."""

from sqlalchemy import select
from sqlalchemy.orm import Session, selectinload

from app.errors import NotFound
from app.gestures.records import ActionVersion, Gesture
from app.gestures.rows import gesture_of, time_of
from app.gestures.tables import GalleryRow, GestureRow
from app.gestures.transactions import Transactions
from app.gestures.versions import version_of


def read_all(base: Transactions, session: Session, gallery: GalleryRow) -> list[Gesture]:
    """All gestures of a gallery, in the order in which they were made.

    Raises:
        DatabaseBroken: one is not as it was written.
    """
    rows = session.scalars(
        select(GestureRow)
        .where(GestureRow.gallery == gallery.number)
        .order_by(GestureRow.number)
        .options(selectinload(GestureRow.samples))
    )
    return [read_gesture(base, row) for row in rows]


def row_of(session: Session, id: str) -> GestureRow:
    """The row of a gesture.

    Raises:
        NotFound: no gesture has this id.
    """
    row = session.scalar(select(GestureRow).where(GestureRow.id == id))
    if row is None:
        raise NotFound(f"there is no gesture with the id {id[:64]!r}", id=id[:64])
    return row


def read_gesture(base: Transactions, row: GestureRow) -> Gesture:
    """One gesture.

    Raises:
        DatabaseBroken: it is not as it was written.
    """
    try:
        return gesture_of(row)
    except (ValueError, TypeError, AttributeError) as error:
        raise base.damaged(f"gesture {row.name!r}") from error


def read_version(base: Transactions, row: GestureRow, index: int) -> ActionVersion:
    """An action that a gesture has or had, counted from 0, the oldest first.

    Raises:
        DatabaseBroken: it is not as it was written.
    """
    try:
        found = version_of(row.versions[index])
    except ValueError as error:
        raise base.damaged(f"gesture {row.name!r}") from error
    return ActionVersion(found.version, found.action, time_of(found.created_ms))
