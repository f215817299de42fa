import threading
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from app.errors import Duplicate, Invalid, NotFound, StorageFull
from app.gestures import GestureStore, NewGesture
from app.gestures.exchange import export_set, import_set
from app.gestures.records import MAX_SAMPLES
from app.link.actions import (
    Action,
    Gripper,
    Home,
    JogCartesian,
    JogJoint,
    Sequence,
    Stop,
    TurnJoint,
)
from tests.gestures.conftest import STARTER, template, url


def test_an_empty_store_lists_nothing(store: GestureStore) -> None:
    assert store.list() == []
    assert store.templates() == []
    assert store.version == 0


def test_what_is_created_is_found_again(store: GestureStore) -> None:
    before = datetime.now(UTC) - timedelta(milliseconds=1)
    made = store.create(" wave ", Home(), [template(1), template(2)])
    assert made.name == "wave"
    assert made.action == Home()
    assert [sample.template for sample in made.samples] == [template(1), template(2)]
    assert before <= made.created == made.updated <= datetime.now(UTC)
    assert store.get(made.id) == made
    assert store.list() == [made]
    assert store.templates() == [("wave", template(1)), ("wave", template(2))]


@pytest.mark.parametrize(
    "action",
    [
        TurnJoint(joint=3, angle=-1.25),
        Sequence(steps=(JogJoint(joint=1, velocity=0.1, duration=2.0), Stop())),
    ],
)
def test_actions_come_back_as_they_were(store: GestureStore, action: Action) -> None:
    assert store.get(store.create("x", action, [template()]).id).action == action


def test_gestures_keep_the_order_in_which_they_were_made(store: GestureStore) -> None:
    names = ["zebra", "ant", "mouse"]
    for number, name in enumerate(names):
        store.create(name, Stop(), [template(number)])
    store.update(store.list()[0].id, action=Home())
    assert [gesture.name for gesture in store.list()] == names


def test_a_name_is_taken_whatever_its_case(store: GestureStore) -> None:
    store.create("Grüße", Home(), [template()])
    with pytest.raises(Duplicate, match="there is a gesture 'Grüße' already"):
        store.create("GRU\u0308ßE", Home(), [template()])
    assert len(store.list()) == 1


def test_bad_values_change_nothing(store: GestureStore) -> None:
    for name, templates in (("", [template()]), ("x", []), ("x", [b"short"])):
        with pytest.raises(Invalid):
            store.create(name, Home(), templates)
    assert store.version == 0


def test_update_changes_name_and_action(store: GestureStore) -> None:
    made = store.create("a", Home(), [template()])
    assert store.update(made.id, name="b").name == "b"
    changed = store.update(made.id, action=Gripper(width=0.01))
    assert (changed.name, changed.action) == ("b", Gripper(width=0.01))
    assert (changed.id, changed.created, changed.samples) == (made.id, made.created, made.samples)
    assert changed.updated >= made.updated
    assert store.get(made.id) == changed


def test_a_name_may_change_its_case_but_not_take_anothers(store: GestureStore) -> None:
    first = store.create("first", Home(), [template()])
    store.create("second", Home(), [template()])
    assert store.update(first.id, name="FIRST").name == "FIRST"
    with pytest.raises(Duplicate, match="'second' already"):
        store.update(first.id, name="Second")
    assert store.get(first.id).name == "FIRST"


def test_samples_are_added_at_the_end(store: GestureStore) -> None:
    made = store.create("a", Home(), [template(1)])
    more = store.add_samples(made.id, [template(2), template(3)])
    assert [sample.template for sample in more.samples] == [template(i) for i in (1, 2, 3)]
    assert more.samples[0] == made.samples[0]
    assert store.get(made.id) == more


def test_there_is_a_limit_to_samples(store: GestureStore) -> None:
    made = store.create("a", Home(), [template()] * (MAX_SAMPLES - 1))
    with pytest.raises(Invalid, match="would have 1001 samples; at most 1000"):
        store.add_samples(made.id, [template(), template()])
    assert len(store.get(made.id).samples) == MAX_SAMPLES - 1


