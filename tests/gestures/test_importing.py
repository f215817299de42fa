"""A set into a gallery in which some names are taken: all of it, or nothing."""

import io
import zipfile

import pytest

from app.errors import ChangedMeanwhile, Invalid
from app.gestures import GestureStore, NewGesture
from app.gestures.exchange import entries_of
from app.gestures.importing import Existing, import_entries, plan_of
from app.gestures.records import MAX_GESTURES
from app.gestures.setfile import read_zip
from app.gestures.setwriter import zip_stream
from app.link.actions import Home, Stop
from tests.gestures.conftest import template
from tests.gestures.test_undo import seen, two

SET = [
    NewGesture("B", Home(), (template(5), template(6))),
    NewGesture("new", Stop(), (template(7),), active=False),
]


def fates(store: GestureStore, existing: Existing) -> list[tuple[str, str, int]]:
    there = store.list()
    steps = plan_of(there, [*SET, *entries_of(there[:1])], existing).steps
    return [(step.entry.name, step.fate, step.samples_now) for step in steps]


def test_what_would_happen_is_said(store: GestureStore) -> None:
    two(store)
    assert fates(store, "replace") == [("B", "replaced", 1), ("new", "new", 0), ("a", "same", 3)]
    assert fates(store, "skip") == [("B", "skipped", 1), ("new", "new", 0), ("a", "same", 3)]


@pytest.mark.parametrize("existing", ["replace", "skip"])
def test_what_was_said_is_done_and_can_be_taken_back(
    store: GestureStore, existing: Existing
) -> None:
    first, second = two(store)
    before = seen(store)
    told: list[tuple[int, int]] = []
    entries = [*SET, *entries_of([first])]
    expected = plan_of(store.list(), entries, existing)
    done = import_entries(
        store,
        entries,
        existing,
        expected=expected.digest,
        progress=lambda done, total: told.append((done, total)),
        undo_as="x",
    )
    assert done == expected
    total = 2 if existing == "replace" else 1
    assert told == [(number, total) for number in range(total + 1)]
    assert store.get(first.id) == first
    b = store.get(second.id)
    if existing == "replace":
        assert (b.name, b.action, b.version) == ("B", Home(), 2)
        assert tuple(one.template for one in b.samples) == SET[0].templates
    else:
        assert b == second
    assert not store.list()[-1].active
    store.undo("x", undo_as="y")
    assert seen(store) == before
    store.undo("y")
    assert entries_of(store.list())[-1] == SET[-1]


def test_one_that_is_cancelled_in_the_middle_changes_nothing(store: GestureStore) -> None:
    two(store)
    before, version = seen(store), store.version

    class Enough(Exception):
        pass

    def progress(done: int, total: int) -> None:
        if done == 1:
            raise Enough

    with pytest.raises(Enough):
        import_entries(store, SET, "replace", progress=progress, undo_as="x")
    assert (seen(store), store.version) == (before, version)
    assert not store.history.knows("x")
    store.create("free to write", Home(), [template()])


def test_another_effect_than_the_one_that_was_shown_is_refused(store: GestureStore) -> None:
    first, _ = two(store)
    shown = plan_of(store.list(), SET, "replace").digest
    assert plan_of(store.list(), SET[:1], "replace").digest != shown
    assert plan_of(store.list(), SET, "skip").digest != shown
    store.update(first.id, name="new")
    with pytest.raises(ChangedMeanwhile, match="look at it again"):
        import_entries(store, SET, "replace", expected=shown)
    assert [one.name for one in store.list()] == ["new", "b"]


def test_too_many_gestures_change_nothing(store: GestureStore) -> None:
    two(store)
    before = seen(store)
    many = [NewGesture(f"g{n}", Home(), (template(n),)) for n in range(MAX_GESTURES - 1)]
    with pytest.raises(Invalid, match="there would be 501 gestures"):
        import_entries(store, many, "skip", undo_as="x")
    assert seen(store) == before


def test_a_stream_is_a_zip_file_that_gives_the_same_gestures(store: GestureStore) -> None:
    two(store)
    entries = [*entries_of(store.list()), SET[1]]
    pieces = list(zip_stream(entries))
    assert len(pieces) == len(entries) + 1
    data = b"".join(pieces)
    assert data == b"".join(zip_stream(entries))
    told: list[tuple[int, int]] = []
    assert read_zip(data, lambda done, total: told.append((done, total))) == entries
    assert told == [(1, 3), (2, 3), (3, 3)]
    assert read_zip(b"".join(zip_stream([]))) == []
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert archive.testzip() is None


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "the file is neither a readable folder nor a readable zip file"),
        (b"PK not one", "the file is neither a readable folder nor a readable zip file"),
        (b"".join(zip_stream(SET))[:-40], "neither a readable folder nor a readable zip file"),
    ],
)
def test_a_file_that_is_no_set_is_refused(data: bytes, message: str) -> None:
    with pytest.raises(Invalid, match=message):
        read_zip(data)
