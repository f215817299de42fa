"""Everything that writes the timeline of one server, put together."""

import asyncio
import logging
from collections.abc import Callable
from pathlib import Path

from app.config import MemorySettings
from app.errors import FarhandError, MemoryUnavailable
from app.gateway.diary.gestures import GestureDiary
from app.gateway.diary.robot import RobotDiary
from app.gateway.diary.session import SessionDiary
from app.gateway.diary.snapshots import Snapshots
from app.gateway.diary.writer import Writer
from app.gateway.relay import Relay
from app.gateway.robot_port import RobotPort
from app.gestures import GestureStore
from app.memory import Database, EventStore, SettingsStore, open_memory

log = logging.getLogger(__name__)

FILE = "memory.db"
LOOK_S = 0.1
"""The robot keeps its newest five steps: so many within this time would have to be missed."""
SIGN_IN_S = 60.0
"""Wrong tokens are told at most this often, with how many there were."""
PICTURE_S = 3.0
CAMERA = "scene"
"""The camera whose pictures are kept, where a robot has one of this name."""


class Diary:
    """Used on the event loop.

    Args:
        folder: Where its file is.
        settings: How much is kept.
        robot: Whose states are watched.
        relay: Where pictures come from.
        gestures: Whose changes are watched.
        written: Told the newest event's id, on the event loop.
    """

    def __init__(
        self,
        folder: Path,
        settings: MemorySettings,
        robot: RobotPort,
        relay: Relay,
        gestures: GestureStore,
        written: Callable[[int], None],
    ) -> None:
        self._database: Database | None = None
        self._events: EventStore | None = None
        self._settings: SettingsStore | None = None
        self._problem = ""
        try:
            self._database = open_memory(folder / FILE)
            self._events = EventStore(self._database, settings.events, settings.bytes)
            self._settings = SettingsStore(self._database)
        except FarhandError as error:
            # Who drives needs no memory: the server starts without.
            self._problem = error.message
            log.error("nothing is remembered: %s", error.message)
        loop = asyncio.get_running_loop()

        def told(newest: int) -> None:
            loop.call_soon_threadsafe(written, newest)

        self._relay = relay
        self._writer = Writer(self._events, told)
        self._snapshots = Snapshots(self._picture, self._writer.picture)
        self.robot = RobotDiary(robot, self._writer, self._snapshots)
        self.gestures = GestureDiary(gestures, self._writer, self._forget)
        self._wrong: Callable[[], int] = lambda: 0
        self._wrong_told = 0
        self._wrong_at = float("-inf")

    @property
    def lost(self) -> int:
        """Events that were not written."""
        return self._writer.lost

    @property
    def events(self) -> EventStore:
        """What was written.

        Raises:
            MemoryUnavailable: it cannot be opened.
        """
        if self._events is None:
            raise MemoryUnavailable(f"nothing is remembered: {self._problem}")
        return self._events

    @property
    def settings(self) -> SettingsStore:
        """What people have chosen.

        Raises:
            MemoryUnavailable: it cannot be opened.
        """
        if self._settings is None:
            raise MemoryUnavailable(f"nothing is remembered: {self._problem}")
        return self._settings

    def of_session(self, name: str) -> SessionDiary:
        """The part of one session."""
        return SessionDiary(name, self._writer, self._snapshots)

    def watch_sign_ins(self, wrong: Callable[[], int]) -> None:
        """Tell when ``wrong()``, the number of wrong tokens so far, rises."""
        self._wrong = wrong

    async def run(self, version: str) -> None:
        """Watch, for ever."""
        self._writer.record("started", version=version)
        await self.gestures.open()
        await asyncio.to_thread(self._tidy)
        async with asyncio.TaskGroup() as group:
            group.create_task(self.gestures.run())
            group.create_task(self._watch())

    async def close(self) -> None:
        """Write what is left."""
        await self._snapshots.close()
        await self.gestures.look()
        await asyncio.to_thread(self._writer.close)
        if self._database is not None:
            await asyncio.to_thread(self._database.close)

    def _forget(self, galleries: frozenset[str]) -> None:
        """Galleries are gone, and what their owners chose with them."""
        for gallery in galleries if self._settings is not None else ():
            self.settings.forget(gallery)

    def _tidy(self) -> None:
        """The same for those that went while no server ran."""
        there = self.gestures.galleries
        if self._settings is None or there is None:
            return
        try:
            self._settings.keep_only(there)
        except FarhandError as error:
            log.warning("settings of people who are gone stay: %s", error.message)

    async def _watch(self) -> None:
        while True:
            try:
                self.robot.look()
                self._look_at_sign_ins()
            except Exception:
                log.exception("the timeline misses something")
            await asyncio.sleep(LOOK_S)

    def _look_at_sign_ins(self) -> None:
        now = asyncio.get_running_loop().time()
        wrong = self._wrong()
        if wrong > self._wrong_told and now - self._wrong_at >= SIGN_IN_S:
            self._writer.record("sign_in", count=wrong - self._wrong_told)
            self._wrong_told, self._wrong_at = wrong, now

    async def _picture(self) -> bytes:
        names = [camera.name for camera in self._relay.describe()]
        if not names:
            raise MemoryUnavailable("the robot has no camera")
        return await self._relay.picture(CAMERA if CAMERA in names else names[0], PICTURE_S)
