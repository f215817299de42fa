"""The matchers of all galleries in use, as the sessions have them."""

import asyncio
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from app.config import PipelineSettings
from app.errors import DatabaseBroken, NotFound
from app.gateway.gallery import (
    DATABASE_FILE,
    SPARE,
    LiveGallery,
    build_matcher,
    starter_set,
    with_starter,
)
from app.gateway.gallery_choice import GalleryChoice
from app.gateway.learning import fit
from app.gestures import GestureStore
from app.gestures.importing import import_entries, plan_of
from app.gestures.records import SHARED, NewGesture
from app.gestures.setfile import read_set
from app.link.actions import Home, Stop
from app.pipeline import PcaMatcher, extract_template, pack_template

SETTINGS = PipelineSettings()


@pytest.fixture
def store(folder: Path) -> Iterator[GestureStore]:
    store = GestureStore(f"sqlite:///{folder / 'data' / DATABASE_FILE}", None)
    # Few gestures: what is held here does not depend on how many there are.
    for gesture in store.list():
        if gesture.name not in ("forward", "up", "stop"):
            store.delete(gesture.id)
    yield store
    store.close()


@pytest.fixture
def live(store: GestureStore) -> LiveGallery:
    return LiveGallery(store, SETTINGS)


def test_a_gallery_is_fitted_when_it_is_asked_for(store: GestureStore, live: LiveGallery) -> None:
    ann = store.galleries.create("Ann").id
    (forward, *_) = store.list(ann)
    store.update(forward.id, name="hello", action=Stop())
    assert live.refresh()
    assert live.known(ann) is None and live.fitted == 1
    enrolled = live.of(ann)
    assert live.of(ann) is live.known(ann) is enrolled
    assert (enrolled.gallery, live.current.gallery) == (ann, SHARED)
    assert enrolled.actions["hello"] == Stop() and "forward" not in enrolled.actions
    assert "hello" in enrolled.matcher.labels
    assert "forward" in live.current.matcher.labels
    with pytest.raises(NotFound, match="no gallery with the id 'nobody'"):
        live.of("nobody")


def test_what_was_prepared_is_not_learned_again(
    store: GestureStore, live: LiveGallery, monkeypatch: pytest.MonkeyPatch
) -> None:
    there = store.list()
    entries = [
        NewGesture("more", Home(), (there[0].samples[0].template,)),
        NewGesture("UP", Home(), (there[1].samples[0].template,)),
        NewGesture("hidden", Home(), (bytes(300) + b"\xff" * 300,), active=False),
    ]
    samples = with_starter(plan_of(there, entries, "replace").after(there))
    told: list[tuple[int, int]] = []
    live.prepared(samples, fit(samples, SETTINGS, lambda done, total: told.append((done, total))))
    assert told == [(done, len(samples)) for done in range(len(samples))]

    def again(*_: object) -> None:
        raise AssertionError("learned again")

    with monkeypatch.context() as patched:
        patched.setattr(PcaMatcher, "fit", again)
        import_entries(store, entries, "replace")
        assert live.refresh()
    assert set(live.current.matcher.labels) == {"forward", "stop", "more", "UP"}
    assert sorted(store.templates()) == sorted((name, bits) for name, bits, _ in samples)
    # Something else than what was prepared is learned.
    store.create("other", Home(), [there[0].samples[0].template])
    assert live.refresh()
    assert "other" in live.current.matcher.labels


def test_only_what_changed_is_fitted_anew(store: GestureStore, live: LiveGallery) -> None:
    ann, bob = (store.galleries.create(name).id for name in ("Ann", "Bob"))
    for gallery in (ann, bob):
        live.join(gallery)
        live.of(gallery)
    live.refresh()
    before = [live.known(each) for each in (SHARED, ann, bob)]
    store.create("more", Home(), [store.list()[0].samples[0].template], gallery=ann)
    assert live.refresh()
    assert not live.refresh()
    after = [live.known(each) for each in (SHARED, ann, bob)]
    assert after[0] is before[0] and after[2] is before[2]
    assert after[1] is not None and after[1] is not before[1]
    assert "more" in after[1].actions
    # What is not matched is no change of what is.
    store.galleries.rename(bob, "Robert")
    quiet = store.create("quiet", Home(), [bytes(300) + b"\xff" * 300], active=False, gallery=bob)
    assert live.refresh() and live.version == store.version
    assert live.known(bob) is before[2]
    store.update(quiet.id, active=True)
    live.refresh()
    assert live.known(bob) is not before[2]


