"""A server and its gesture database: backed up by itself, and what is done about a lost one."""

import asyncio
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from sqlalchemy import event

from app.errors import CannotStart, DatabaseBroken, StorageFull
from app.gateway import backup_keeper
from app.gateway.backup_keeper import OBSERVERS_TOLD, BackupKeeper
from app.gateway.gallery import DATABASE_FILE, place_of
from app.gateway.tokens import TokenStore
from app.gestures import GestureStore, backup, recovery
from app.gestures.backup import Place
from app.link.actions import Home
from tests.conftest import fill
from tests.gateway.running import Operator, Running, StandIn, running, settings_for, wait_for
from tests.gateway.test_rest_gestures import enrol, error, names

Hand = Callable[..., bytes]


def place_in(folder: Path) -> Place:
    place = place_of(settings_for(folder))
    assert place is not None
    return place


def backups(folder: Path) -> list[Path]:
    return [each.path for each in backup.found(place_in(folder))]


def take(operator: Operator) -> None:
    operator.send("take_control")
    operator.next("robot", controller=operator.hello["session"])


def arms(operator: Operator) -> None:
    operator.send("arm")
    operator.next("robot", armed=True)


def refuses_to_arm(operator: Operator) -> str:
    operator.send("arm")
    return str(operator.next("error", code="gestures_lost")["message"])


