"""Smaller pictures for viewers on slow links, made once however many viewers want them."""

import asyncio
import logging
from concurrent.futures import ThreadPoolExecutor

import cv2
import simplejpeg

from app.gateway.picture_pace import LEVELS, Level
from app.link.header import HEADER_SIZE

log = logging.getLogger(__name__)


class SmallPictures:
    """One camera's newest picture at each level. Used on the event loop only.

    A level is made when the first viewer asks for it, in the camera's own thread; all who ask
    meanwhile and afterwards get the same bytes. So there are at most as many encodings a second as
    the camera has pictures, times the levels in use.
    """

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, "small-picture")
        self._made: dict[int, tuple[bytes, asyncio.Future[bytes]]] = {}

    async def __call__(self, picture: bytes, level: int) -> bytes:
        """The picture (24-byte header and JPEG) at a level; what cannot be read stays as it is."""
        wanted = LEVELS[level]
        if wanted.quality is None:
            return picture
        source, made = self._made.get(level, (b"", None))
        if made is None or source is not picture:
            loop = asyncio.get_running_loop()
            made = loop.run_in_executor(self._thread, smaller, picture, wanted)
            self._made[level] = (picture, made)
        return await asyncio.shield(made)


def smaller(picture: bytes, level: Level) -> bytes:
    """Re-encode a picture as a level wants it.

    Args:
        picture: 24-byte header and JPEG.
        level: With a quality.
    """
    try:
        pixels = simplejpeg.decode_jpeg(picture[HEADER_SIZE:], colorspace="BGR", fastdct=True)
    except (ValueError, RuntimeError) as error:
        log.debug("a picture cannot be made smaller: %s", error)
        return picture
    height, width = pixels.shape[:2]
    size = (max(1, round(width * level.scale)), max(1, round(height * level.scale)))
    pixels = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
    quality = level.quality or 0
    jpeg: bytes = simplejpeg.encode_jpeg(pixels, quality=quality, colorspace="BGR")
    return picture[:HEADER_SIZE] + jpeg
