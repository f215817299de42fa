"""What was changed is taken back, to the bit."""

from collections.abc import Callable
from pathlib import Path

import pytest

from app.errors import ChangedMeanwhile, Duplicate, Invalid, NotFound
from app.gestures import Gesture, GestureStore, history
from app.gestures.samples import LastSample
from app.link.actions import Gripper, Home, Stop
from tests.gestures.conftest import template, url

Change = Callable[[GestureStore, Gesture, Gesture], object]


def seen(store: GestureStore, gallery: str = "shared") -> list[object]:
    """All that one can see of a gallery's gestures, but when they changed and how often."""
    return [
        (one.id, one.name, one.action, one.active, one.created, one.taught, one.samples)
        for one in store.list(gallery)
    ]


def two(store: GestureStore) -> tuple[Gesture, Gesture]:
    first = store.create("a", Home(), [template(1), template(2), template(3)])
    return first, store.create("b", Stop(), [template(4)])


CHANGES: dict[str, Change] = {
    "rename": lambda store, a, b: store.update(a.id, name="c", undo_as="x"),
    "retire": lambda store, a, b: store.update(a.id, active=False, undo_as="x"),
    "action": lambda store, a, b: store.update(a.id, action=Gripper(width=0.0), undo_as="x"),
    "all": lambda store, a, b: store.update(
        a.id, name="c", action=Stop(), active=False, undo_as="x"
    ),
    "sample deleted": lambda store, a, b: store.samples.remove(a.id, a.samples[1].id, undo_as="x"),
    "sample moved": lambda store, a, b: store.samples.move(
        a.id, a.samples[0].id, b.id, undo_as="x"
    ),
    "samples added": lambda store, a, b: store.add_samples(a.id, [template(9)], undo_as="x"),
    "samples replaced": lambda store, a, b: store.add_samples(
        a.id, [template(9)], replace=True, undo_as="x"
    ),
    "deleted": lambda store, a, b: store.delete(a.id, undo_as="x"),
    "the last one deleted": lambda store, a, b: store.delete(b.id, undo_as="x"),
    "enrolled": lambda store, a, b: store.create("c", Home(), [template(9)], undo_as="x"),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_undo_brings_back_what_was_there_and_undoing_that_the_change(
    store: GestureStore, change: Change
) -> None:
    first, second = two(store)
    before = seen(store)
    change(store, first, second)
    after = seen(store)
    assert after != before
    version = store.version
    store.undo("x", undo_as="y")
    assert seen(store) == before
    assert store.version > version
    store.undo("y")
    assert seen(store) == after
    store.check()


def test_what_was_undone_is_still_there_after_a_restart(tmp_path: Path) -> None:
    path = tmp_path / "x.db"
    store = GestureStore(url(path), None)
    first, second = two(store)
    before = seen(store)
    store.delete(first.id, undo_as="x")
    store.undo("x")
    store.close()
    store = GestureStore(url(path), None)
    assert seen(store) == before
    assert [one.version for one in store.versions(first.id)] == [1]
    store.close()
    assert second.id


def test_an_action_comes_back_as_a_new_version_and_a_deleted_gesture_with_all_it_had(
    store: GestureStore,
) -> None:
    first, _ = two(store)
    store.update(first.id, action=Stop(), undo_as="x")
    assert store.undo("x")[0].version == 3
    assert [one.action for one in store.versions(first.id)] == [Home(), Stop(), Home()]
    versions = store.versions(first.id)
    store.delete(first.id, undo_as="y")
    store.undo("y")
    assert store.versions(first.id) == versions
    # Also where it stood in the list is taken: it goes to the end then.
    last = store.list()[-1]
    store.delete(last.id, undo_as="z")
    store.create("c", Home(), [template(9)])
    store.undo("z")
    assert [one.name for one in store.list()] == ["a", "c", "b"]


def test_a_sample_is_taken_back_into_the_middle_with_its_id_and_time(store: GestureStore) -> None:
    first, second = two(store)
    moved = store.samples.move(first.id, first.samples[1].id, second.id, undo_as="x")
    assert [len(one.samples) for one in moved] == [2, 2]
    assert moved[1].samples[-1] == first.samples[1]
    store.undo("x")
    assert store.get(first.id).samples == first.samples
    assert store.get(second.id).samples == second.samples


def test_what_was_changed_since_is_not_undone(store: GestureStore) -> None:
    first, second = two(store)
    store.update(first.id, name="c", undo_as="x")
    store.add_samples(first.id, [template(8)], undo_as="y")
    before = seen(store)
    with pytest.raises(ChangedMeanwhile, match="c has been changed since; take the later change"):
        store.undo("x")
    assert seen(store) == before
    # In the opposite order it goes; other gestures do not matter.
    store.update(second.id, active=False)
    store.undo("y")
    assert store.undo("x")[0].name == "a"
    with pytest.raises(NotFound, match="cannot be taken back any more"):
        store.undo("x")
    store.delete(first.id, undo_as="z")
    store.create("A", Home(), [template(5)])
    with pytest.raises(Duplicate, match="there is a gesture 'A' already"):
        store.undo("z")
    assert store.history.knows("z")


def test_undo_knows_no_gallery_that_is_gone(store: GestureStore) -> None:
    two(store)
    ann = store.galleries.create("Ann").id
    copy = store.list(ann)[0]
    store.delete(copy.id, undo_as="x")
    store.galleries.delete(ann)
    with pytest.raises(NotFound, match="no gallery with the id"):
        store.undo("x")


def test_nothing_is_kept_of_a_change_that_failed_or_that_nobody_may_undo(
    store: GestureStore,
) -> None:
    first, second = two(store)
    store.update(first.id, name="c")
    with pytest.raises(Duplicate):
        store.update(first.id, name="b", undo_as="x")
    with pytest.raises(NotFound):
        store.restore(first.id, 7, undo_as="x")
    with pytest.raises(LastSample, match="it is the only sample of b"):
        store.samples.remove(second.id, second.samples[0].id, undo_as="x")
    with pytest.raises(LastSample):
        store.samples.move(second.id, second.samples[0].id, first.id, undo_as="x")
    with pytest.raises(NotFound, match="c has no sample with the id"):
        store.samples.remove(first.id, "nobody", undo_as="x")
    for other in (first.id, store.list(store.galleries.create("Ann").id)[0].id):
        with pytest.raises(Invalid, match="another gesture of the same gallery"):
            store.samples.move(first.id, first.samples[0].id, other, undo_as="x")
    assert not store.history.knows("x")


def test_the_oldest_changes_are_forgotten(
    store: GestureStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, _ = two(store)
    monkeypatch.setattr(history, "MAX_CHANGES", 3)
    for number in range(5):
        store.update(first.id, name=f"n{number}", undo_as=str(number))
    assert [store.history.knows(str(number)) for number in range(5)] == [False] * 2 + [True] * 3
    # A change that is too large alone pushes nothing else out.
    monkeypatch.setattr(history, "MAX_BYTES", 0)
    store.update(first.id, name="large", undo_as="large")
    assert not store.history.knows("large")
    assert store.history.knows("4")
