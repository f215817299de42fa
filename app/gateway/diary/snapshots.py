"""Small pictures of the robot for the timeline, taken when something happens."""

import asyncio
import logging
from collections.abc import Awaitable, Callable

import cv2
import simplejpeg

from app.errors import FarhandError

log = logging.getLogger(__name__)

SIDE = 160
"""Pixels of the longer side."""
QUALITY = 70
PAUSE_S = 0.3
"""Between two pictures: what happens sooner shares the next one."""
WAITING = 16
"""Events that may wait for a picture; further ones get none."""

TakePicture = Callable[[], Awaitable[bytes]]
"""A fresh JPEG; raises a FarhandError when there is none."""


class Snapshots:
    """One picture at a time, made small in a thread. Used on the event loop.

    Args:
        take: Takes a picture.
        keep: Told the token of an event and its picture.
    """

    def __init__(self, take: TakePicture, keep: Callable[[int, bytes], None]) -> None:
        self._take = take
        self._keep = keep
        self._waiting: list[int] = []
        self._task: asyncio.Task[None] | None = None

    def want(self, token: int) -> None:
        """An event that has just begun should have a picture."""
        if len(self._waiting) >= WAITING:
            return
        self._waiting.append(token)
        if self._task is None or self._task.done():
            self._task = asyncio.create_task(self._run())

    async def close(self) -> None:
        """Take no more."""
        self._waiting = []
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    async def _run(self) -> None:
        while self._waiting:
            tokens, self._waiting = self._waiting, []
            try:
                small = await asyncio.to_thread(thumbnail, await self._take())
            except (FarhandError, ValueError, RuntimeError) as error:
                log.debug("an event has no picture: %s", error)
            else:
                for token in tokens:
                    self._keep(token, small)
            await asyncio.sleep(PAUSE_S)


def thumbnail(jpeg: bytes) -> bytes:
    """The same picture, :data:`SIDE` pixels at most; 3 to 6 KB.

    Raises:
        ValueError: it is not a JPEG that can be read.
    """
    pixels = simplejpeg.decode_jpeg(jpeg, colorspace="BGR", fastdct=True)
    height, width = pixels.shape[:2]
    scale = SIDE / max(height, width)
    if scale < 1:
        size = (max(1, round(width * scale)), max(1, round(height * scale)))
        pixels = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
    small: bytes = simplejpeg.encode_jpeg(pixels, quality=QUALITY, colorspace="BGR")
    return small
