"""What is told of the gestures: the difference between two outlines of the database."""

from pathlib import Path
from typing import Any

import pytest

from app.gateway.diary.gestures import differences
from app.gestures import GestureStore
from app.gestures.outline import outline
from app.link.actions import Home, Stop
from tests.gestures.conftest import template, url


@pytest.fixture
def store(tmp_path: Path) -> Any:
    made = GestureStore(url(tmp_path / "gestures.db"), None)
    yield made
    made.close()


class Looks:
    def __init__(self, store: GestureStore) -> None:
        self._store = store
        self._before = outline(store.base)

    def __call__(self) -> list[dict[str, Any]]:
        now = outline(self._store.base)
        changes = list(differences(self._before, now))
        self._before = now
        return [{"kind": change.kind, **change.data} for change in changes]


def test_each_change_is_told_and_nothing_else(store: GestureStore) -> None:
    looks = Looks(store)
    assert looks() == []
    wave = store.create("wave", Home(), [template(1)])
    of_wave = {"gesture": "wave", "gallery": "shared"}
    assert looks() == [{"kind": "enrolled", **of_wave}]
    store.update(wave.id, action=Home())  # the same again
    assert looks() == []
    store.update(wave.id, action=Stop())
    assert looks() == [{"kind": "changed", **of_wave, "what": ["action"]}]
    store.add_samples(wave.id, [template(2)])
    assert looks() == [{"kind": "changed", **of_wave, "what": ["samples"]}]
    # As many as before, but others.
    store.add_samples(wave.id, [template(3), template(4)], replace=True)
    assert looks() == [{"kind": "changed", **of_wave, "what": ["samples"]}]
    store.update(wave.id, active=False)
    assert looks() == [{"kind": "retired", **of_wave, "how": "inactive"}]
    store.update(wave.id, active=True, name="greet")
    greet = {"gesture": "greet", "gallery": "shared"}
    assert looks() == [{"kind": "changed", **greet, "what": ["name", "active"]}]
    store.delete(wave.id)
    assert looks() == [{"kind": "retired", **greet, "how": "deleted"}]


def test_a_gallery_is_one_change_whatever_it_holds(store: GestureStore) -> None:
    for number in range(3):
        store.create(f"gesture {number}", Home(), [template(number)])
    looks = Looks(store)
    ann = store.galleries.create("Ann")
    assert looks() == [{"kind": "gallery", "gallery": ann.id, "what": "made", "gestures": 3}]
    mine = store.list(ann.id)[0]
    store.add_samples(mine.id, [template(9)])
    (changed,) = looks()
    assert changed["gallery"] == ann.id
    store.galleries.rename(ann.id, "Anna")
    assert looks() == []
    store.galleries.delete(ann.id)
    assert looks() == [{"kind": "gallery", "gallery": ann.id, "what": "deleted"}]
