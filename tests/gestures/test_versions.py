from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from app.errors import ChangedMeanwhile, DatabaseBroken, NotFound
from app.gestures import GestureStore, NewGesture
from app.gestures.exchange import export_set, import_set
from app.gestures.putting import touch
from app.gestures.reading import row_of
from app.gestures.records import MAX_VERSIONS
from app.link.actions import Gripper, Home, Sequence, Stop, Wait
from tests.gestures.conftest import execute, template, url


def actions(store: GestureStore, id: str) -> list[object]:
    return [version.action for version in store.versions(id)]


def test_every_change_of_an_action_keeps_the_former(store: GestureStore) -> None:
    before = datetime.now(UTC) - timedelta(milliseconds=1)
    made = store.create("a", Home(), [template()])
    assert made.version == 1
    program = Sequence(steps=(Wait(duration=1.0), Stop()))
    assert store.update(made.id, action=program).version == 2
    changed = store.update(made.id, action=Gripper(width=0.0))
    assert (changed.version, changed.action) == (3, Gripper(width=0.0))
    versions = store.versions(made.id)
    assert [version.version for version in versions] == [1, 2, 3]
    assert actions(store, made.id) == [Home(), program, Gripper(width=0.0)]
    times = [version.created for version in versions]
    assert before <= times[0] <= times[1] <= times[2] <= changed.updated
    assert store.list() == [changed]


def test_what_is_no_change_of_the_action_is_no_version(store: GestureStore) -> None:
    made = store.create("a", Home(), [template()])
    store.update(made.id, action=Home())
    store.update(made.id, name="b", active=False)
    store.add_samples(made.id, [template(1)])
    assert store.get(made.id).version == 1
    assert actions(store, made.id) == [Home()]


def test_an_action_stored_without_a_newer_field_is_still_the_same(
    tmp_path: Path, store: GestureStore
) -> None:
    made = store.create("a", Gripper(width=0.0), [template()])
    with store.base.write() as session:
        row = row_of(session, made.id)
        row.action = '{"type":"gripper","width":0.0}'
        touch(store.base, session, row)
    assert store.update(made.id, action=Gripper(width=0.0)).version == 1
    assert store.update(made.id, action=Gripper(width=0.0, force=5.0)).version == 2


def test_restoring_is_a_new_version(store: GestureStore) -> None:
    made = store.create("a", Home(), [template()])
    store.update(made.id, action=Stop())
    restored = store.restore(made.id, 1)
    assert (restored.version, restored.action) == (3, Home())
    assert actions(store, made.id) == [Home(), Stop(), Home()]
    assert store.restore(made.id, 3).version == 3
    with pytest.raises(NotFound, match="a has no version 4 of its action; the newest is 3"):
        store.restore(made.id, 4)
    for call in (lambda: store.versions("nobody"), lambda: store.restore("nobody", 1)):
        with pytest.raises(NotFound, match="no gesture with the id"):
            call()


def test_a_change_that_does_not_know_the_newest_version_is_refused(store: GestureStore) -> None:
    made = store.create("a", Home(), [template()])
    store.update(made.id, action=Stop(), version=1)
    gallery = store.version
    with pytest.raises(ChangedMeanwhile, match="its newest version is 2, not 1; look at it"):
        store.update(made.id, name="b", action=Gripper(width=0.0), version=1)
    assert store.get(made.id).name == "a"
    assert store.version == gallery
    assert store.update(made.id, action=Gripper(width=0.0), version=2).version == 3


def test_a_gesture_keeps_a_hundred_versions(store: GestureStore) -> None:
    made = store.create("a", Home(), [template()])
    for number in range(MAX_VERSIONS + 1):
        store.update(made.id, action=Gripper(width=number / 1000))
    versions = store.versions(made.id)
    assert [version.version for version in versions] == list(range(3, MAX_VERSIONS + 3))
    assert store.get(made.id).version == MAX_VERSIONS + 2


def test_versions_go_with_their_gesture(tmp_path: Path, store: GestureStore) -> None:
    made = store.create("a", Home(), [template()])
    store.update(made.id, action=Stop())
    store.delete(made.id)
    with store.base.engine.connect() as connection:
        count = connection.exec_driver_sql("SELECT count(*) FROM action_versions").scalar()
    assert count == 0


def test_versions_outlive_a_restart_and_damage_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "x.db"
    store = GestureStore(url(path), None)
    made = store.create("a", Home(), [template()])
    store.update(made.id, action=Stop())
    store.close()
    execute(
        path,
        'UPDATE action_versions SET action = \'{"type":"gripper","width":0}\' WHERE version = 1',
    )
    store = GestureStore(url(path), None)
    assert store.get(made.id).version == 2
    for call in (lambda: store.versions(made.id), lambda: store.restore(made.id, 1)):
        with pytest.raises(DatabaseBroken, match="its content has changed on the disk"):
            call()
    store.close()


def test_importing_over_a_gesture_is_a_change_like_any_other(
    tmp_path: Path, store: GestureStore
) -> None:
    made = store.create("a", Home(), [template()])
    export_set(store, tmp_path / "set")
    store.update(made.id, action=Stop())
    (back,) = import_set(store, tmp_path / "set", replace=True)
    assert (back.id, back.version, back.action) == (made.id, 3, Home())
    store.put_all([NewGesture("a", Home(), (template(5),))], replace=True)
    assert actions(store, made.id) == [Home(), Stop(), Home()]
