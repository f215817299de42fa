"""Taking gestures out of a database, and into it, in the exchange format of setfile.py."""

from collections.abc import Iterable
from pathlib import Path

from app.gestures.records import SHARED, Gesture, NewGesture, check_landmarks
from app.gestures.setfile import read_set
from app.gestures.setwriter import write_set
from app.gestures.store import GestureStore


def export_set(store: GestureStore, target: Path, gallery: str = SHARED) -> int:
    """Write all gestures of a gallery to a new folder, or file when ``target`` ends in ``.zip``.

    Returns:
        How many gestures were written.

    Raises:
        NotFound: no gallery has this id.
        Invalid: the target exists and is not an empty folder.
    """
    gestures = entries_of(store.list(gallery))
    write_set(gestures, target)
    return len(gestures)


def entries_of(gestures: Iterable[Gesture]) -> list[NewGesture]:
    """Gestures as a set holds them: without ids and times."""
    return [
        NewGesture(
            gesture.name,
            gesture.action,
            tuple(sample.template for sample in gesture.samples),
            gesture.active,
            check_landmarks(
                [sample.landmarks for sample in gesture.samples],
                [sample.template for sample in gesture.samples],
            ),
        )
        for gesture in gestures
    ]


def import_set(
    store: GestureStore, source: Path, replace: bool = False, gallery: str = SHARED
) -> list[Gesture]:
    """Take all gestures of a folder or zip file into a database: all of them, or none.

    Args:
        store: Where to.
        source: A set in the exchange format.
        replace: Gestures whose names are taken get the set's action and samples and keep their
            ids; gestures that are not in the set stay as they are.
        gallery: Id of the gallery that they are to belong to.

    Raises:
        NotFound: no gallery has this id.
        Invalid: the set is not exactly in the format.
        Duplicate: a name is taken, and ``replace`` is off.
    """
    return store.put_all(read_set(source), replace=replace, gallery=gallery)
