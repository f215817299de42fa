"""What changed lately, kept so that it can be undone."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Literal

from app.errors import NotFound
from app.gestures.reading import read_gesture
from app.gestures.records import Gesture
from app.gestures.tables import GestureRow
from app.gestures.transactions import Transactions
from app.gestures.versions import Kept, version_of

MAX_CHANGES = 200
"""That can be undone, of all galleries; the oldest are forgotten."""
MAX_BYTES = 64 << 20
"""What they may hold in all. A change that is larger alone cannot be undone."""

Kind = Literal["enrol", "change", "samples", "delete", "import", "undo"]


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A gesture as it was."""

    gesture: Gesture
    number: int
    """Its place in the list."""
    versions: tuple[Kept, ...]

    @property
    def bytes(self) -> int:
        """About what it holds in memory."""
        samples = sum(
            len(sample.template) + len(sample.landmarks or b"") + 200
            for sample in self.gesture.samples
        )
        return samples + 1000 * (1 + len(self.versions))


State = tuple[str, object, bool, tuple[str, ...]] | None
"""What undoing goes by: name, action, whether active, the samples' ids; None: it is gone."""


def state_of(gesture: Gesture) -> State:
    """What somebody can see of a gesture, so that a later change of it shows."""
    ids = tuple(sample.id for sample in gesture.samples)
    return gesture.name, gesture.action, gesture.active, ids


@dataclass
class Change:
    """One change of one gallery, as it is being made and when it is done.

    Attributes:
        id: To undo it by.
        kind: What was done.
        gallery: Id of the gallery.
        before: The gestures that it changed or deleted.
        left: How it left each gesture, by id; None: deleted.
    """

    id: str
    kind: Kind
    gallery: str = ""
    before: dict[str, Snapshot] = field(default_factory=dict)
    left: dict[str, State] = field(default_factory=dict)

    @property
    def bytes(self) -> int:
        """About what it holds in memory."""
        return sum(snapshot.bytes for snapshot in self.before.values())


class Recorder:
    """Writes down one change while its transaction runs; nothing where nobody may undo it."""

    def __init__(self, base: Transactions, change: Change | None) -> None:
        self._base = base
        self.change = change

    def before(self, row: GestureRow) -> None:
        """A gesture is about to be changed or deleted.

        Raises:
            DatabaseBroken: it is not as it was written.
        """
        if self.change is None or row.id in self.change.before:
            return
        gesture = read_gesture(self._base, row)
        try:
            versions = tuple(version_of(kept) for kept in row.versions)
        except ValueError as error:
            raise self._base.damaged(f"gesture {row.name!r}") from error
        self.change.gallery = gesture.gallery
        self.change.before[row.id] = Snapshot(gesture, row.number, versions)
        self.change.left[row.id] = None

    def after(self, gesture: Gesture) -> Gesture:
        """A gesture was changed or made; gives it back."""
        if self.change is not None:
            self.change.gallery = gesture.gallery
            self.change.left[gesture.id] = state_of(gesture)
        return gesture


class History:
    """The newest changes that were made through one store, by id. Safe to use from any thread.

    In memory: it ends with the process, where the backups begin.
    """

    def __init__(self, base: Transactions) -> None:
        self._base = base
        self._lock = threading.Lock()
        self._changes: dict[str, Change] = {}

    @contextmanager
    def recording(self, kind: Kind, id: str | None) -> Iterator[Recorder]:
        """Around the transaction of a change: once that is made, it can be undone.

        Args:
            kind: What is done.
            id: To undo it by; None keeps nothing.
        """
        recorder = Recorder(self._base, None if id is None else Change(id, kind))
        yield recorder
        if recorder.change is not None and recorder.change.left:
            self._keep(recorder.change)

    def get(self, id: str) -> Change:
        """A change that can be undone.

        Raises:
            NotFound: it cannot, or not any more.
        """
        with self._lock:
            change = self._changes.get(id)
        if change is None:
            raise NotFound(
                "this cannot be taken back any more: it was, or too much has changed since, or the "
                "server was started anew",
                id=id[:64],
            )
        return change

    def knows(self, id: str) -> bool:
        """Whether a change can be undone."""
        with self._lock:
            return id in self._changes

    def forget(self, id: str) -> None:
        """A change was undone."""
        with self._lock:
            self._changes.pop(id, None)

    def _keep(self, change: Change) -> None:
        with self._lock:
            if change.bytes > MAX_BYTES:
                return
            self._changes[change.id] = change
            while (
                len(self._changes) > MAX_CHANGES
                or sum(one.bytes for one in self._changes.values()) > MAX_BYTES
            ):
                del self._changes[next(iter(self._changes))]
