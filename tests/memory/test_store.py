"""Events: bounded by count and bytes, read a page at a time."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from app.errors import NotFound
from app.memory import Database, EventStore, Finish, NewEvent, Picture
from app.memory.store import MAX_DATA, OPEN

Make = Callable[..., EventStore]


@pytest.fixture
def make(tmp_path: Path) -> Iterator[Make]:
    opened = []

    def make_(most_events: int = 1000, most_bytes: int = 1 << 20) -> EventStore:
        database = Database(tmp_path / "memory.db")
        opened.append(database)
        return EventStore(database, most_events, most_bytes)

    yield make_
    for database in opened:
        database.close()


def test_an_event_is_read_as_it_was_written(make: Make) -> None:
    store = make()
    data = {"who": "operator-1", "gesture": "Lös \N{WAVING HAND SIGN}", "moves": True}
    template, jpeg = bytes(range(200)) * 3, b"\xff\xd8 jpeg"
    assert store.write([]) is None
    newest = store.write([NewEvent(1, 1234, "gesture", data, template), NewEvent(2, 5, "reset")])
    second, first = store.page(10)
    assert second.id == newest
    assert (first.id, first.at_ms, first.kind, first.data) == (newest - 1, 1234, "gesture", data)
    assert (first.took_ms, first.template, first.picture) == (None, True, False)
    store.write([Finish(1, 700, {"presses": 3}), Picture(1, jpeg)])
    _, first = store.page(10)
    assert first.data == {**data, "presses": 3}
    assert (first.took_ms, first.picture) == (700, True)
    assert store.blob(first.id, "template") == template
    assert store.blob(first.id, "picture") == jpeg
    for id, what, words in (
        (second.id, "picture", "no picture belongs to"),
        (999, "template", "there is no event"),
    ):
        with pytest.raises(NotFound, match=words):
            store.blob(id, what)  # type: ignore[arg-type]
    with pytest.raises(NotFound):
        store.blob(first.id, "picture", kinds=["reset"])


def test_pages_follow_one_another_and_kinds_are_chosen(make: Make) -> None:
    store = make()
    kinds = ("stop", "reset", "armed")
    store.write([NewEvent(n, n, kinds[n % 3]) for n in range(100)])
    seen, before = [], None
    while page := store.page(7, before=before):
        seen += [event.at_ms for event in page]
        before = page[-1].id
    assert seen == list(reversed(range(100)))
    assert [event.at_ms for event in store.page(4, kinds=["stop"])] == [99, 96, 93, 90]
    assert len(store.page(200, kinds=["stop", "armed"])) == 67
    assert store.page(5, kinds=[]) == []
    assert [event.at_ms for event in store.all()] == seen


def test_the_oldest_are_forgotten_by_number(make: Make) -> None:
    store = make(most_events=100)
    for start in range(0, 1000, 10):
        store.write([NewEvent(n, n, "reset") for n in range(start, start + 10)])
        assert len(store.page(500)) <= 100
    kept = [event.at_ms for event in store.page(500)]
    assert kept == list(range(999, 999 - len(kept), -1))
    assert len(kept) >= 90
    # Ids are never given twice, not even after everything was forgotten.
    assert store.page(1)[0].id == 1000


def test_the_oldest_are_forgotten_by_bytes_and_the_file_stays_small(
    make: Make, tmp_path: Path
) -> None:
    store = make(most_events=100_000, most_bytes=1 << 20)
    for number in range(600):
        store.write([NewEvent(number, number, "stop", template=bytes(600))])
        store.write([Picture(number, bytes(5000))])
    kept = store.page(100_000)
    assert 150 < len(kept) < 190
    assert kept[0].at_ms == 599
    assert all(event.picture for event in kept)
    assert sum(path.stat().st_size for path in tmp_path.glob("memory.db*")) < 6 << 20


def test_bounds_that_were_made_smaller_hold_from_the_next_event_on(make: Make) -> None:
    make(most_events=1000).write([NewEvent(n, n, "reset") for n in range(500)])
    store = make(most_events=100)
    store.write([NewEvent(1, 500, "stop")])
    assert len(store.page(500)) <= 100
    assert store.page(1)[0].kind == "stop"


def test_what_belongs_to_no_event_does_nothing(make: Make) -> None:
    store = make()
    store.write([NewEvent(1, 1, "stop")])
    assert store.write([Finish(77, 5), Picture(78, b"x")]) == 1
    # After a restart tokens mean other events.
    again = make()
    again.write([Finish(1, 5), Picture(1, b"x")])
    (event,) = again.page(10)
    assert (event.took_ms, event.picture) == (None, False)
    store.write([NewEvent(n, n, "reset") for n in range(10, 10 + OPEN)])
    store.write([Picture(1, b"too late")])
    assert not store.page(1000)[-1].picture


def test_data_that_is_too_long_keeps_its_short_values(make: Make) -> None:
    store = make()
    steps = [{"type": "wait", "duration": 1.0}] * 1000
    store.write([NewEvent(1, 1, "program", {"gesture": "x", "action": {"steps": steps}})])
    (event,) = store.page(1)
    assert event.data == {"gesture": "x"}
    store.write([NewEvent(2, 1, "program", {"gesture": "x" * (MAX_DATA - 100)})])
    assert len(store.page(1)[0].data["gesture"]) == MAX_DATA - 100
