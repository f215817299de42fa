"""Taking a change back: everything that it touched becomes what it was."""

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.errors import ChangedMeanwhile
from app.gestures.galleries import Galleries
from app.gestures.history import Change, History, Recorder, Snapshot, state_of
from app.gestures.putting import check_count, check_free, new_gesture
from app.gestures.reading import read_gesture
from app.gestures.records import Gesture, name_key
from app.gestures.rows import ms_of, now_ms, put_back, seal_gesture
from app.gestures.tables import GalleryRow, GestureRow
from app.gestures.transactions import Transactions
from app.gestures.versions import keep, set_action


def undo(
    base: Transactions, galleries: Galleries, history: History, id: str, undo_as: str | None
) -> list[Gesture]:
    """Take a change back, whole or not at all.

    Names, states, samples (with their ids, times and order) and deleted gestures come back to the
    bit. An action comes back as a new version, as :meth:`GestureStore.restore` does it, so that
    versions always rise and nothing of them is lost.

    Args:
        base: The database.
        galleries: Its galleries.
        history: Where the change was kept.
        id: Of the change.
        undo_as: Id under which this can be undone in its turn.

    Returns:
        The gestures that are there again or as they were.

    Raises:
        NotFound: the change cannot be undone any more, or its gallery is gone.
        ChangedMeanwhile: one of its gestures has been changed since.
        Duplicate: a name that it had is taken now.
        Invalid: there would be too many gestures.
        StorageFull: no space is left; nothing was changed.
    """
    change = history.get(id)
    with history.recording("undo", undo_as) as seen, base.write() as session:
        home = galleries.row(session, change.gallery)
        rows = _as_it_left_them(base, session, change)
        for row in rows.values():
            seen.before(row)
        for gone in rows.keys() - change.before.keys():
            session.delete(rows.pop(gone))
        for row in rows.values():
            # First of all away, so that what moves from one to another meets nothing of its own id.
            row.samples.clear()
        session.flush()
        snapshots = sorted(change.before.values(), key=lambda snapshot: snapshot.number)
        found = [
            _restored(base, session, home, seen, rows.get(snapshot.gesture.id), snapshot)
            for snapshot in snapshots
        ]
        check_count(session, home)
        base.rise(session)
    history.forget(id)
    return found


def _as_it_left_them(base: Transactions, session: Session, change: Change) -> dict[str, GestureRow]:
    """The rows that are there, by id.

    Raises:
        ChangedMeanwhile: one is not as the change left it.
    """
    rows = {}
    for id, left in change.left.items():
        row = session.scalar(select(GestureRow).where(GestureRow.id == id))
        now = None if row is None else state_of(read_gesture(base, row))
        if now != left:
            name = change.before[id].gesture.name if id in change.before else ""
            name = row.name if row is not None else name or "the gesture"
            raise ChangedMeanwhile(
                f"{name} has been changed since; take the later change back first", gesture=id
            )
        if row is not None:
            rows[id] = row
    return rows


def _restored(
    base: Transactions,
    session: Session,
    home: GalleryRow,
    seen: Recorder,
    row: GestureRow | None,
    snapshot: Snapshot,
) -> Gesture:
    was, now = snapshot.gesture, now_ms()
    check_free(session, home.number, was.name, besides=None if row is None else row.number)
    if row is None:
        row = _born_again(session, home, snapshot)
    row.name, row.name_key, row.active = was.name, name_key(was.name), was.active
    set_action(row, was.action, now)
    put_back(
        row, [(one.id, one.template, ms_of(one.created), one.landmarks) for one in was.samples]
    )
    row.updated_ms = now
    seal_gesture(row)
    session.flush()
    return seen.after(read_gesture(base, row))


def _born_again(session: Session, home: GalleryRow, snapshot: Snapshot) -> GestureRow:
    """A row for a gesture that was deleted, where it stood in the list if that place is free."""
    row = new_gesture(home, ms_of(snapshot.gesture.created))
    row.id = snapshot.gesture.id
    if session.get(GestureRow, snapshot.number) is None:
        row.number = snapshot.number
    keep(row, snapshot.versions)
    session.add(row)
    return row
