"""A gesture database that is learned in a fraction of the time."""

from pathlib import Path

from app.gateway.gallery import starter_set
from app.gestures import GestureStore, NewGesture, read_set


def fill_small(path: Path, *names: str) -> None:
    """Make a database of the starter gestures, or of these, with two samples each."""
    starter = starter_set()
    assert starter is not None
    store = GestureStore(f"sqlite:///{path}", None)
    store.put_all(
        [
            NewGesture(entry.name, entry.action, entry.templates[:2])
            for entry in read_set(starter)
            if not names or entry.name in names
        ]
    )
    store.close()
