from pathlib import Path

import pytest

from app.errors import Duplicate, Invalid
from app.gestures import GestureStore, export_set, import_set
from app.link.actions import Home, Stop
from tests.gestures.conftest import STARTER, template, url


@pytest.fixture
def full(tmp_path: Path) -> GestureStore:
    store = GestureStore(url(tmp_path / "full.db"), STARTER)
    yield store
    store.close()


def contents(store: GestureStore) -> list[tuple[object, ...]]:
    return [
        (gesture.name, gesture.action, [sample.template for sample in gesture.samples])
        for gesture in store.list()
    ]


@pytest.mark.parametrize("name", ["set", "set.zip"])
def test_a_database_survives_the_way_out_and_in(
    tmp_path: Path, full: GestureStore, store: GestureStore, name: str
) -> None:
    full.create("\U0001f44b / <b> ../..", Home(), [template()])
    assert export_set(full, tmp_path / name) == 11
    assert len(import_set(store, tmp_path / name)) == 11
    assert contents(store) == contents(full)


def test_exporting_the_starter_set_gives_the_starter_set(
    tmp_path: Path, full: GestureStore
) -> None:
    export_set(full, tmp_path / "set")
    files = {p.relative_to(STARTER): p.read_bytes() for p in STARTER.rglob("*") if p.is_file()}
    for path, data in files.items():
        assert (tmp_path / "set" / path).read_bytes() == data
    assert len(files) == sum(p.is_file() for p in (tmp_path / "set").rglob("*"))


def test_one_taken_name_keeps_everything_out(store: GestureStore) -> None:
    mine = store.create("HOME", Stop(), [template()])
    with pytest.raises(Duplicate, match="there is a gesture 'HOME' already"):
        import_set(store, STARTER)
    assert store.list() == [mine]


def test_replacing_keeps_ids_and_other_gestures(store: GestureStore) -> None:
    other = store.create("my own", Stop(), [template(1)])
    mine = store.create("HOME", Stop(), [template(2)])
    import_set(store, STARTER, replace=True)
    assert store.get(other.id) == other
    replaced = store.get(mine.id)
    assert (replaced.name, replaced.action) == ("home", Home())
    assert template(2) not in [sample.template for sample in replaced.samples]
    assert len(store.list()) == 11


def test_a_bad_set_keeps_everything_out(tmp_path: Path, store: GestureStore) -> None:
    (tmp_path / "gestures.toml").write_text("format = 1\n[[gesture]]\nname = 'a'\n")
    with pytest.raises(Invalid):
        import_set(store, tmp_path)
    assert (store.list(), store.version) == ([], 0)
