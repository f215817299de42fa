"""Gestures into the tables, within a transaction."""

from collections.abc import Callable, Sequence

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from app.errors import Duplicate, Invalid
from app.gestures.history import Recorder
from app.gestures.reading import read_gesture
from app.gestures.records import MAX_GESTURES, Gesture, NewGesture, name_key
from app.gestures.rows import append, new_id, now_ms, seal_gesture
from app.gestures.tables import GalleryRow, GestureRow
from app.gestures.transactions import Transactions
from app.gestures.versions import set_action


def put(
    base: Transactions,
    session: Session,
    home: GalleryRow,
    entries: Sequence[NewGesture],
    seen: Recorder,
    *,
    replace: bool,
    progress: Callable[[int], None] | None = None,
) -> list[Gesture]:
    """Enrol gestures in a gallery; with ``replace`` over those of the same names.

    Args:
        base: The database.
        session: With a transaction for writing.
        home: The gallery.
        entries: What to enrol.
        seen: Writes down what changes.
        replace: Whether a gesture whose name is taken gets the new action and samples.
        progress: Told how many are done; what it raises ends the transaction.

    Raises:
        Duplicate: a name is taken, and ``replace`` is off.
        Invalid: there would be too many gestures, or samples of one.
    """
    rows = []
    now = teaching_ms(home)
    for entry in entries:
        row = session.scalar(
            select(GestureRow).where(
                GestureRow.gallery == home.number, GestureRow.name_key == name_key(entry.name)
            )
        )
        if row is None:
            row = new_gesture(home, now)
            session.add(row)
        elif not replace:
            check_free(session, home.number, entry.name)
        else:
            seen.before(row)
        row.name, row.name_key = entry.name, name_key(entry.name)
        set_action(row, entry.action, now)
        row.active = entry.active
        row.samples.clear()
        append(row, entry.templates, now, entry.landmarks)
        row.updated_ms = now
        seal_gesture(row)
        session.flush()
        rows.append(row)
        if progress is not None:
            progress(len(rows))
    check_count(session, home)
    base.rise(session)
    return [seen.after(read_gesture(base, row)) for row in rows]


def check_count(session: Session, home: GalleryRow) -> None:
    """Refuse what makes a gallery too large.

    Raises:
        Invalid: there would be too many gestures.
    """
    count = session.scalar(
        select(func.count()).select_from(GestureRow).where(GestureRow.gallery == home.number)
    )
    if count is not None and count > MAX_GESTURES:
        raise Invalid(f"there would be {count} gestures; at most {MAX_GESTURES} are allowed")


def touch(base: Transactions, session: Session, row: GestureRow) -> Gesture:
    """A gesture was changed: seal it, count the change, and read it back."""
    row.updated_ms = now_ms()
    seal_gesture(row)
    base.rise(session)
    return read_gesture(base, row)


def new_gesture(home: GalleryRow, created_ms: int) -> GestureRow:
    """A row of a gallery that has neither name, action nor samples yet."""
    return GestureRow(
        id=new_id(), gallery=home.number, created_ms=created_ms, version=0, samples=[], versions=[]
    )


def teaching_ms(home: GalleryRow) -> int:
    """Now, and newer than the gallery even if the clock was set back."""
    return max(now_ms(), home.created_ms + 1)


def check_free(session: Session, gallery: int, name: str, besides: int | None = None) -> None:
    """Refuse a name that another gesture of the gallery has; ``besides`` is the gesture's own.

    Raises:
        Duplicate: the name is taken, upper and lower case being the same.
    """
    found = session.execute(
        select(GestureRow.number, GestureRow.name).where(
            GestureRow.gallery == gallery, GestureRow.name_key == name_key(name)
        )
    ).first()
    if found is not None and found.number != besides:
        raise Duplicate(
            f"there is a gesture {found.name!r} already; choose another name", name=found.name
        )