def test_what_a_gesture_does_is_changed_without_learning_anew(
    store: GestureStore, live: LiveGallery
) -> None:
    before = live.current
    store.update(store.list()[0].id, action=Stop())
    assert live.refresh()
    assert live.current.actions != before.actions
    assert live.current.matcher is before.matcher


def test_what_nobody_uses_any_more_is_forgotten(store: GestureStore, live: LiveGallery) -> None:
    ids = [store.galleries.create(str(number)).id for number in range(SPARE + 2)]
    live.refresh()
    for id in ids:
        live.of(id)
    assert [live.known(id) is None for id in ids] == [True, True] + [False] * SPARE
    live.join(ids[-1])
    store.galleries.rename(ids[0], "x")
    live.refresh()
    assert [live.known(id) is None for id in ids] == [True] * (SPARE + 1) + [False]
    live.leave(ids[-1])
    store.galleries.rename(ids[0], "y")
    live.refresh()
    assert live.fitted == 1 and live.known(SHARED) is live.current


def test_a_damaged_gallery_is_noticed_when_it_is_read_again(
    store: GestureStore, live: LiveGallery
) -> None:
    ann = store.galleries.create("Ann").id
    live.join(ann)
    live.of(ann)
    with store.base.write() as session:
        session.connection().exec_driver_sql("UPDATE gesture SET action = '{}' WHERE gallery = 2")
        store.base.rise(session)
    with pytest.raises(DatabaseBroken, match="is damaged"):
        live.refresh()


async def test_a_choice_falls_back_when_its_gallery_is_deleted(
    store: GestureStore, live: LiveGallery
) -> None:
    ann = store.galleries.create("Ann").id
    choice, other = GalleryChoice(live, asyncio.to_thread), GalleryChoice(live, asyncio.to_thread)
    assert (choice.id, choice.enrolled) == (SHARED, live.current)
    await choice.choose(ann)
    assert (choice.id, choice.enrolled) == (ann, live.known(ann))
    with pytest.raises(NotFound):
        await choice.choose("nobody")
    assert choice.id == ann and live.known("nobody") is None
    await choice.choose(ann)
    choice.check()
    assert choice.id == ann
    store.galleries.delete(ann)
    live.refresh()
    # At once, whether or not somebody looked after it yet.
    assert choice.enrolled is live.current
    choice.check()
    assert choice.id == SHARED
    choice.close()
    other.close()
    # Nothing is counted twice or never: the shared one is still the only one in use.
    assert {id: count for id, count in live._users.items() if count} == {SHARED: 1}


async def test_a_choice_that_is_given_up_holds_no_gallery(
    store: GestureStore, live: LiveGallery, monkeypatch: pytest.MonkeyPatch
) -> None:
    ann = store.galleries.create("Ann").id
    choice = GalleryChoice(live, asyncio.to_thread)
    task = asyncio.create_task(choice.choose(ann))
    await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert choice.id == SHARED and live._users[ann] == 0


def test_each_gallery_recognises_its_own_hands(
    store: GestureStore, live: LiveGallery, hand: Callable[..., bytes]
) -> None:
    extraction = {name: extract_template(hand(name), SETTINGS) for name in ("forward", "up")}
    ann = store.galleries.create("Ann").id
    for gesture in store.list(ann):
        shown = {"forward": "up", "up": "forward"}.get(gesture.name)
        if shown:
            templates = [pack_template(extraction[shown].template)]
            store.add_samples(gesture.id, templates, replace=True)
    found = {}
    for gallery in (SHARED, ann):
        match = live.of(gallery).matcher(extraction["forward"].views).match
        assert match is not None and match.accepted
        found[gallery] = match.gesture
    assert found == {SHARED: "forward", ann: "up"}


def test_a_database_older_than_landmarks_has_those_of_the_starter_set(tmp_path: Path) -> None:
    folder = starter_set()
    assert folder is not None
    store = GestureStore(f"sqlite:///{tmp_path / 'x.db'}", None)
    for entry in read_set(folder):
        store.create(entry.name, entry.action, entry.templates)
    assert all(hand is None for _, _, hand in store.active_samples())
    assert build_matcher(store, SETTINGS).by_landmarks is not None
    # One gesture taught without them, and silhouettes are compared.
    store.create("old", Home(), [bytes(300) + b"\xff" * 300])
    assert build_matcher(store, SETTINGS).by_landmarks is None
    store.close()
