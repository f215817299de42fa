"""What happens to the gestures, whoever changes them and however."""

import asyncio
import logging
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from app.errors import FarhandError
from app.gateway.diary.writer import Writer
from app.gestures import GestureStore
from app.gestures.outline import GestureOutline, Outline, outline
from app.memory import Kind

log = logging.getLogger(__name__)

GATHER_S = 0.2
"""Changes that follow one another more quickly are looked at together."""


class Change(NamedTuple):
    """One thing that is different."""

    kind: Kind
    data: dict[str, Any]
    id: str | None = None
    """Of the gesture whose newest template shows it."""


class GestureDiary:
    """Compares what the galleries hold with what they held. Used on the event loop.

    So it tells of changes by the page, by programs and by the command line alike, and routes need
    not tell it anything.

    Args:
        store: The gestures.
        writer: Where to.
        gone: Told the ids of galleries that are gone, in a thread.
    """

    def __init__(
        self, store: GestureStore, writer: Writer, gone: Callable[[frozenset[str]], None]
    ) -> None:
        self._store = store
        self._writer = writer
        self._gone = gone
        self._before: Outline | None = None
        self._changed = asyncio.Event()

    @property
    def galleries(self) -> frozenset[str] | None:
        """Ids of those that there were at the last look; None when they could not be read."""
        return None if self._before is None else self._before.galleries

    def changed(self) -> None:
        """Something has changed."""
        self._changed.set()

    async def open(self) -> None:
        """Remember what there is now."""
        try:
            self._before = await asyncio.to_thread(outline, self._store.base)
        except FarhandError as error:
            log.warning("the timeline does not know the gestures: %s", error.message)

    async def run(self) -> None:
        """Tell what is new, for ever."""
        while True:
            await self._changed.wait()
            await asyncio.sleep(GATHER_S)
            try:
                await self.look()
            except Exception:
                log.exception("the timeline misses changes of gestures")

    async def look(self) -> None:
        """Tell what is new since the last look."""
        if not self._changed.is_set():
            return
        self._changed.clear()
        try:
            now = await asyncio.to_thread(outline, self._store.base)
            before, self._before = self._before, now
            if before is None:
                return
            for change in differences(before, now):
                template = None
                if change.id is not None:
                    template = await asyncio.to_thread(self._newest, change.id)
                self._writer.record(change.kind, template=template, **change.data)
            if gone := before.galleries - now.galleries:
                await asyncio.to_thread(self._gone, gone)
        except FarhandError as error:
            log.warning("the timeline misses changes of gestures: %s", error.message)

    def _newest(self, id: str) -> bytes | None:
        try:
            samples = self._store.get(id).samples
        except FarhandError:  # it is gone again
            return None
        return samples[-1].template if samples else None


def differences(before: Outline, now: Outline) -> Iterator[Change]:
    """What to tell. A gallery that is new or gone is one change, whatever it holds."""
    for gallery in now.galleries - before.galleries:
        count = sum(gesture.gallery == gallery for gesture in now.gestures.values())
        yield Change("gallery", {"gallery": gallery, "what": "made", "gestures": count})
    for gallery in before.galleries - now.galleries:
        yield Change("gallery", {"gallery": gallery, "what": "deleted"})
    both = before.galleries & now.galleries
    for id, gesture in before.gestures.items():
        if id not in now.gestures and gesture.gallery in both:
            yield Change("retired", {**_of(gesture), "how": "deleted"})
    for id, gesture in now.gestures.items():
        former = before.gestures.get(id)
        if gesture.gallery not in both or gesture == former:
            continue
        if former is None:
            yield Change("enrolled", _of(gesture), id)
        elif former.active and not gesture.active:
            yield Change("retired", {**_of(gesture), "how": "inactive"})
        else:
            yield Change("changed", {**_of(gesture), "what": _what(former, gesture)}, id)


def _of(gesture: GestureOutline) -> dict[str, Any]:
    return {"gesture": gesture.name, "gallery": gesture.gallery}


def _what(before: GestureOutline, now: GestureOutline) -> list[str]:
    """Which parts of a gesture are different."""
    parts = {
        "name": before.name != now.name,
        "action": before.version != now.version,
        "active": before.active != now.active,
        "samples": before.samples != now.samples,
    }
    return [name for name, different in parts.items() if different]
