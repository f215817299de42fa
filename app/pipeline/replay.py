"""Replay: a video file or a folder of pictures through the pipeline, as the operator's frames.

Time is the recording's own, so that the same file leads to the same messages on any machine.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import simplejpeg

from app.errors import FrameRefused, Invalid, NotFound
from app.pipeline.evaluate import SUFFIXES
from app.pipeline.pipeline import Pipeline
from app.pipeline.types import U8, GestureEvent

JPEG_QUALITY = 80
"""The page's own (``canvas.toBlob`` at 0.8)."""


def replay(source: Path, pipeline: Pipeline, fps: float | None = None) -> Iterator[dict[str, Any]]:
    """Run a recording through the pipeline.

    Args:
        source: A video file that OpenCV can read, or a folder whose pictures are the frames, in the
            order of their names. JPEG files are taken as they are, everything else is encoded.
        pipeline: As for a live operator; it is reset first.
        fps: Frames a second. None: the video's own, or 30 for a folder.

    Yields:
        The WebSocket's messages: ``frame`` and ``error`` for each frame, and ``gesture``.

    Raises:
        NotFound: no such file or folder.
        Invalid: nothing in it that can be read, or fps is not above 0.
    """
    if fps is not None and not fps > 0:
        raise Invalid(f"{fps} frames a second: more than 0 is needed")
    if source.is_dir():
        frames, rate = _folder(source, pipeline), fps or 30.0
    elif source.exists():
        video = cv2.VideoCapture(str(source))
        if not video.isOpened():
            raise Invalid(f"{source} is not a video that can be read")
        own = video.get(cv2.CAP_PROP_FPS)
        frames, rate = _video(video, pipeline), fps or (own if 1 <= own <= 240 else 30.0)
    else:
        raise NotFound(f"no file or folder {source}")
    return _messages(frames, pipeline, rate, source)


def _messages(
    frames: Iterator[bytes], pipeline: Pipeline, rate: float, source: Path
) -> Iterator[dict[str, Any]]:
    pipeline.reset()
    seq = -1
    for seq, jpeg in enumerate(frames):
        now = seq / rate
        try:
            result = pipeline(jpeg, seq=seq, now=now)
        except FrameRefused as error:
            yield {"type": "error", "code": error.code, "message": error.message, "seq": seq}
            event = pipeline.tick(now)
        else:
            yield result.as_message(tick=round(now * 1000))
            event = result.event
        if event is not None:
            yield _gesture(event)
    if seq < 0:
        raise Invalid(f"no frame in {source} can be read")
    last = pipeline.tick(seq / rate + pipeline.settings.agreement.release_s + 1 / rate)
    if last is not None:
        yield _gesture(last)


def _gesture(event: GestureEvent) -> dict[str, Any]:
    return {
        "type": "gesture",
        "gesture": event.gesture,
        "phase": event.phase,
        "seq": event.seq,
    }


def _folder(folder: Path, pipeline: Pipeline) -> Iterator[bytes]:
    for path in sorted(folder.iterdir()):
        if path.suffix.lower() not in SUFFIXES:
            continue
        data = path.read_bytes()
        if path.suffix.lower() in (".jpg", ".jpeg"):
            yield data
            continue
        picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR) if data else None
        # What cannot be read goes on as it is, to be refused by name like any other frame.
        yield data if picture is None else _encode(picture.astype(np.uint8), pipeline)


def _video(video: cv2.VideoCapture, pipeline: Pipeline) -> Iterator[bytes]:
    try:
        while True:
            more, picture = video.read()
            if not more:
                return
            yield _encode(picture.astype(np.uint8, copy=False), pipeline)
    finally:
        video.release()


def _encode(picture: U8, pipeline: Pipeline) -> bytes:
    limits = pipeline.settings.decode
    height, width = picture.shape[:2]
    scale = min(1.0, limits.max_width / width, limits.max_height / height)
    if scale < 1:
        size = int(width * scale), int(height * scale)
        picture = cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.uint8)
    jpeg: bytes = simplejpeg.encode_jpeg(
        np.ascontiguousarray(picture), JPEG_QUALITY, "BGR", colorsubsampling="420"
    )
    return jpeg
