"""What the camera sees: a room, its light, and things pasted before it. 640x480, BGR, uint8."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

U8 = NDArray[np.uint8]
F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
WIDTH, HEIGHT = 640, 480
TREMOR_HZ = 9.0


class Label(NamedTuple):
    """The truth about one frame.

    Attributes:
        kind: ``none``: no enrolled gesture is shown; ``rest``: one is held still; ``moving``: the
            hand is on its way from one to another, or in or out of view.
        before: The gesture shown last, None when there was none. At rest the one that is shown.
        after: The gesture shown next, likewise.
    """

    kind: Literal["none", "rest", "moving"]
    before: str | None = None
    after: str | None = None


NOTHING = Label("none")


def rest(gesture: str | None) -> Label:
    """A hand at rest; None: it shows something that is not enrolled."""
    return NOTHING if gesture is None else Label("rest", gesture, gesture)


def moving(before: str | None, after: str | None) -> Label:
    """On the way; from and to nothing it shows nothing that is enrolled."""
    return NOTHING if before is None and after is None else Label("moving", before, after)


class Frame(NamedTuple):
    """A picture and its truth."""

    picture: U8
    label: Label


class Cutout(NamedTuple):
    """A thing without a background.

    Attributes:
        planes: (h, w, 4): BGR times cover, 0 to 255, and cover, 0 to 1.
        top: Row of the picture in which its corner lies.
        left: Column likewise.
    """

    planes: F32
    top: int
    left: int

    @classmethod
    def of(cls, colour: F32, cover: F32, *, arm: int = 0) -> "Cutout":
        """Crop premultiplied colour and cover; ``arm`` rows more are added below."""
        rows = np.flatnonzero(cover.max(axis=1) > 0.001)
        columns = np.flatnonzero(cover.max(axis=0) > 0.001)
        top, left = max(int(rows[0]) - 2, 0), max(int(columns[0]) - 2, 0)
        planes = np.dstack([colour, cover])[top : rows[-1] + 3, left : columns[-1] + 3]
        planes = np.pad(planes, ((0, arm), (0, 0), (0, 0)), mode="edge")
        return cls(np.ascontiguousarray(planes), top, left)

    def paste(self, picture: U8, shift: Sequence[float] | F64, turn: float = 0.0) -> None:
        """Put it before the picture, in place.

        Args:
            picture: (480, 640, 3), changed.
            shift: Pixels, right and down.
            turn: rad about its lower middle.
        """
        height, width = self.planes.shape[:2]
        whole = np.floor(shift).astype(int)
        part = np.asarray(shift) - whole
        centre = (width / 2, height * 0.9)
        matrix = cv2.getRotationMatrix2D(centre, -float(np.degrees(turn)), 1.0)
        matrix[:, 2] += part
        moved = cv2.warpAffine(self.planes, matrix, (width, height), borderValue=(0, 0, 0, 0))
        if turn == 0.0:  # the last row goes on
            moved[-2:] = moved[-3]
        top, left = self.top + int(whole[1]), self.left + int(whole[0])
        a, b = max(-top, 0), max(-left, 0)
        c, d = min(height, HEIGHT - top), min(width, WIDTH - left)
        if a >= c or b >= d:
            return
        window = (slice(top + a, top + c), slice(left + b, left + d))
        piece = moved[a:c, b:d]
        mixed = piece[..., :3] + picture[window] * (1.0 - piece[..., 3:])
        picture[window] = np.clip(mixed + 0.5, 0, 255).astype(np.uint8)


Light = Callable[[float], F32 | float]
"""Seconds to a gain: one number, or (HEIGHT, 1, 1), one a row."""


def steady(_: float) -> float:
    """Light that does not change."""
    return 1.0


def flicker(generator: np.random.Generator) -> Light:
    """Lamps on 50 or 60 Hz mains, seen by a camera with a rolling shutter: bands that wander.

    The light beats at twice the mains; at 30 frames a second 100 Hz are seen as 10 Hz, 120 Hz as a
    slow drift; down the picture there are two to four bands.
    """
    beat = float(generator.choice([10.0, 0.3]))
    depth, bands = generator.uniform(0.02, 0.08), generator.uniform(2.0, 4.0)
    rows = np.linspace(0, 2 * np.pi * bands, HEIGHT, dtype=np.float32)[:, None, None]

    def gain(at: float) -> F32:
        wave: F32 = 1 + depth * np.sin(rows + np.float32(2 * np.pi * beat * at))
        return wave.astype(np.float32)

    return gain


def steps(generator: np.random.Generator) -> Light:
    """A lamp goes on or off every few seconds; the camera's exposure follows in half a second."""
    period, factor = generator.uniform(1.5, 4.0), generator.choice([0.6, 0.75, 1.35, 1.6])

    def gain(at: float) -> float:
        part, count = at % period, int(at // period)
        jump = factor if count % 2 == 0 else 1 / factor
        return float(1 + (jump - 1) * np.exp(-part / 0.25))

    return gain


def ease(count: int) -> F64:
    """Minimum jerk (Flash and Hogan 1985): ``count`` shares of the way, start and end left out."""
    t = np.arange(1, count + 1) / (count + 1)
    return np.asarray(10 * t**3 - 15 * t**4 + 6 * t**5)


def tremor(count: int, fps: float, amount: float, generator: np.random.Generator) -> F64:
    """Shifts in pixels, (count, 2): trembling at 9 Hz and slow sway, as app/gestures/synthetic."""
    t = np.arange(count)[:, None] / fps
    phase = generator.uniform(0, 2 * np.pi, (3, 2))
    strength = 0.75 + 0.25 * np.sin(2 * np.pi * 0.7 * t + phase[0])
    shake = strength * np.sin(2 * np.pi * TREMOR_HZ * t + phase[1] + np.sin(t))
    return np.asarray(amount * (1.4 * shake + np.sin(2 * np.pi * 0.23 * t + phase[2])))


def plain_room(generator: np.random.Generator) -> U8:
    """A wall: grey, a little tinted, darker to one side."""
    base = generator.uniform(150, 225) + generator.normal(0, 6, 3)
    across = np.linspace(1, generator.uniform(0.8, 1.0), WIDTH)[None, :, None]
    down = np.linspace(1, generator.uniform(0.85, 1.0), HEIGHT)[:, None, None]
    return np.clip(base * across * down, 0, 255).astype(np.uint8)


def fill(part: U8) -> U8:
    """A picture of any shape, scaled and cropped to fill 640x480."""
    height, width = part.shape[:2]
    scale = max(WIDTH / width, HEIGHT / height)
    size = (max(WIDTH, round(width * scale)), max(HEIGHT, round(height * scale)))
    large = cv2.resize(part, size, interpolation=cv2.INTER_CUBIC)
    x, y = (size[0] - WIDTH) // 2, (size[1] - HEIGHT) // 2
    return np.ascontiguousarray(large[y : y + HEIGHT, x : x + WIDTH], dtype=np.uint8)


_COLUMNS, _ROWS = np.meshgrid(
    np.arange(WIDTH, dtype=np.float32), np.arange(HEIGHT, dtype=np.float32)
)


def bell(centre: tuple[float, float], size: tuple[float, float]) -> F32:
    """(480, 640) weights: 1 at the centre, falling off with the standard deviations ``size``."""
    (x, y), (sx, sy) = centre, size
    return np.asarray(
        np.exp(-0.5 * (((_COLUMNS - x) / sx) ** 2 + ((_ROWS - y) / sy) ** 2)), np.float32
    )


def push(picture: U8, weights: F32, shift: Sequence[float] | F64) -> U8:
    """Move the part of a picture that the weights mark by ``shift`` pixels, like rubber."""
    x = _COLUMNS - weights * np.float32(shift[0])
    y = _ROWS - weights * np.float32(shift[1])
    moved = cv2.remap(picture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(moved, np.uint8)


@dataclass
class Studio:
    """A camera before a room. Its clock goes on by one frame with every picture taken."""

    generator: np.random.Generator
    room: U8
    fps: float = 30.0
    light: Light = steady
    noise: float = 1.6

    def __post_init__(self) -> None:
        self.taken = 0
        # One plane of noise, shifted about, in place of new noise for each frame.
        drawn = self.generator.normal(0.0, self.noise, (HEIGHT, WIDTH, 3))
        self._grain = drawn.round().astype(np.int8)

    def count(self, seconds: float) -> int:
        """How many frames so many seconds are, at least one."""
        return max(1, round(seconds * self.fps))

    def shoot(
        self,
        *layers: tuple[Cutout, Sequence[float] | F64],
        turn: float = 0.0,
        room: U8 | None = None,
    ) -> U8:
        """Take a picture of the room with cutouts before it, each moved by its shift."""
        picture = (self.room if room is None else room).copy()
        for cutout, shift in layers:
            cutout.paste(picture, shift, turn)
        gain = self.light(self.taken / self.fps)
        if not isinstance(gain, float) or gain != 1.0:
            picture = np.clip(picture * np.float32(gain), 0, 255).astype(np.uint8)
        aside = [int(n) for n in self.generator.integers(0, (HEIGHT, WIDTH))]
        noise = np.roll(self._grain, aside, axis=(0, 1))
        self.taken += 1
        return np.asarray(cv2.add(picture, noise, dtype=cv2.CV_8U), np.uint8)