def test_delete_forgets_gesture_and_samples(store: GestureStore) -> None:
    made = store.create("a", Home(), [template()])
    kept = store.create("b", Home(), [template(1)])
    store.delete(made.id)
    assert store.list() == [kept]
    assert store.templates() == [("b", template(1))]
    assert store.create("a", Stop(), [template()]).id != made.id


def test_unknown_ids_are_not_found(store: GestureStore) -> None:
    for call in (
        lambda: store.get("nobody"),
        lambda: store.update("nobody", name="x"),
        lambda: store.add_samples("nobody", [template()]),
        lambda: store.delete("nobody"),
        lambda: store.get("' OR 1=1 --"),
    ):
        with pytest.raises(NotFound, match="there is no gesture with the id"):
            call()
    assert store.version == 0


def test_the_version_rises_with_every_change_and_with_nothing_else(store: GestureStore) -> None:
    versions = [store.version]
    made = store.create("a", Home(), [template()])
    versions.append(store.version)
    store.update(made.id, name="b")
    versions.append(store.version)
    store.add_samples(made.id, [template(2)])
    versions.append(store.version)
    store.list(), store.templates(), store.get(made.id)
    assert store.version == versions[-1]
    store.delete(made.id)
    versions.append(store.version)
    assert versions == sorted(set(versions))


def test_put_all_is_whole_or_not_at_all(store: GestureStore) -> None:
    old = store.create("b", Home(), [template(9)])
    entries = [NewGesture(name, Stop(), (template(1),)) for name in ("a", "B", "c")]
    with pytest.raises(Duplicate):
        store.put_all(entries)
    assert store.list() == [old]
    store.put_all(entries, replace=True)
    assert [gesture.name for gesture in store.list()] == ["B", "a", "c"]
    replaced = store.get(old.id)
    assert replaced.action == Stop()
    assert [sample.template for sample in replaced.samples] == [template(1)]


def test_it_is_still_there_after_reopening(tmp_path: Path) -> None:
    place = url(tmp_path / "x.db")
    first = GestureStore(place, None)
    made = first.create("مرحبا <b>", Home(), [template()])
    first.close()
    second = GestureStore(place, None)
    assert second.list() == [made]
    second.close()


def test_a_second_process_sees_changes(tmp_path: Path) -> None:
    """Two engines on one file behave as two processes do."""
    one = GestureStore(url(tmp_path / "x.db"), None)
    two = GestureStore(url(tmp_path / "x.db"), None)
    made = one.create("a", Home(), [template()])
    assert (two.version, two.list()) == (1, [made])
    two.delete(made.id)
    assert (one.version, one.list()) == (2, [])
    one.close(), two.close()


def test_many_threads_may_write_and_read_at_once(tmp_path: Path) -> None:
    stores = [GestureStore(url(tmp_path / "x.db"), None) for _ in range(2)]
    begin = threading.Barrier(8)

    def work(number: int) -> None:
        store = stores[number % 2]
        begin.wait()
        for turn in range(6):
            made = store.create(f"{number}-{turn}", Home(), [template(number), template(turn)])
            store.add_samples(made.id, [template(50)])
            assert len(store.get(made.id).samples) == 3
            assert all(len(gesture.samples) >= 2 for gesture in store.list())
            if turn % 2:
                store.delete(made.id)

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(work, range(8)))
    assert len(stores[0].list()) == 24
    assert stores[0].version == 8 * (6 + 6 + 3)
    for store in stores:
        store.close()


def test_one_of_many_threads_gets_a_name(store: GestureStore) -> None:
    begin = threading.Barrier(6)

    def work(number: int) -> bool:
        begin.wait()
        try:
            store.create("same", Home(), [template(number)])
        except Duplicate:
            return False
        return True

    with ThreadPoolExecutor(6) as pool:
        assert sum(pool.map(work, range(6))) == 1


