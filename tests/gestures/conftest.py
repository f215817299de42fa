import contextlib
import sqlite3
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from app.gestures import GestureStore
from app.gestures.backup import Place
from app.link.actions import Home

STARTER = Path(__file__).parents[2] / "gesture_db"


def template(seed: int = 0) -> bytes:
    """Some template: a filled ellipse whose place depends on the seed."""
    rows, columns = np.mgrid[0:80, 0:60]
    generator = np.random.default_rng(seed)
    row, column = generator.integers(25, 55), generator.integers(20, 40)
    high, wide = generator.integers(10, 25), generator.integers(8, 20)
    inside = ((rows - row) / high) ** 2 + ((columns - column) / wide) ** 2 < 1
    return np.packbits(inside).tobytes()


def url(path: Path) -> str:
    return f"sqlite:///{path}"


def execute(path: Path, *statements: str) -> None:
    """Change a database behind the store's back."""
    connection = sqlite3.connect(path)
    with connection:
        for statement in statements:
            connection.execute(statement)
    connection.close()


@pytest.fixture
def store(tmp_path: Path) -> Iterator[GestureStore]:
    store = GestureStore(url(tmp_path / "farhand.db"), None)
    yield store
    store.close()


@pytest.fixture
def place(tmp_path: Path) -> Place:
    """A folder for a database and its backups."""
    return Place(tmp_path / "gestures.db", tmp_path / "backups")


def enrol(place: Place, *names: str) -> None:
    """Enrol gestures, and close the database again."""
    with contextlib.closing(GestureStore(url(place.database), None)) as store:
        for number, name in enumerate(names):
            store.create(name, Home(), [template(number)])
