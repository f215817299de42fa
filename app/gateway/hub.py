"""Everything that lives as long as the server: opened in order, closed in the opposite one."""

import asyncio
import functools
import logging
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AsyncExitStack, asynccontextmanager
from importlib.metadata import PackageNotFoundError, version

from app.config import Settings
from app.errors import DatabaseBroken, NotAllowed, RobotUnavailable
from app.gateway.backup_keeper import BackupKeeper
from app.gateway.busy import BoundedThreads, Slots
from app.gateway.diary import Diary
from app.gateway.gallery import LiveGallery, open_for_server, place_of
from app.gateway.jobs import MOST_RUNNING, Jobs
from app.gateway.learning import fit
from app.gateway.lease_keeper import check_reply
from app.gateway.metrics import Metrics
from app.gateway.numbers import Counter, tick_ms
from app.gateway.operator_ws import tell_robot, watch_gallery
from app.gateway.people import People
from app.gateway.relay import Relay
from app.gateway.robot_port import RobotPort
from app.gateway.viser_scene import ViserScene
from app.gateway.work_pool import WorkPool
from app.gestures import GestureStore
from app.link.messages import (
    DryRunReport,
    DryRunRequest,
    LeaseReply,
    LeaseRequest,
    State,
    StopRequest,
)

log = logging.getLogger(__name__)

LINK_THREADS = 4
MOST_EXPORTS = 2
"""Galleries that are sent as a file at once."""
STOP_THREADS = 4
"""A stop never waits for a thread that a silent robot keeps busy."""


DATABASE_THREADS, DATABASE_WAITING = 4, 64
LEARN_THREADS, LEARN_WAITING = 2, 64
LEARN_NICENESS = 5
"""What a session waits for after a change is not as far behind everything else as uploads are."""
LEARN_MEMORY = 4
"""Times what a picture may take."""
CONFIRM_RESET_S = 1.0
"""So long a state is waited for that shows what the robot has agreed to."""
STATE_CHECK_S = 0.01


def package_version() -> str:
    """Version of the installed package."""
    try:
        return version("farhand")
    except PackageNotFoundError:
        return "unknown"


