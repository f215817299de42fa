"""The timeline's events: written in batches, read a page at a time, the oldest forgotten."""

import json
import sqlite3
from collections import OrderedDict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from app.errors import NotFound
from app.memory.database import Database
from app.memory.events import KINDS, Event, Kind

MAX_DATA = 8192
"""Bytes of an event's data as JSON."""
ROW_BYTES = 64
"""What an event takes besides its data and pictures, about."""
SLACK = 0.95
"""Forgetting leaves this part of the bounds, so that it is not done for every event."""
OPEN = 256
"""Newest events that can still be added to."""
EXPORT_PAGE = 500


@dataclass(frozen=True)
class NewEvent:
    """An event that has just begun."""

    token: int
    """Names it for :class:`Finish` and :class:`Picture` of the same writer."""
    at_ms: int
    """ms since 1970, UTC."""
    kind: Kind
    data: dict[str, Any] = field(default_factory=dict)
    template: bytes | None = None
    """600 bytes: 60x80, one bit."""


@dataclass(frozen=True)
class Finish:
    """An event is over."""

    token: int
    took_ms: int
    data: dict[str, Any] = field(default_factory=dict)
    """To be added to what it holds."""


@dataclass(frozen=True)
class Picture:
    """What the robot looked like when the event began."""

    token: int
    jpeg: bytes


Item = NewEvent | Finish | Picture


class EventStore:
    """Safe to use from any thread; :meth:`write` from one.

    Args:
        database: Where they are kept.
        most_events: More than so many are never kept.
        most_bytes: Nor more than so many bytes of data and pictures.

    Raises:
        MemoryUnavailable: it cannot be read.
    """

    def __init__(self, database: Database, most_events: int, most_bytes: int) -> None:
        self._database = database
        self._most_events = most_events
        self._most_bytes = most_bytes
        self._open: OrderedDict[int, int] = OrderedDict()
        with database.read() as connection:
            self._count, self._bytes = _size(connection)

    def write(self, items: Sequence[Item]) -> int | None:
        """Write what happened down: all of it, or nothing.

        Items of events that are not known, because they were lost or forgotten, do nothing.

        Returns:
            The newest event's id; None when there is none.

        Raises:
            StorageFull, MemoryUnavailable: nothing was written.
        """
        opened: dict[int, int] = {}
        with self._database.write() as connection:
            count, total = self._count, self._bytes
            for item in items:
                if isinstance(item, NewEvent):
                    opened[item.token], added = _insert(connection, item)
                    count += 1
                else:
                    id = opened.get(item.token, self._open.get(item.token))
                    added = 0 if id is None else _add(connection, id, item)
                total += added
            if count > self._most_events or total > self._most_bytes:
                self._forget(connection)
                count, total = _size(connection)
            newest: int | None = connection.execute("SELECT max(id) FROM events").fetchone()[0]
        self._count, self._bytes = count, total
        self._open |= opened
        while len(self._open) > OPEN:
            self._open.popitem(last=False)
        return newest

    def page(
        self, limit: int, *, before: int | None = None, kinds: Collection[str] = KINDS
    ) -> list[Event]:
        """The newest events, newest first.

        Args:
            limit: At most so many.
            before: Only those older than the event of this id.
            kinds: Only these.

        Raises:
            MemoryUnavailable: it cannot be read.
        """
        marks = ",".join("?" * len(kinds))
        with self._database.read() as connection:
            rows = connection.execute(
                "SELECT id, at_ms, kind, data, took_ms, template IS NOT NULL, picture IS NOT NULL "
                f"FROM events WHERE id < ? AND kind IN ({marks}) ORDER BY id DESC LIMIT ?",
                (2**63 - 1 if before is None else before, *kinds, limit),
            ).fetchall()
        return [
            Event(id, at_ms, kind, json.loads(data), took_ms, bool(template), bool(picture))
            for id, at_ms, kind, data, took_ms, template, picture in rows
        ]

    def all(self, kinds: Collection[str] = KINDS) -> Iterator[Event]:
        """Every event, newest first, a page at a time: nobody waits for whoever reads slowly.

        Raises:
            MemoryUnavailable: it cannot be read.
        """
        before = None
        while page := self.page(EXPORT_PAGE, before=before, kinds=kinds):
            yield from page
            before = page[-1].id

    def blob(
        self, id: int, what: Literal["template", "picture"], kinds: Collection[str] = KINDS
    ) -> bytes:
        """An event's template (600 bytes) or picture (JPEG).

        Raises:
            NotFound: there is no such event, it has none, or it is not of these kinds.
            MemoryUnavailable: it cannot be read.
        """
        with self._database.read() as connection:
            row = connection.execute(
                f"SELECT kind, {what} FROM events WHERE id = ?", (id,)
            ).fetchone()
        if row is None or row[0] not in kinds:
            raise NotFound(f"there is no event with the id {id}", id=id)
        if row[1] is None:
            raise NotFound(f"no {what} belongs to the event {id}", id=id)
        return bytes(row[1])

    def _forget(self, connection: sqlite3.Connection) -> None:
        """Delete the oldest events until the bounds are kept, with some room."""
        most_events, most_bytes = self._most_events * SLACK, self._most_bytes * SLACK
        total = 0
        newest_first = connection.execute("SELECT id, bytes FROM events ORDER BY id DESC")
        for number, (id, size) in enumerate(newest_first.fetchall()):
            total += size
            if number >= most_events or total > most_bytes:
                connection.execute("DELETE FROM events WHERE id <= ?", (id,))
                return


def _insert(connection: sqlite3.Connection, event: NewEvent) -> tuple[int, int]:
    """Add an event; its id, and how many bytes it takes."""
    data = _json(event.data)
    size = ROW_BYTES + len(data) + len(event.template or b"")
    cursor = connection.execute(
        "INSERT INTO events (at_ms, kind, bytes, data, template) VALUES (?, ?, ?, ?, ?)",
        (event.at_ms, event.kind, size, data, event.template),
    )
    assert cursor.lastrowid is not None
    return cursor.lastrowid, size


def _add(connection: sqlite3.Connection, id: int, item: Finish | Picture) -> int:
    """Add to an event, if it is still there; how many bytes that takes."""
    row = connection.execute("SELECT bytes, data FROM events WHERE id = ?", (id,)).fetchone()
    if row is None:
        return 0
    size, data = row
    if isinstance(item, Picture):
        connection.execute(
            "UPDATE events SET picture = ?, bytes = ? WHERE id = ?",
            (item.jpeg, size + len(item.jpeg), id),
        )
        return len(item.jpeg)
    changed = _json(json.loads(data) | item.data)
    added = len(changed) - len(data)
    connection.execute(
        "UPDATE events SET took_ms = ?, data = ?, bytes = ? WHERE id = ?",
        (item.took_ms, changed, size + added, id),
    )
    return added


def _json(data: dict[str, Any]) -> str:
    """Data as JSON in ASCII; only its short values where it would be too long."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    if len(text) <= MAX_DATA:
        return text
    short = {name: value for name, value in data.items() if len(json.dumps(value)) <= 512}
    return json.dumps(short, allow_nan=False, separators=(",", ":"))


def _size(connection: sqlite3.Connection) -> tuple[int, int]:
    count, total = connection.execute(
        "SELECT count(*), coalesce(sum(bytes), 0) FROM events"
    ).fetchone()
    return count, total
