"""Galleries: several people, each with gestures of their own."""

import signal
import sqlite3
import subprocess
import sys
from datetime import timedelta
from pathlib import Path

import pytest

from app.errors import DatabaseBroken, Duplicate, Invalid, NotFound
from app.gestures import GestureStore, NewGesture, backup
from app.gestures.backup import Place
from app.gestures.exchange import export_set, import_set
from app.gestures.galleries import SharedGallery
from app.gestures.records import MAX_GALLERIES, SHARED, Gesture
from app.link.actions import Home, Stop
from tests.gestures.conftest import STARTER, execute, template, url

DATA = Path(__file__).parent / "data"


def looks(gesture: Gesture) -> list[tuple[bytes, object]]:
    return [(sample.template, sample.created) for sample in gesture.samples]


def test_there_is_always_the_shared_one(store: GestureStore) -> None:
    (shared,) = store.galleries.list()
    assert (shared.id, shared.name, shared.gestures, shared.taught) == (SHARED, "Shared", 0, 0)
    made = store.create("a", Home(), [template()])
    assert (made.gallery, made.taught) == (SHARED, True)
    assert store.galleries.get(SHARED).gestures == 1


def test_the_starter_set_counts_as_taught_by_nobody(tmp_path: Path) -> None:
    store = GestureStore(url(tmp_path / "x.db"), STARTER)
    (shared,) = store.galleries.list()
    assert (shared.gestures, shared.taught) == (10, 0)
    first = store.list()[0]
    assert not first.taught
    assert store.add_samples(first.id, [template()]).taught
    assert store.galleries.get(SHARED).taught == 1
    store.close()


def test_a_new_one_is_a_copy_with_the_samples_own_times(store: GestureStore) -> None:
    first = store.create("first", Home(), [template(1), template(2)])
    store.create("second", Stop(), [template(3)], active=False)
    store.update(first.id, action=Stop())
    before = store.version
    gallery = store.galleries.create(" Ann ")
    assert (gallery.name, gallery.gestures, gallery.taught) == ("Ann", 2, 0)
    assert store.version > before
    assert store.galleries.list()[1] == gallery == store.galleries.get(gallery.id)
    mine, shared = store.list(gallery.id), store.list()
    for own, one in zip(mine, shared, strict=True):
        assert (own.name, own.action, own.active) == (one.name, one.action, one.active)
        assert looks(own) == looks(one)
        assert (own.gallery, own.taught) == (gallery.id, False)
        assert {own.id, *(each.id for each in own.samples)}.isdisjoint(
            {one.id, *(each.id for each in one.samples)}
        )
        assert store.get(own.id) == own
    assert store.templates(gallery.id) == store.templates()
    assert [version.action for version in store.versions(mine[0].id)] == [Stop()]


def test_what_happens_in_one_gallery_does_not_happen_in_another(store: GestureStore) -> None:
    store.create("wave", Home(), [template(1)])
    ann, bob = store.galleries.create("Ann"), store.galleries.create("Bob")
    (of_ann,) = store.list(ann.id)
    store.update(of_ann.id, name="hello", action=Stop())
    extra = store.create("extra", Home(), [template(5)], gallery=ann.id)
    assert extra.gallery == ann.id
    store.create("extra", Home(), [template(6)], gallery=bob.id)
    with pytest.raises(Duplicate, match="'extra' already"):
        store.create("EXTRA", Home(), [template(7)], gallery=ann.id)
    with pytest.raises(Duplicate, match="'extra' already"):
        store.update(of_ann.id, name="extra")
    store.put_all([NewGesture("wave", Stop(), (template(8),))], replace=True, gallery=bob.id)
    assert [gesture.name for gesture in store.list(ann.id)] == ["hello", "extra"]
    assert [gesture.name for gesture in store.list(bob.id)] == ["wave", "extra"]
    (shared,) = store.list()
    assert (shared.name, shared.action) == ("wave", Home())
    assert store.templates() == [("wave", template(1))]