class Hub:
    """What the routes and sessions share. Used on the event loop."""

    def __init__(
        self,
        settings: Settings,
        store: GestureStore,
        gallery: LiveGallery,
        keeper: BackupKeeper,
        robot: RobotPort,
        viser: ViserScene | None,
    ) -> None:
        self.settings = settings
        self.store = store
        self.gallery = gallery
        self.keeper = keeper
        self.robot = robot
        self.viser = viser
        self.version = package_version()
        self.metrics = Metrics()
        self.metrics.add_live(self._live_values)
        self.holds = Counter()
        limits = settings.gateway
        self.people = People(robot, limits.max_sessions, limits.max_observers)
        self.relay = Relay(robot, lambda name: self.metrics.pictures.labels(name).inc())
        self.diary = Diary(
            settings.data_dir, settings.memory, robot, self.relay, store, self._tell_timeline
        )
        self.closing = asyncio.Event()
        self.checking = asyncio.Lock()
        """Held while a program is being checked."""
        self.jobs = Jobs()
        self.uploads = Slots(
            limits.max_uploads,
            f"{limits.max_uploads} uploads are under way, which is the most; try again",
        )
        """Held while an upload is read or worked on."""
        self.exports = Slots(
            MOST_EXPORTS, f"{MOST_EXPORTS} exports are under way, which is the most; try again"
        )
        self.database = BoundedThreads("database", DATABASE_THREADS, DATABASE_WAITING)
        """For what requests read and write. Nothing that stops or drives waits for these."""
        self.learners = BoundedThreads("gallery", LEARN_THREADS, LEARN_WAITING)
        """For those who wait until a gallery is learned."""
        memory = limits.work_mib << 20
        nice = limits.work_niceness
        self.pictures = WorkPool(limits.workers, 2 * limits.max_uploads, memory, nice)
        self.long_work = WorkPool(MOST_RUNNING, MOST_RUNNING, LEARN_MEMORY * memory, nice)
        self._learning = WorkPool(
            1, LEARN_WAITING, LEARN_MEMORY * memory, min(nice, LEARN_NICENESS)
        )
        gallery.learn = functools.partial(self._learning.call, fit)
        self._dry_run_thread = ThreadPoolExecutor(1, "dry-run")
        self._refresh_thread = ThreadPoolExecutor(1, "refresh")
        self._link_threads = ThreadPoolExecutor(LINK_THREADS, "link")
        self._stop_threads = ThreadPoolExecutor(STOP_THREADS, "stop")
        # All of them now: a system that is short of threads later gives a stop none.
        together = threading.Barrier(STOP_THREADS)
        for _ in range(STOP_THREADS):
            self._stop_threads.submit(together.wait)
        self._told_version = gallery.version
        self._told_problem = keeper.problem

    @classmethod
    @asynccontextmanager
    async def open(
        cls, settings: Settings, is_ending: Callable[[], bool] = lambda: False
    ) -> AsyncIterator["Hub"]:
        """Open everything, and close everything again.

        Args:
            settings: Of the whole server.
            is_ending: Whether to give up waiting for the robot.

        Raises:
            DatabaseBroken, CannotStart, LinkFailed: what is needed is not there.
        """
        async with AsyncExitStack() as stack:
            store, hold = await asyncio.to_thread(open_for_server, settings)
            if hold is not None:
                stack.callback(hold.close)
            stack.callback(store.close)
            keeper = BackupKeeper(place_of(settings), settings.backups)
            keeper.look()
            await asyncio.to_thread(keeper.make)
            stack.push_async_callback(asyncio.to_thread, keeper.finish)
            gallery = await asyncio.to_thread(LiveGallery, store, settings.pipeline)
            robot = RobotPort(settings)
            stack.push_async_callback(asyncio.to_thread, robot.close)
            robot.start()
            viser: ViserScene | None = None
            if settings.gateway.viser:
                viser = ViserScene(robot, settings.robot.profile)
                stack.push_async_callback(asyncio.to_thread, viser.close)
            hub = cls(settings, store, gallery, keeper, robot, viser)
            stack.push_async_callback(hub._close)
            deadline = asyncio.get_running_loop().time() + settings.gateway.ready_wait_s
            while (
                not (robot.online and robot.description is not None)
                and asyncio.get_running_loop().time() < deadline
                and not is_ending()
            ):
                await asyncio.sleep(0.02)
            tasks = [
                asyncio.create_task(tell_robot(hub)),
                asyncio.create_task(watch_gallery(hub)),
                asyncio.create_task(hub.diary.run(hub.version)),
            ]
            try:
                yield hub
            finally:
                hub.closing.set()
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)

    async def _close(self) -> None:
        await self.jobs.close()
        await self.diary.close()
        await self.relay.close()
        for work in (self.pictures, self.long_work, self._learning):
            await asyncio.to_thread(work.close)
        for threads in (self.database, self.learners):
            threads.close()
        for pool in (
            self._link_threads,
            self._stop_threads,
            self._dry_run_thread,
            self._refresh_thread,
        ):
            pool.shutdown(wait=False, cancel_futures=True)

    async def ask(self, request: LeaseRequest) -> LeaseReply:
        """Ask the robot's control loop.

        Raises:
            RobotUnavailable: no answer came in time.
        """
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._link_threads, self.robot.ask, request)

    async def stop(self, source: str, reason: str, by: str = "rest") -> None:
        """Stop the robot (category S1) and wait until it confirms.

        Args:
            source: Who asks.
            reason: Why, in plain words.
            by: How it was asked for: ``button``, ``gesture`` or ``rest``.

        Raises:
            RobotUnavailable: it was not confirmed in time.
        """
        request = StopRequest(source=source[:80], reason=reason[:300])
        timeout_s = self.settings.gateway.stop_confirm_ms / 1000
        loop = asyncio.get_running_loop()
        stopping = loop.run_in_executor(self._stop_threads, self.robot.stop, request, timeout_s)
        self.diary.robot.asked(request.source, request.reason, by)
        try:
            await stopping
        except RobotUnavailable:
            self.diary.robot.unconfirmed(request.source, by)
            raise

    async def reset(self, source: str) -> None:
        """Leave the latched stop; moves nothing.

        Raises:
            LeaseRefused: the robot says why not.
            RobotUnavailable: no answer came in time.
        """
        check_reply(await self.ask(LeaseRequest(kind="reset", holder=source[:80])))
        # What is told next should show it already; a state may have been on its way meanwhile.
        await self._newer_state(
            lambda state: (
                state.mode != "stopped"
                and state.latch.status == self.robot.stop_memory.kept.status == "none"
            )
        )

    async def reset_scene(self, source: str) -> None:
        """Put every movable thing back where it was at first.

        Raises:
            LeaseRefused: the robot is armed, or has not come to rest.
            RobotUnavailable: no answer came in time.
        """
        check_reply(await self.ask(LeaseRequest(kind="reset_scene", holder=source[:80])))
        await self._newer_state()

    async def _newer_state(self, so: Callable[[State], bool] = lambda _: True) -> None:
        """Wait a little for a state that comes after this call and is so. Takes no thread."""
        since = time.monotonic()
        while time.monotonic() - since < CONFIRM_RESET_S:
            if self.robot.has_newer(since, so):
                return
            await asyncio.sleep(STATE_CHECK_S)

    async def dry_run(self, request: DryRunRequest) -> DryRunReport:
        """Ask what an action would do; nothing moves. One at a time.

        Raises:
            Busy: another is under way.
            RobotUnavailable: no answer came in time.
        """
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._dry_run_thread, self.robot.dry_run, request)

    async def gallery_changed(self) -> None:
        """Read the gestures again if they changed, and tell every session."""
        loop = asyncio.get_running_loop()
        await loop.run_in_executor(self._refresh_thread, self.gallery.refresh)
        current = self.gallery.version
        if current != self._told_version:
            self._told_version = current
            self.keeper.changed()
            self.diary.gestures.changed()
            self._tell_gallery()

    async def tend_database(self) -> None:
        """Notice changes by other processes, back up what is due, tell what is wrong."""
        try:
            await self.gallery_changed()
        except DatabaseBroken as error:
            self.keeper.broke(error)
        finally:
            await asyncio.to_thread(self.keeper.look)
            await self.keeper.tend()
            if self.keeper.problem != self._told_problem:
                self._told_problem = self.keeper.problem
                log.warning("%s", self._told_problem or "the gestures are accepted")
                self.keeper.changed()
                self._tell_gallery()

    def check_gestures(self) -> None:
        """Do nothing if the gestures are those that people taught.

        Raises:
            NotAllowed: they were lost, and nobody has decided yet how to go on.
        """
        self.keeper.look()
        if self.keeper.problem is not None:
            raise NotAllowed(self.keeper.problem, code="gestures_lost")

    def _tell_gallery(self) -> None:
        for session in tuple(self.people.sessions):
            session.tell_gallery()

    def _tell_timeline(self, newest: int) -> None:
        message = {"type": "timeline", "tick": tick_ms(), "newest": newest}
        for session in self.people.sessions:
            session.outbox.put(message)

    def _live_values(self) -> Iterable[tuple[str, str, float | None]]:
        robot = self.robot
        state = robot.state
        yield "farhand_robot_online", "1 while the robot speaks", float(robot.online)
        yield "farhand_robot_state_age_seconds", "Age of the newest state", robot.age_s
        yield "farhand_robot_restarts", "Starts of the node after its first", float(robot.restarts)
        yield "farhand_camera_viewers", "Who looks at camera pictures", float(self.relay.viewers)
        yield "farhand_sessions", "Operator sessions open", float(len(self.people.sessions))
        yield (
            "farhand_gestures",
            "Gestures enrolled in the shared gallery",
            float(len(self.gallery.current.actions)),
        )
        yield (
            "farhand_galleries_fitted",
            "Galleries with a matcher: those in use, and a few that were lately",
            float(self.gallery.fitted),
        )
        yield "farhand_timeline_lost", "Events that were not written", float(self.diary.lost)
        if state is not None:
            yield "farhand_node_stops", "Stops the node received", float(state.stops)
            dropped = float(sum(state.dropped.values()))
            yield "farhand_node_commands_dropped", "Commands the node refused", dropped
            if state.loop is not None:
                yield "farhand_node_loop_hertz", "Rate of the control loop", state.loop.rate_hz
                late = state.loop.late_max_ms / 1000
                yield "farhand_node_loop_late_seconds", "Worst lateness, last second", late
                lost = float(state.loop.log_lines_dropped)
                yield "farhand_node_log_lines_dropped", "Log lines the node dropped", lost
