"""Single samples: taken away, or given to another gesture."""

from sqlalchemy.orm import Session

from app.errors import Invalid, NotFound, RequestError
from app.gestures.history import History, Recorder
from app.gestures.putting import touch
from app.gestures.reading import row_of
from app.gestures.records import MAX_SAMPLES, Gesture
from app.gestures.rows import Kept, put_back
from app.gestures.tables import GestureRow, SampleRow
from app.gestures.transactions import Transactions


class LastSample(RequestError):
    """The only sample of a gesture was to be taken away."""

    default_code = "last_sample"
    status = 409


class Samples:
    """Single samples of one database; part of :class:`app.gestures.GestureStore`.

    ``undo_as`` is the id under which :meth:`GestureStore.undo` can take it back.
    """

    def __init__(self, base: Transactions, history: History) -> None:
        self._base = base
        self._history = history

    def remove(self, id: str, sample: str, *, undo_as: str | None = None) -> Gesture:
        """Forget one sample.

        Raises:
            NotFound: no gesture has this id, or it has no such sample.
            LastSample: it is the only one.
        """
        with self._history.recording("samples", undo_as) as seen, self._base.write() as session:
            row = self._row(session, seen, id)
            _take(row, sample)
            return seen.after(touch(self._base, session, row))

    def move(
        self, id: str, sample: str, to: str, *, undo_as: str | None = None
    ) -> tuple[Gesture, Gesture]:
        """Give a sample to another gesture of the same gallery; it keeps its id and time.

        Returns:
            Both gestures, the one that had it first.

        Raises:
            NotFound: no gesture has one of the ids, or there is no such sample.
            LastSample: it is the only one.
            Invalid: both are the same, or in different galleries, or the other one is full.
        """
        with self._history.recording("samples", undo_as) as seen, self._base.write() as session:
            row, other = self._row(session, seen, id), self._row(session, seen, to)
            if row is other or row.gallery != other.gallery:
                raise Invalid("move a sample to another gesture of the same gallery", field="to")
            if len(other.samples) >= MAX_SAMPLES:
                raise Invalid(f"{other.name} has {MAX_SAMPLES} samples, which is the most")
            found = _take(row, sample)
            session.flush()
            put_back(other, [found])
            first = seen.after(touch(self._base, session, row))
            return first, seen.after(touch(self._base, session, other))

    @staticmethod
    def _row(session: Session, seen: Recorder, id: str) -> GestureRow:
        row = row_of(session, id)
        seen.before(row)
        return row


def _take(row: GestureRow, id: str) -> Kept:
    """Remove a sample, and give it as it was."""
    sample: SampleRow | None = next((one for one in row.samples if one.id == id), None)
    if sample is None:
        raise NotFound(f"{row.name} has no sample with the id {id[:64]!r}", id=id[:64])
    if len(row.samples) == 1:
        raise LastSample(f"it is the only sample of {row.name}; delete or retire the gesture")
    landmarks = None if sample.landmarks is None else bytes(sample.landmarks)
    found = sample.id, bytes(sample.template), sample.created_ms, landmarks
    row.samples.remove(sample)
    return found