def test_a_full_disk_changes_nothing(tmp_path: Path) -> None:
    store = GestureStore(url(tmp_path / "x.db"), None)
    made = store.create("a", Home(), [template()])
    with store.base.engine.connect() as connection:
        pages = connection.exec_driver_sql("PRAGMA page_count").scalar_one()
        # SQLite says the same as on a full disk when a file reaches its greatest size.
        connection.exec_driver_sql(f"PRAGMA max_page_count={pages + 3}")
    with pytest.raises(StorageFull, match=r"is full; nothing was changed") as caught:
        store.create("b", Home(), [template(i) for i in range(200)])
    assert (caught.value.code, caught.value.status) == ("disk_full", 507)
    assert store.list() == [made]
    assert store.version == 1
    store.close()


def test_an_inactive_gesture_is_kept_and_listed_but_not_matched(store: GestureStore) -> None:
    store.create("shown", Home(), [template(1)])
    quiet = store.create("quiet", Home(), [template(2)], active=False)
    assert [gesture.active for gesture in store.list()] == [True, False]
    assert [name for name, _ in store.templates()] == ["shown"]
    before = store.version
    assert store.update(quiet.id, active=True).active
    assert store.version > before
    assert [name for name, _ in store.templates()] == ["shown", "quiet"]
    # What is not named stays as it is.
    assert store.update(quiet.id, active=False).active is False
    assert store.update(quiet.id, name="still").active is False


def test_inactive_gestures_stay_so_in_the_exchange_format(
    store: GestureStore, tmp_path: Path
) -> None:
    store.create("shown", Home(), [template(1)])
    store.create("quiet", Home(), [template(2)], active=False)
    export_set(store, tmp_path / "set")
    text = (tmp_path / "set" / "gestures.toml").read_text()
    assert text.count("active") == text.count("active = false") == 1
    other = GestureStore(url(tmp_path / "other.db"), None)
    import_set(other, tmp_path / "set")
    assert [(gesture.name, gesture.active) for gesture in other.list()] == [
        ("shown", True),
        ("quiet", False),
    ]
    other.close()


def test_starter_gestures_may_do_something_else_for_a_robot(tmp_path: Path) -> None:
    turn = JogCartesian(frame="tool", angular=(0.0, 0.0, 0.5))
    path = url(tmp_path / "g.db")
    store = GestureStore(path, STARTER, {"left": turn})
    actions = {gesture.name: gesture.action for gesture in store.list()}
    store.close()
    assert actions["left"] == turn
    assert actions["stop"].type == "stop"
    # A database that is there already is left alone.
    store = GestureStore(path, STARTER, {"right": turn})
    assert {gesture.name: gesture.action for gesture in store.list()} == actions
    store.close()


HAND = bytes((1, 200, *range(252)))


def test_landmarks_are_kept_beside_the_template_and_come_along(store: GestureStore) -> None:
    made = store.create("wave", Home(), [template(1), template(2)], landmarks=[HAND, None])
    assert [sample.landmarks for sample in made.samples] == [HAND, None]
    more = store.add_samples(made.id, [template(3)], landmarks=[HAND])
    assert [sample.landmarks for sample in more.samples] == [HAND, None, HAND]
    assert store.active_samples() == [
        ("wave", template(1), HAND),
        ("wave", template(2), None),
        ("wave", template(3), HAND),
    ]
    other = store.create("other", Home(), [template(4)])
    _, moved = store.samples.move(made.id, more.samples[0].id, other.id)
    assert [sample.landmarks for sample in moved.samples] == [None, HAND]


@pytest.mark.parametrize("landmarks", [[b"short"], [HAND, HAND], [bytes(254)]])
def test_what_are_no_landmarks_is_refused(store: GestureStore, landmarks: list[bytes]) -> None:
    with pytest.raises(Invalid, match="landmarks"):
        store.create("wave", Home(), [template(1)], landmarks=landmarks)
