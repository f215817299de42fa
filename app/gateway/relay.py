"""Camera pictures from the robot to any number of viewers.

One watch per camera on the link while anybody looks, so that the robot renders only then. Each
viewer has one slot: a slow one loses pictures and slows nobody.
"""

import asyncio
import contextlib
import logging
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from app.errors import FarhandError, NotFound, WorldError
from app.gateway.robot_port import RobotPort, Watch
from app.gateway.small_pictures import SmallPictures
from app.link.header import HEADER_SIZE, FrameHeader
from app.link.messages import CameraDescription

log = logging.getLogger(__name__)

DEFAULT_CAMERAS = ("wrist", "scene")
"""Until the robot has described itself."""
LINGER_S = 1.0
"""A watch lives on this long without viewers, so that polling single pictures stays quick."""
RETRY_S = 0.25
AT_ONCE = 8
"""Viewers that are woken in one turn of the event loop. A hundred at once would keep the driver's
next frame waiting until each has been sent its picture."""


class NoPicture(WorldError):
    """A camera gave no picture in time."""

    default_code = "no_picture"


class Viewer:
    """One viewer's slot. Used on the event loop only.

    Args:
        small: Makes the camera's pictures smaller.
    """

    def __init__(self, small: SmallPictures) -> None:
        self._small = small
        self._picture: bytes | None = None
        self._ready = asyncio.Event()
        self.dropped = 0

    def put(self, picture: bytes) -> None:
        """Offer a picture; one that still waits is lost. To be followed by :meth:`wake`."""
        if self._picture is not None:
            self.dropped += 1
        self._picture = picture

    def wake(self) -> None:
        """Let who waits for a picture have it."""
        self._ready.set()

    async def next(self) -> bytes:
        """Wait for the newest picture: 24-byte header and JPEG."""
        while self._picture is None:
            self._ready.clear()
            await self._ready.wait()
        picture, self._picture = self._picture, None
        return picture

    async def next_at(self, level: int) -> bytes:
        """:meth:`next`, at one of :data:`~app.gateway.picture_pace.LEVELS`."""
        return await self._small(await self.next(), level)


class _Camera:
    """The viewers of one camera and the watch that feeds them."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.viewers: set[Viewer] = set()
        self.small = SmallPictures()
        self.watch: Watch | None = None
        self.task: asyncio.Task[None] | None = None


class Relay:
    """All cameras of one robot. Used on the event loop only.

    Args:
        robot: Where the pictures come from.
        on_picture: Told the camera's name for each picture, for the metrics.
    """

    def __init__(self, robot: RobotPort, on_picture: Callable[[str], None] | None = None) -> None:
        self._robot = robot
        self._on_picture = on_picture
        self._cameras: dict[str, _Camera] = {}

    def describe(self) -> list[CameraDescription]:
        """The robot's cameras."""
        description = self._robot.description
        if description is not None:
            return list(description.cameras)
        return [
            CameraDescription(name=name, width=0, height=0, fov_degrees=0.0)
            for name in DEFAULT_CAMERAS
        ]

    def check(self, name: str) -> None:
        """Refuse the name of a camera that is not there.

        Raises:
            NotFound: no camera has this name.
        """
        names = [camera.name for camera in self.describe()]
        if name not in names:
            raise NotFound(
                f"there is no camera {name[:40]!r}; there are {', '.join(names)}",
                code="unknown_camera",
                camera=name[:40],
            )

    @property
    def viewers(self) -> int:
        """How many look, over all cameras."""
        return sum(len(camera.viewers) for camera in self._cameras.values())

    @asynccontextmanager
    async def view(self, name: str) -> AsyncIterator[Viewer]:
        """Look through a camera: ``async with relay.view("wrist") as viewer``.

        Raises:
            NotFound: no camera has this name.
        """
        self.check(name)
        camera = self._cameras.setdefault(name, _Camera(name))
        viewer = Viewer(camera.small)
        camera.viewers.add(viewer)
        if camera.task is None or camera.task.done():
            camera.task = asyncio.create_task(self._keep_watch(camera))
        try:
            yield viewer
        finally:
            camera.viewers.discard(viewer)

    async def picture(self, name: str, timeout_s: float) -> bytes:
        """One fresh JPEG, taken after the call as far as the link can tell.

        Raises:
            NotFound: no camera has this name.
            NoPicture: none came in time.
        """
        async with self.view(name) as viewer:
            try:
                async with asyncio.timeout(timeout_s):
                    return (await viewer.next())[HEADER_SIZE:]
            except TimeoutError:
                because = self._robot.fault or "the camera does not answer"
                raise NoPicture(
                    f"camera {name!r} gave no picture within {timeout_s:g} s: {because}",
                    camera=name,
                ) from None

    async def close(self) -> None:
        """End all watches."""
        for camera in self._cameras.values():
            if camera.task is not None:
                camera.task.cancel()
                with contextlib.suppress(asyncio.CancelledError):
                    await camera.task

    async def _keep_watch(self, camera: _Camera) -> None:
        """Hold a watch while there are viewers, and a little longer."""
        loop = asyncio.get_running_loop()

        def arrived(header: FrameHeader, jpeg: bytes) -> None:
            # On a thread of the link. The loop may be closing.
            with contextlib.suppress(RuntimeError):
                loop.call_soon_threadsafe(self._share, camera, header.pack() + jpeg)

        last_seen = time.monotonic()
        try:
            while True:
                if camera.viewers:
                    last_seen = time.monotonic()
                elif time.monotonic() - last_seen > LINGER_S:
                    await self._end_watch(camera)
                    if not camera.viewers:
                        return
                if camera.watch is None:
                    try:
                        camera.watch = await asyncio.to_thread(
                            self._robot.watch_camera, camera.name, arrived
                        )
                    except FarhandError as error:
                        log.debug("camera %s: %s", camera.name, error.message)
                    except Exception:
                        log.exception("camera %s cannot be watched", camera.name)
                await asyncio.sleep(RETRY_S)
        finally:
            await self._end_watch(camera)

    async def _end_watch(self, camera: _Camera) -> None:
        """Stop watching. Somebody may come to look meanwhile."""
        watch, camera.watch = camera.watch, None
        if watch is not None:
            await asyncio.shield(asyncio.to_thread(watch.close))

    def _share(self, camera: _Camera, picture: bytes) -> None:
        if self._on_picture is not None:
            self._on_picture(camera.name)
        viewers = tuple(camera.viewers)
        for viewer in viewers:
            viewer.put(picture)
        self._wake(viewers)

    def _wake(self, viewers: tuple[Viewer, ...]) -> None:
        for viewer in viewers[:AT_ONCE]:
            viewer.wake()
        if len(viewers) > AT_ONCE:
            asyncio.get_running_loop().call_soon(self._wake, viewers[AT_ONCE:])