def test_a_gesture_is_taught_once_a_sample_is_newer_than_its_gallery(store: GestureStore) -> None:
    store.create("a", Home(), [template(1)])
    store.create("b", Home(), [template(2)])
    gallery = store.galleries.create("Ann")
    first, second = store.list(gallery.id)
    store.update(first.id, action=Stop())
    assert store.galleries.get(gallery.id).taught == 0
    assert store.add_samples(first.id, [template(3)]).taught
    taught = store.add_samples(second.id, [template(4)], replace=True)
    assert taught.taught
    assert [sample.template for sample in taught.samples] == [template(4)]
    assert store.galleries.get(gallery.id).taught == 2
    assert [gesture.taught for gesture in store.list(gallery.id)] == [True, True]
    assert not store.list(store.galleries.create("Bob").id)[0].taught


def test_a_clock_that_was_set_back_makes_no_difference(
    store: GestureStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    store.create("a", Home(), [template(1)])
    for module in ("galleries", "putting", "store"):
        monkeypatch.setattr(f"app.gestures.{module}.now_ms", lambda: 1)
    gallery = store.galleries.create("Ann")
    (copy,) = store.list(gallery.id)
    assert not copy.taught
    assert gallery.created == copy.samples[0].created
    assert store.add_samples(copy.id, [template(2)]).taught
    assert store.create("b", Home(), [template(3)], gallery=gallery.id).taught


def test_names_follow_the_rules_of_gestures(store: GestureStore) -> None:
    ann = store.galleries.create("Ann")
    for taken in ("ANN", "shared"):
        with pytest.raises(Duplicate, match=r"there is a gallery '(Ann|Shared)' already"):
            store.galleries.create(taken)
    for wrong, message in (
        ("  ", "a gallery needs a name"),
        ("x" * 61, "61 characters"),
        ("a\tb", "U\\+0009"),
    ):
        with pytest.raises(Invalid, match=message):
            store.galleries.create(wrong)
        with pytest.raises(Invalid, match=message):
            store.galleries.rename(ann.id, wrong)
    assert store.galleries.rename(ann.id, "ann").name == "ann"
    with pytest.raises(Duplicate, match="'Shared' already"):
        store.galleries.rename(ann.id, "SHARED")
    assert store.galleries.rename(SHARED, "Everybody").name == "Everybody"
    assert [gallery.name for gallery in store.galleries.list()] == ["Everybody", "ann"]


def test_one_is_found_by_its_name_or_its_id(store: GestureStore) -> None:
    ann = store.galleries.create("Ann")
    assert store.galleries.named(" ANN ") == store.galleries.named(ann.id) == ann
    assert store.galleries.named("shared").id == SHARED
    with pytest.raises(NotFound, match="there is no gallery 'Bob'; there are: Shared, Ann"):
        store.galleries.named("Bob")


def test_deleting_takes_all_of_it_and_nothing_else(store: GestureStore) -> None:
    store.create("a", Home(), [template(1)])
    ann, bob = store.galleries.create("Ann"), store.galleries.create("Bob")
    (gone,) = store.list(ann.id)
    before = store.version
    store.galleries.delete(ann.id)
    assert store.version > before
    assert [gallery.id for gallery in store.galleries.list()] == [SHARED, bob.id]
    assert [len(store.list(each)) for each in (SHARED, bob.id)] == [1, 1]
    with store.base.engine.connect() as connection:
        for table in ("gesture", "sample", "action_versions"):
            count = connection.exec_driver_sql(f"SELECT count(*) FROM {table}").scalar_one()
            assert count == 2, table
    with pytest.raises(NotFound):
        store.get(gone.id)
    with pytest.raises(SharedGallery, match="the shared gallery stays") as caught:
        store.galleries.delete(SHARED)
    assert (caught.value.code, caught.value.status) == ("shared_gallery", 409)


def test_an_unknown_gallery_is_not_found(store: GestureStore) -> None:
    for call in (
        lambda: store.list("nobody"),
        lambda: store.templates("nobody"),
        lambda: store.create("a", Home(), [template()], gallery="nobody"),
        lambda: store.put_all([], gallery="nobody"),
        lambda: store.galleries.get("nobody"),
        lambda: store.galleries.rename("nobody", "x"),
        lambda: store.galleries.delete("nobody"),
    ):
        with pytest.raises(NotFound, match="there is no gallery with the id 'nobody'"):
            call()
    assert store.version == 0


def test_there_is_a_limit_to_galleries(store: GestureStore) -> None:
    for number in range(MAX_GALLERIES - 1):
        store.galleries.create(str(number))
    with pytest.raises(Invalid, match="there are 100 galleries, which is the most"):
        store.galleries.create("one more")
    store.galleries.delete(store.galleries.list()[-1].id)
    store.galleries.create("one more")


def test_sets_are_exported_from_and_imported_into_one_gallery(
    store: GestureStore, tmp_path: Path
) -> None:
    store.create("a", Home(), [template(1)])
    ann = store.galleries.create("Ann")
    store.create("b", Home(), [template(2)], gallery=ann.id)
    assert export_set(store, tmp_path / "set", ann.id) == 2
    bob = store.galleries.create("Bob")
    import_set(store, tmp_path / "set", replace=True, gallery=bob.id)
    assert [gesture.name for gesture in store.list(bob.id)] == ["a", "b"]
    assert [gesture.name for gesture in store.list()] == ["a"]


def two(path: Path) -> None:
    store = GestureStore(url(path), None)
    store.create("wave", Home(), [template(1)])
    store.galleries.create("Ann")
    store.close()


DAMAGES = {
    "name": "UPDATE galleries SET name = 'Bob' WHERE number = 2",
    "id": "UPDATE galleries SET id = 'x' WHERE number = 2",
    "time": "UPDATE galleries SET created_ms = created_ms + 1 WHERE number = 2",
    "moved": "UPDATE gesture SET gallery = 1, name_key = 'x' WHERE gallery = 2",
    "to another": "UPDATE gesture SET gallery = 2, name_key = 'x' WHERE gallery = 1",
    "to none": "UPDATE gesture SET gallery = 9 WHERE gallery = 2",
    "a sample": "UPDATE sample SET template = zeroblob(600) WHERE gesture = 2",
    "an action": 'UPDATE gesture SET action = \'{"type":"stop"}\' WHERE gallery = 2',
    "shared is gone": "DELETE FROM galleries WHERE number = 1",
    "Ann is gone": "DELETE FROM galleries WHERE number = 2",
}


@pytest.mark.parametrize("what", DAMAGES)
def test_damage_in_any_gallery_is_noticed_and_never_backed_up(place: Place, what: str) -> None:
    two(place.database)
    good = backup.make(place, 1)
    assert good is not None and backup.check(good) == 2
    execute(place.database, DAMAGES[what], "UPDATE gallery SET version = 99")
    with pytest.raises(DatabaseBroken, match="is damaged"):
        backup.make(place, 1)
    assert [each.path for each in backup.found(place)] == [good]
    with pytest.raises(DatabaseBroken, match="is damaged"):
        GestureStore(url(place.database), None)


def test_a_damaged_version_of_an_action_is_noticed_in_any_gallery(place: Place) -> None:
    two(place.database)
    execute(place.database, "UPDATE action_versions SET created_ms = 5 WHERE gesture = 2")
    with pytest.raises(DatabaseBroken, match="gesture 'wave'"):
        backup.make(place, 1)


def test_what_is_damaged_is_not_copied(tmp_path: Path) -> None:
    path = tmp_path / "x.db"
    store = GestureStore(url(path), None)
    store.create("wave", Home(), [template(1)])
    execute(path, 'UPDATE gesture SET action = \'{"type":"stop"}\'')
    with pytest.raises(DatabaseBroken, match="gesture 'wave'"):
        store.galleries.create("Ann")
    assert [gallery.name for gallery in store.galleries.list()] == ["Shared"]
    store.close()


@pytest.mark.parametrize("version", ["v0001", "v0002", "v0003"])
def test_what_an_older_database_holds_is_everybodys(tmp_path: Path, version: str) -> None:
    path = tmp_path / "x.db"
    connection = sqlite3.connect(path)
    connection.executescript((DATA / f"{version}.sql").read_text(encoding="utf-8"))
    query = "SELECT id, checksum FROM {} ORDER BY number"
    before = [connection.execute(query.format(t)).fetchall() for t in ("gesture", "sample")]
    connection.close()
    store = GestureStore(url(path), STARTER)
    (shared,) = store.galleries.list()
    assert (shared.id, shared.gestures, shared.taught) == (SHARED, 2, 0)
    assert shared.created == store.list()[0].created + timedelta(minutes=1)
    assert all(len(store.versions(gesture.id)) == 1 for gesture in store.list())
    ann = store.galleries.create("Ann")
    store.create("GRÜSSE 2", Home(), [template(3)], gallery=ann.id)
    assert store.add_samples(store.list()[0].id, [template(9)]).taught
    store.galleries.delete(ann.id)
    store.close()
    connection = sqlite3.connect(path)
    after = [connection.execute(query.format(t)).fetchall() for t in ("gesture", "sample")]
    assert connection.execute("PRAGMA foreign_key_check").fetchall() == []
    connection.close()
    # Nothing was written anew, so that nothing that was damaged before got a good checksum.
    assert after[0][1:] == before[0][1:]
    assert after[1][:3] == before[1]


def test_the_galleries_of_a_dump_are_there(tmp_path: Path) -> None:
    path = tmp_path / "x.db"
    connection = sqlite3.connect(path)
    connection.executescript((DATA / "v0004.sql").read_text(encoding="utf-8"))
    connection.close()
    store = GestureStore(url(path), None)
    assert [gallery.name for gallery in store.galleries.list()] == ["Shared", "Ann"]
    assert store.templates(store.galleries.named("ann").id) == store.templates()
    store.close()


def test_a_migration_that_breaks_off_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "x.db"
    connection = sqlite3.connect(path)
    connection.executescript((DATA / "v0003.sql").read_text(encoding="utf-8"))
    connection.close()

    def broken(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("alembic.operations.base.BatchOperations.create_unique_constraint", broken)
        with pytest.raises(KeyboardInterrupt):
            GestureStore(url(path), None)
    connection = sqlite3.connect(path)
    assert connection.execute("SELECT version_num FROM alembic_version").fetchall() == [("0003",)]
    assert connection.execute("SELECT count(*) FROM sample").fetchone() == (3,)
    connection.close()
    store = GestureStore(url(path), None)
    assert len(store.list()) == 2
    store.close()


REPLACER = """
import sys
from app.gestures import GestureStore
from tests.gestures.conftest import template
store = GestureStore(sys.argv[1], None)
id = store.list()[0].id
for number in range(1, 100000):
    store.add_samples(id, [template(number + k) for k in range(5)], replace=True)
    print(number, flush=True)
"""


@pytest.mark.parametrize("acknowledged", [3, 11])
def test_a_kill_leaves_the_old_samples_or_the_new_ones(tmp_path: Path, acknowledged: int) -> None:
    place = url(tmp_path / "x.db")
    store = GestureStore(place, None)
    store.create("a", Home(), [template(0)])
    store.close()
    root = Path(__file__).parents[2]
    writer = subprocess.Popen(
        [sys.executable, "-c", REPLACER, place], cwd=root, stdout=subprocess.PIPE, text=True
    )
    assert writer.stdout is not None
    last = 0
    for line in writer.stdout:
        last = int(line)
        if last == acknowledged:
            writer.send_signal(signal.SIGKILL)
    writer.wait()
    writer.stdout.close()
    store = GestureStore(place, None)
    (gesture,) = store.list()
    found = [sample.template for sample in gesture.samples]
    store.close()
    assert found in [[template(n + k) for k in range(5)] for n in (last, last + 1)]


def test_replacing_with_what_is_no_template_leaves_the_old_ones(store: GestureStore) -> None:
    made = store.create("a", Home(), [template(1)])
    before = store.version
    for templates in ([], [b"short"], [template(2), bytes(600)]):
        with pytest.raises(Invalid):
            store.add_samples(made.id, templates, replace=True)
    assert store.get(made.id) == made
    assert store.version == before
