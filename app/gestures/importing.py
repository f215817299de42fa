"""Taking a set into a gallery in which some of its names are taken."""

import hashlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from app.errors import ChangedMeanwhile
from app.gestures.exchange import entries_of
from app.gestures.putting import put
from app.gestures.reading import read_all
from app.gestures.records import SHARED, Gesture, NewGesture, name_key
from app.gestures.store import GestureStore
from app.link.actions import ACTION

Existing = Literal["replace", "skip"]
"""What becomes of a gesture whose name is taken: the set's wins, or the one that is there."""
Fate = Literal["new", "replaced", "skipped", "same"]
"""``same``: it is there already, with the same action and samples; nothing is done."""


class Step(NamedTuple):
    """What becomes of one gesture of a set."""

    entry: NewGesture
    fate: Fate
    samples_now: int
    """Samples of the gesture that is there; 0: none is."""


@dataclass(frozen=True)
class Plan:
    """What importing a set would do, in the set's order."""

    steps: tuple[Step, ...]

    @property
    def entries(self) -> list[NewGesture]:
        """What is to be written."""
        return [step.entry for step in self.steps if step.fate in ("new", "replaced")]

    @property
    def digest(self) -> str:
        """The same for the same set with the same effect, and only then."""
        digest = hashlib.sha256()
        for entry, fate, samples_now in self.steps:
            said = (entry.name, ACTION.dump_json(entry.action), entry.active, fate, samples_now)
            digest.update(repr(said).encode())
            for template in entry.templates:
                digest.update(template)
            for landmarks in entry.landmarks:
                digest.update(landmarks or b"-")
        return digest.hexdigest()[:32]

    def after(self, there: Iterable[Gesture]) -> list[tuple[str, bytes, bytes | None]]:
        """Every active sample, as the store gives them, of a gallery that holds ``there``."""
        written = {name_key(entry.name): entry for entry in self.entries}
        kept = entries_of(one for one in there if name_key(one.name) not in written)
        return [
            (entry.name, template, hand)
            for entry in (*kept, *written.values())
            if entry.active
            for template, hand in zip(
                entry.templates, entry.landmarks or [None] * len(entry.templates), strict=True
            )
        ]


def plan_of(there: Iterable[Gesture], entries: Sequence[NewGesture], existing: Existing) -> Plan:
    """Say what importing would do to a gallery that holds ``there``."""
    taken = {name_key(gesture.name): gesture for gesture in there}
    steps = []
    for entry in entries:
        found = taken.get(name_key(entry.name))
        fate: Fate = "new"
        if found is not None:
            (now,) = entries_of([found])
            fate = "same" if now == entry else "replaced" if existing == "replace" else "skipped"
        steps.append(Step(entry, fate, 0 if found is None else len(found.samples)))
    return Plan(tuple(steps))


def import_entries(
    store: GestureStore,
    entries: Sequence[NewGesture],
    existing: Existing,
    *,
    gallery: str = SHARED,
    expected: str | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
    undo_as: str | None = None,
) -> Plan:
    """Take a set into a gallery: whole or not at all.

    Args:
        store: Where to.
        entries: The set, as :func:`app.gestures.setfile.read_zip` gives it.
        existing: What becomes of gestures whose names are taken. Those that are not in the set stay
            as they are.
        gallery: Id of the gallery.
        expected: :attr:`Plan.digest` of what the caller was shown; None: whatever it does.
        progress: Told how many gestures are written, of how many; what it raises undoes all.
        undo_as: Id under which :meth:`GestureStore.undo` can take all of it back.

    Returns:
        What was done.

    Raises:
        NotFound: no gallery has this id.
        ChangedMeanwhile: it would do something else than ``expected``.
        Invalid: there would be too many gestures.
        StorageFull: no space is left; nothing was changed.
    """
    base = store.base
    with store.history.recording("import", undo_as) as seen, base.write() as session:
        home = store.galleries.row(session, gallery)
        found = plan_of(read_all(base, session, home), entries, existing)
        if expected is not None and found.digest != expected:
            raise ChangedMeanwhile(
                "the gallery or the file was changed meanwhile, and importing would do something "
                "else now; look at it again"
            )
        wanted = found.entries
        if wanted:
            progress(0, len(wanted))
            put(
                base, session, home, wanted, seen, replace=True,
                progress=lambda done: progress(done, len(wanted)),
            )  # fmt: skip
    return found
