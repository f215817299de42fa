"""What recognition makes of the signs at each size and quality in which the page sends pictures.

Drawn people (:mod:`benchmarks.live_webcam`), each another size, skin and way to show each sign
before another wall, raise a hand and hold it still, by a virtual clock. The same pictures go
through the pipeline in every size and quality of ``LEVELS`` in app/static/core/send-pace.js, each
time from a fresh start.

    python -m benchmarks.sent_pictures [--people 16] [--seconds 2] [--save FILE]
"""

from collections import Counter
from collections.abc import Iterator
from multiprocessing import Pool
from typing import NamedTuple

import cv2
import numpy as np

from app.config import PipelineSettings
from app.pipeline import PcaMatcher, Pipeline
from benchmarks.live_webcam import FPS, Clock, LiveWebcam
from benchmarks.pick_and_place import GESTURES
from benchmarks.pipeline_speed import starter_gallery
from benchmarks.report import arguments, report
from benchmarks.streams.scene import HEIGHT, U8, WIDTH

LEVELS = ((False, 80), (False, 60), (True, 70), (True, 50))
"""Whether the size is halved, and the JPEG quality."""


class Showing(NamedTuple):
    """What came of one sign of one person at one level."""

    person: int
    sign: str
    level: tuple[bool, int]
    frames: Counter[str | None]
    """Frames in which each gesture was in force."""

    @property
    def mistaken(self) -> bool:
        """Another gesture than the one shown was in force at any time."""
        return bool(self.frames.keys() - {None, self.sign})


class _FrameClock(Clock):
    """Stands still but for :meth:`pass_frame`."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        return self._now

    def pass_frame(self) -> None:
        self._now += 1 / FPS


def pictures(person: int, sign: str, seconds: float) -> Iterator[U8]:
    """(480, 640, 3) BGR, from the hand out of view to the hand at rest, as a webcam has them."""
    clock = _FrameClock()
    webcam = LiveWebcam(None, person, clock=clock)
    webcam.begin_to_raise(sign)
    for _ in range(round(seconds * FPS)):
        clock.pass_frame()
        planes = cv2.cvtColor(next(webcam.pictures), cv2.COLOR_BGR2YUV_I420)
        yield np.asarray(cv2.cvtColor(planes, cv2.COLOR_YUV2BGR_I420), np.uint8)


def show(person: int, seconds: float) -> list[Showing]:
    """All signs of one person at all levels."""
    cv2.setNumThreads(1)
    settings = PipelineSettings()
    matcher = PcaMatcher.fit(starter_gallery(99), settings.match)
    showings = []
    for sign in GESTURES:
        frames = list(pictures(person, sign, seconds))
        for level in LEVELS:
            pipeline = Pipeline(settings, matcher)
            seen: Counter[str | None] = Counter()
            for number, frame in enumerate(frames, start=1):
                result = pipeline(packed(frame, level), seq=number, now=number / FPS)
                seen[result.gesture] += 1
            showings.append(Showing(person, sign, level, seen))
    return showings


def packed(frame: U8, level: tuple[bool, int]) -> bytes:
    """A frame as JPEG at a level."""
    halved, quality = level
    if halved:
        size = WIDTH // 2, HEIGHT // 2
        frame = cv2.resize(frame, size, interpolation=cv2.INTER_AREA).astype(frame.dtype)
    return cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--people", type=int, default=16)
    parser.add_argument("--seconds", type=float, default=2.0, help="of each showing")
    options = parser.parse_args()
    work = [(person, options.seconds) for person in range(options.people)]
    with Pool(2) as pool:
        showings = [one for found in pool.starmap(show, work, chunksize=1) for one in found]
    for one in showings:
        if one.mistaken or one.sign not in one.frames:
            print(f"person {one.person}, {one.sign}, {one.level}: {dict(one.frames)}")
    rows: dict[str, dict[str, float]] = {}
    for level in LEVELS:
        mine = [one for one in showings if one.level == level]
        halved, quality = level
        rows[f"{'half size' if halved else 'full size'}, quality {quality}"] = {
            "signs": len(mine),
            "mistaken": sum(one.mistaken for one in mine),
            "not seen": sum(one.sign not in one.frames for one in mine),
            "frames in force": sum(one.frames[one.sign] for one in mine),
        }
    report(rows, options)


if __name__ == "__main__":
    main()