def test_a_start_a_change_and_an_end_are_backed_up(
    node: StandIn, folder: Path, hand: Hand, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(backup_keeper, "SETTLE_S", 0.1)
    with running(settings_for(folder, node.endpoint)) as server:
        (first,) = backups(folder)
        assert enrol(server, "wave", {"type": "home"}, hand("forward")).status_code == 201
        wait_for(lambda: len(backups(folder)) == 2, "a backup of the change")
        monkeypatch.setattr(backup_keeper, "SETTLE_S", 1000.0)
        assert enrol(server, "late", {"type": "home"}, hand("up")).status_code == 201
    newest = backups(folder)[0]
    assert (backup.check(first), backup.check(newest)) == (10, 12)
    with running(settings_for(folder, node.endpoint)):
        assert len(backups(folder)) == 3, "nothing changed"


async def test_teaching_makes_one_backup_and_not_twenty(tmp_path: Path) -> None:
    place = Place(tmp_path / "gestures.db", tmp_path / "backups")
    GestureStore(f"sqlite:///{place.database}", None).close()
    keeper = BackupKeeper(place, 5)
    keeper.changed()
    await keeper.tend()
    assert backup.found(place) == [], "it may go on changing"
    keeper._due = asyncio.get_running_loop().time()
    await keeper.tend()
    await keeper.tend()
    assert len(backup.found(place)) == 1


async def test_what_cannot_be_backed_up_is_tried_again(tmp_path: Path) -> None:
    place = Place(tmp_path / "gestures.db", tmp_path / "backups")
    GestureStore(f"sqlite:///{place.database}", None).close()
    place.backups.touch()  # a file where the folder should be
    keeper = BackupKeeper(place, 5)
    keeper.changed()
    keeper._due = 0.0
    await keeper.tend()
    assert keeper.problem is None
    assert keeper._due is not None and keeper._due > asyncio.get_running_loop().time()


@pytest.fixture
def lost(folder: Path, node: StandIn) -> Iterator[Path]:
    """A folder whose database broke after a server had run on it."""
    with running(settings_for(folder, node.endpoint)):
        pass
    (folder / "data" / DATABASE_FILE).write_bytes(b"damaged" * 1000)
    yield folder


def test_a_lost_database_is_told_and_nobody_arms_until_it_is_restored(
    lost: Path, node: StandIn
) -> None:
    data = lost / "data"
    with running(settings_for(lost, node.endpoint)) as server:
        (aside,) = data.glob("gestures.db.broken-*")
        assert aside.read_bytes() == b"damaged" * 1000
        told = server.http.get("/api/health").json()["database"]
        assert "set aside" in told and "farhand gestures restore" in told
        with server.operator() as operator:
            assert operator.hello["problem"] == told
            take(operator)
            assert refuses_to_arm(operator) == told
            # Stopping is never refused.
            assert server.http.post("/api/robots/puma/stop").status_code == 200
        assert not [request for request in node.requests if request.kind == "arm"]
        with pytest.raises(CannotStart, match="a server has the gesture database open"):
            recovery.restore(place_in(lost))
        assert len(backups(lost)) == 1, "the starter set pushes no backup out"
    node.mode, node.resets = "disarmed", 1
    recovery.restore(place_in(lost))
    with running(settings_for(lost, node.endpoint)) as server:
        assert server.http.get("/api/health").json()["database"] == "ok"
        assert server.http.get("/api/gestures").json()[0]["samples"] == 2, "not the starter set"
        with server.operator() as operator:
            assert operator.hello["problem"] is None
            take(operator)
            arms(operator)


def test_the_new_gestures_are_accepted_while_the_server_runs(lost: Path, node: StandIn) -> None:
    with running(settings_for(lost, node.endpoint)) as server, server.operator() as operator:
        take(operator)
        refuses_to_arm(operator)
        recovery.accept(place_in(lost))
        assert operator.next("gallery")["problem"] is None
        arms(operator)


def test_a_database_that_breaks_while_the_server_runs_keeps_it_from_arming(
    server: Running, folder: Path
) -> None:
    with server.operator() as operator:
        take(operator)
        store = GestureStore(f"sqlite:///{folder / 'data' / DATABASE_FILE}", None)
        with store.base.write() as session:
            session.connection().exec_driver_sql("UPDATE sample SET template = zeroblob(600)")
            session.connection().exec_driver_sql("UPDATE gallery SET version = version + 1")
        store.close()
        told = operator.next("gallery")["problem"]
        assert "is damaged" in told and "cannot be armed until" in told
        assert refuses_to_arm(operator) == told
        assert server.http.get("/api/health").json()["database"] == told
        made = TokenStore(server.hub.settings.data_dir / "tokens.json").make("observer", "Anna")
        watching = {"Authorization": f"Bearer {made.secret}"}
        with server.operator(additional_headers=watching) as observer:
            assert observer.hello["problem"] == OBSERVERS_TOLD
        health = server.http.get("/api/health", headers=watching).json()
        assert health["database"] == OBSERVERS_TOLD


def test_a_backup_that_does_not_pass_its_check_keeps_the_robot_from_being_armed(
    tmp_path: Path,
) -> None:
    place = Place(tmp_path / "gestures.db", tmp_path / "backups")
    store = GestureStore(f"sqlite:///{place.database}", None)
    store.create("a", Home(), [bytes(300) + b"\xff" * 300])
    with store.base.write() as session:
        session.connection().exec_driver_sql("UPDATE gesture SET action = '{}'")
    store.close()
    keeper = BackupKeeper(place, 5)
    assert not keeper.make()
    assert keeper.problem is not None and "'a'" in keeper.problem
    assert backup.found(place) == []


def test_a_full_disk_is_507_and_driving_and_stopping_go_on(
    server: Running, node: StandIn, hand: Hand
) -> None:
    engine = server.hub.store.base.engine

    @event.listens_for(engine, "begin")
    def full(connection: object) -> None:
        # SQLite says the same as on a full disk when a file reaches its greatest size.
        pages = connection.exec_driver_sql("PRAGMA page_count").scalar_one()  # type: ignore[attr-defined]
        connection.exec_driver_sql(f"PRAGMA max_page_count={pages}")  # type: ignore[attr-defined]

    before = names(server)
    wanted = [hand("forward"), hand("up"), hand("left"), hand("stop")]
    for number in range(20):
        answer = enrol(server, f"gesture {number}", {"type": "home"}, *wanted)
        if answer.status_code != 201:
            break
        before.append(f"gesture {number}")
    assert "is full" in error(answer, 507, "disk_full")
    assert names(server) == before
    drives_and_stops(server, node, hand)


def drives_and_stops(server: Running, node: StandIn, hand: Hand) -> None:
    with server.operator() as operator:
        take(operator)
        arms(operator)
        wait_for(lambda: operator.show(hand("forward")) and node.commands, "a command")
        assert server.http.post("/api/robots/puma/stop").status_code == 200
    assert len(node.stops) == 1


def test_a_disk_that_is_really_full(small_disk: Path, node: StandIn, hand: Hand) -> None:
    settings = settings_for(small_disk, node.endpoint)
    with running(settings) as server:
        tokens = TokenStore(settings.data_dir / "tokens.json")
        tokens.make("observer", "before", None)
        filler = fill(small_disk)
        answer = enrol(server, "wave", {"type": "home"}, hand("forward"))
        assert "is full; nothing was changed" in error(answer, 507, "disk_full")
        assert "wave" not in names(server)
        with pytest.raises(StorageFull, match=r"tokens.*full; nothing was changed") as caught:
            tokens.make("operator", "after", None)
        assert caught.value.status == 507
        assert [token.name for token in tokens.list()] == ["before"]
        assert server.http.get("/api/health").json()["database"] == "ok"
        drives_and_stops(server, node, hand)
        filler.unlink()
        assert enrol(server, "wave", {"type": "home"}, hand("forward")).status_code == 201
    assert not list(settings.data_dir.glob("tokens.*.*"))


def test_a_start_on_a_full_disk_works_or_says_what_fails(small_disk: Path, node: StandIn) -> None:
    settings = settings_for(small_disk, node.endpoint)
    fill(small_disk)
    with pytest.raises(StorageFull, match="is full"), running(settings):
        pass
    os.unlink(small_disk / "filler")
    with running(settings) as server:
        assert len(names(server)) == 10
    fill(small_disk)
    with pytest.raises(StorageFull, match="is full") as caught, running(settings):
        pass
    assert not isinstance(caught.value, DatabaseBroken)
    assert not list(settings.data_dir.glob("*.broken-*")), "a full disk is no damage"
