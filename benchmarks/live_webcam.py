"""A webcam that shows what a script wants now: the drawn hand, raised and lowered while it runs.

Chromium's stand-in for a webcam (``--use-file-for-fake-video-capture``) reads a raw video (Y4M)
frame by frame from the file and begins anew at its end. Here the file holds one frame, which is
overwritten in place thirty times a second: so the browser's own webcam, with all that follows it,
sees a live picture. A frame that is read while it is written is half old and half new, as with a
camera that reads out row by row.
"""

import os
import threading
import time
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Self

import cv2
import numpy as np

from app.gestures.hand.poses import RELAXED
from benchmarks.streams.hands import Drawn
from benchmarks.streams.scene import HEIGHT, U8, WIDTH, Cutout, Studio, plain_room, tremor

FPS = 30
RAISE_S = 0.6
"""A hand is raised from the desk, or lowered to it."""
_DESK = 1.5 * HEIGHT
"""Pixels; so far below its place the hand rests, out of view."""
_FORMING = 5
"""The sign is formed in so many steps, in the first half of the way up."""
_SHAKE_S = 20
_LOOK_S = 0.005
_HEAD = f"YUV4MPEG2 W{WIDTH} H{HEIGHT} F{FPS}:1 Ip A1:1 C420jpeg\nFRAME\n".encode()


class Clock:
    """The time of day's; :mod:`benchmarks.virtual_drive` has another."""

    def now(self) -> float:
        """Seconds, monotonic."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        time.sleep(seconds)


class LiveWebcam:
    """One person before a webcam. A context manager: the picture is live inside it.

    Args:
        path: The file that Chromium reads; written at once, so that a browser may be started.
            None: there is no browser, and somebody else takes the pictures.
        seed: Of the person (size, place, skin, the shape of each sign), the wall, and the tremor.
        tremor_px: Standard deviation of the trembling of a hand at rest, pixels.
        clock: By which the hand moves.

    Attributes:
        person: Whose hand it is; may be replaced, when the same person shows a sign another way.
    """

    def __init__(
        self,
        path: Path | None,
        seed: int = 0,
        tremor_px: float = 0.35,
        clock: Clock | None = None,
    ) -> None:
        self.path = path
        self.clock = clock or Clock()
        self._generator = np.random.default_rng(seed)
        self.person = Drawn.of(self._generator)
        self._studio = Studio(self._generator, plain_room(self._generator), FPS)
        self._shakes = tremor(FPS * _SHAKE_S, FPS, tremor_px, self._generator)
        self._ways: dict[tuple[int, str], list[Cutout]] = {}
        self._wanted: str | None = None
        self._rests_since: float | None = None
        self._gone = True
        self.pictures = self._frames()
        """What the webcam sees, without end; 30 are to be taken a second."""
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._play, name="webcam", daemon=True)
        if path is not None:
            path.write_bytes(_HEAD + _planes(self._studio.shoot()))

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._over.set()
        self._thread.join(10)

    def practise(self, *names: str) -> None:
        """Draw the hands of these gestures beforehand, so that none is drawn while it plays."""
        for name in names:
            self._way(name)

    def raise_hand(self, gesture: str) -> float:
        """Raise the hand in a gesture and hold it still.

        Returns:
            When it came to rest, s, ``time.monotonic``.

        Raises:
            TimeoutError: the picture is not live.
        """
        self.begin_to_raise(gesture)
        self._wait_until(lambda: self._rests_since is not None)
        assert self._rests_since is not None
        return self._rests_since

    def begin_to_raise(self, gesture: str) -> None:
        """The hand starts on its way up with the next picture."""
        self._wanted = gesture

    def lower_hand(self, *, wait: bool = True) -> None:
        """Take the hand out of view.

        Raises:
            TimeoutError: the picture is not live.
        """
        self._wanted = None
        if wait:
            self._wait_until(lambda: self._gone)

    def _wait_until(self, done: Callable[[], bool]) -> None:
        gives_up = self.clock.now() + 30
        while not done():
            if self.clock.now() > gives_up:
                raise TimeoutError("the hand does not move: are the pictures taken?")
            self.clock.sleep(_LOOK_S)

    def _way(self, name: str) -> list[Cutout]:
        """The hand on its way from relaxed to the sign, which is the last of them."""
        key = self.person.seed, name
        if key not in self._ways:
            pose = self.person.pose(name)
            self._ways[key] = [
                self.person.between(RELAXED, pose, step / _FORMING)
                for step in range(1, _FORMING + 1)
            ]
        return self._ways[key]

    def _frames(self) -> Iterator[U8]:
        """Pictures without end."""
        shoot = self._studio.shoot
        while True:
            name = self._wanted
            if name is None:
                yield shoot()
                continue
            self._gone = False
            way = self._way(name)
            for share in self._travel():
                hand = way[min(int(2 * share * _FORMING), _FORMING - 1)]
                yield shoot((hand, (0.0, _DESK * (1 - share))))
            for number in count():
                yield shoot((way[-1], self._shakes[number % len(self._shakes)]))
                if number == 0:
                    self._rests_since = self.clock.now()
                if self._wanted != name:
                    break
            self._rests_since = None
            for share in self._travel():
                yield shoot((way[-1], (0.0, _DESK * share)))
            yield shoot()
            self._gone = True

    def _travel(self) -> Iterator[float]:
        """Shares of a way, with minimum jerk (Flash and Hogan 1985), by the clock."""
        began = self.clock.now()
        while (t := (self.clock.now() - began) / RAISE_S) < 1:
            yield 10 * t**3 - 15 * t**4 + 6 * t**5

    def _play(self) -> None:
        assert self.path is not None
        file = os.open(self.path, os.O_WRONLY)
        due = time.monotonic()
        for picture in self.pictures:
            os.pwrite(file, _planes(picture), len(_HEAD))
            due = max(due + 1 / FPS, time.monotonic() - 1 / FPS)
            if self._over.wait(max(0.0, due - time.monotonic())):
                break
        os.close(file)


def _planes(picture: U8) -> bytes:
    """BGR to planar YUV 4:2:0, as Y4M has it."""
    return cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_I420).tobytes()
