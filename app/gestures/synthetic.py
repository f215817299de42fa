"""A synthetic operator: the drawn hand as a webcam would see it, gesture after gesture.

Between two places the hand moves with minimum jerk, x(t) = 10 t^3 - 15 t^4 + 6 t^5 (Flash and
Hogan, Journal of Neuroscience 5(7), 1985). At rest it trembles by a fraction of a pixel at about
9 Hz, as hands do, and sways slowly.
"""

import os
import re
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from app.errors import CannotStart, Invalid
from app.gestures.hand.pose import HandPose, blend
from app.gestures.hand.poses import POSES, RELAXED
from app.gestures.hand.render import (
    HandLook,
    HandSprite,
    HandView,
    Image,
    backdrop,
    compose,
    render_sprite,
    through_lens,
    to_bytes,
)

FPS = 30
SIZE = (640, 480)
ENTER_S = 0.6
"""The hand comes into view, or goes out of it."""
MORPH_S = 0.45
"""From one gesture to another without leaving the view."""
TREMOR_HZ = 9.0
_WEBCAM = HandLook(
    background=(214, 208, 199),
    background_below=(190, 183, 174),
    gradient=0.08,
    blur=0.7,
    noise=1.6,
)


class Step(NamedTuple):
    """One thing that the operator does."""

    gesture: str | None
    """A name in :data:`app.gestures.hand.POSES`; None: no hand in view."""
    seconds: float
    """How long it is held still; the movements before and after come on top."""


class Caption(NamedTuple):
    """When a gesture is held still in a clip."""

    start_s: float
    end_s: float
    gesture: str


_SHOWN = ("forward", "up", "left", "close", "open", "down", "right", "back", "home")
CLIP: tuple[Step, ...] = (
    *(step for name in _SHOWN for step in (Step(None, 0.35), Step(name, 1.35))),
    Step(None, 0.35),
)
"""What the page plays when there is no webcam: everything but ``stop``, which would latch."""


@dataclass(frozen=True, slots=True)
class _Moment:
    """What one frame shows."""

    pose: HandPose
    lowered: float
    """0: in place; 1: out of view."""


class _Cutout(NamedTuple):
    """The part of a sprite that is not empty, ready to be put anywhere."""

    planes: NDArray[np.float32]
    """Colour times cover and cover, shape (h, w, 4), with an empty edge of one pixel."""
    top: int
    left: int

    @classmethod
    def of(cls, sprite: HandSprite) -> "_Cutout":
        rows = np.flatnonzero(sprite.cover.max(axis=1) > 0.001)
        columns = np.flatnonzero(sprite.cover.max(axis=0) > 0.001)
        top, left = max(int(rows[0]) - 2, 0), max(int(columns[0]) - 2, 0)
        right = int(columns[-1]) + 3
        planes = np.dstack(sprite)[top:, left:right]
        # Below the lower edge of the picture is more arm.
        planes = np.pad(planes, ((0, 4), (0, 0), (0, 0)), mode="edge")
        return cls(planes, top, left)

    def paste(
        self, picture: Image, background: NDArray[np.float32], shift: NDArray[np.float64]
    ) -> None:
        """Put it before the background, moved right and down by ``shift`` pixels, in place."""
        whole = np.floor(shift).astype(int)
        part = shift - whole
        height, width = self.planes.shape[:2]
        matrix = np.array([[1.0, 0.0, part[0]], [0.0, 1.0, part[1]]])
        moved = np.asarray(
            cv2.warpAffine(
                self.planes,
                matrix,
                (width, height),
                flags=cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_REPLICATE,
            ),
            np.float32,
        )
        top, left = self.top + whole[1], self.left + whole[0]
        from_row, from_column = max(-top, 0), max(-left, 0)
        to_row = min(height, picture.shape[0] - top)
        to_column = min(width, picture.shape[1] - left)
        if from_row >= to_row or from_column >= to_column:
            return
        moved = moved[from_row:to_row, from_column:to_column]
        window = (
            slice(top + from_row, top + to_row),
            slice(left + from_column, left + to_column),
        )
        sprite = HandSprite(moved[..., :3], moved[..., 3])
        picture[window] = to_bytes(compose(sprite, background[window]))


class SyntheticOperator:
    """Frames of an operator who follows a script. The same arguments give the same frames.

    Args:
        script: What is shown, one after the other.
        fps: Frames a second.
        size: Width and height in pixels.
        view: Where and how large the hand is; None: a little right of the middle, arm from below.
        look: Skin, background and the webcam's faults.
        tremor: Standard deviation of the trembling in pixels.
        seed: Of tremor and noise.
        poses: What each gesture looks like.

    Raises:
        Invalid: an unknown gesture, or a time that is not positive.
    """

    def __init__(
        self,
        script: Sequence[Step],
        *,
        fps: int = FPS,
        size: tuple[int, int] = SIZE,
        view: HandView | None = None,
        look: HandLook = _WEBCAM,
        tremor: float = 0.35,
        seed: int = 0,
        poses: dict[str, HandPose] = POSES,
    ) -> None:
        for step in script:
            if step.gesture is not None and step.gesture not in poses:
                raise Invalid(
                    f"there is no pose for the gesture {step.gesture!r}; there are "
                    f"{', '.join(poses)}"
                )
            if not 0 < step.seconds <= 3600:
                raise Invalid(f"a step of {step.seconds} s; it must be longer than 0, up to 3600")
        self.fps, self.size, self.look = fps, size, look
        scale = size[1] / 480
        self.view = view or HandView(300 * scale, (size[0] * 0.53, size[1] * 0.50), turn=0.04)
        self._tremor, self._seed = tremor, seed
        self._moments, self.captions = _plan(script, fps, poses)

    @property
    def duration_s(self) -> float:
        """How long the frames take."""
        return len(self._moments) / self.fps

    def __len__(self) -> int:
        return len(self._moments)

    def frames(self) -> Iterator[Image]:
        """The frames, BGR uint8, shape (height, width, 3)."""
        generator = np.random.default_rng(self._seed)
        background = through_lens(backdrop(self.size, self.look), self.look)
        plain = to_bytes(background)
        tremor = _tremble(len(self._moments), self.fps, self._tremor, generator)
        # Eight planes of noise, shifted about, in place of new noise for each frame.
        noises = generator.normal(0.0, self.look.noise, (8, *plain.shape)).round().astype(np.int16)
        last: tuple[HandPose, _Cutout] | None = None
        for number, moment in enumerate(self._moments):
            picture = plain.copy()
            if moment.lowered < 1.0:
                if last is None or last[0] != moment.pose:
                    sprite = render_sprite(moment.pose, self.size, self.view, self.look, fine=1)
                    # Blur and uneven light once a pose, not once a frame.
                    seen = HandSprite(*(through_lens(plane, self.look) for plane in sprite))
                    last = moment.pose, _Cutout.of(seen)
                shift = tremor[number] + [0.0, moment.lowered * self.size[1]]
                last[1].paste(picture, background, shift)
            if self.look.noise:
                aside = int(generator.integers(0, self.size[0]))
                noise = np.roll(noises[number % 8], aside, axis=1)
                picture = np.asarray(cv2.add(picture, noise, dtype=cv2.CV_8U), np.uint8)
            yield picture


def parse_script(text: str) -> tuple[Step, ...]:
    """A script from words, such as ``"none 2, forward 4, none 2"``.

    Raises:
        Invalid: not a name and a number of seconds, with commas between.
    """
    steps = []
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\S+)\s+([0-9]+(?:\.[0-9]+)?)\s*", part)
        if match is None:
            raise Invalid(
                f"{part.strip()!r} is not a step; write a gesture (or none) and seconds, such as "
                "'forward 4'"
            )
        name = None if match[1] == "none" else match[1]
        steps.append(Step(name, float(match[2])))
    return tuple(steps)


def operator_captions() -> tuple[Caption, ...]:
    """When which gesture is held still in :func:`operator_clip`."""
    return _plan(CLIP, FPS, POSES)[1]


def operator_clip(path: Path) -> tuple[Caption, ...]:
    """Write the clip that stands in for a webcam: 640x480, VP8 in WebM.

    The file appears whole or not at all.

    Returns:
        When which gesture is held still.

    Raises:
        CannotStart: OpenCV cannot write VP8 here.
    """
    # Noise would only be turned into bytes that VP8 then smears.
    operator = SyntheticOperator(CLIP, look=replace(_WEBCAM, noise=0.0))
    write_webm(operator.frames(), path, operator.fps)
    return operator.captions


def write_webm(frames: Iterable[Image], path: Path, fps: int = FPS) -> None:
    """Write frames as VP8 in WebM, whole or not at all.

    Raises:
        CannotStart: OpenCV cannot write VP8 here.
    """
    with tempfile.TemporaryDirectory(prefix=".clip-", dir=path.absolute().parent) as folder:
        part = Path(folder) / "clip.webm"
        writer: cv2.VideoWriter | None = None
        try:
            for frame in frames:
                if writer is None:
                    size = frame.shape[1], frame.shape[0]
                    code = cv2.VideoWriter.fourcc(*"VP80")
                    writer = cv2.VideoWriter(str(part), cv2.CAP_FFMPEG, code, fps, size)
                    if not writer.isOpened():
                        raise CannotStart(
                            "OpenCV cannot write VP8 video here; install the package "
                            "opencv-python-headless from PyPI"
                        )
                writer.write(frame)
        finally:
            if writer is not None:
                writer.release()
        os.replace(part, path)


def write_mjpeg(frames: Iterable[Image], path: Path, quality: int = 92) -> int:
    """Write frames as JPEG after JPEG, which Chromium plays in a loop as a webcam of 30 frames/s.

    Chromium's switches: ``--use-fake-device-for-media-stream
    --use-fake-ui-for-media-stream --use-file-for-fake-video-capture=FILE.mjpeg``.

    Returns:
        How many frames were written.
    """
    count = 0
    with path.open("wb") as file:
        for frame in frames:
            done, data = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, quality])
            assert done
            file.write(data.tobytes())
            count += 1
    return count


def write_y4m(frames: Iterable[Image], path: Path, fps: int = FPS) -> int:
    """Write frames as raw YUV 4:2:0 (Y4M), which Chromium plays as :func:`write_mjpeg`'s.

    Returns:
        How many frames were written.
    """
    count = 0
    with path.open("wb") as file:
        for frame in frames:
            if count == 0:
                height, width = frame.shape[:2]
                file.write(f"YUV4MPEG2 W{width} H{height} F{fps}:1 Ip A1:1 C420jpeg\n".encode())
            file.write(b"FRAME\n" + cv2.cvtColor(frame, cv2.COLOR_BGR2YUV_I420).tobytes())
            count += 1
    return count


def _plan(
    script: Sequence[Step], fps: int, poses: dict[str, HandPose]
) -> tuple[list[_Moment], tuple[Caption, ...]]:
    """What each frame shows, and when the gestures are held."""
    moments: list[_Moment] = []
    captions: list[Caption] = []
    pose: HandPose | None = None  # in view at the end of what is planned so far
    for step in script:
        target = None if step.gesture is None else poses[step.gesture]
        if pose is None and target is not None:
            for share in _ease(ENTER_S, fps):
                moments.append(_Moment(blend(RELAXED, target, min(2 * share, 1.0)), 1 - share))
        elif pose is not None and target is None:
            moments += [_Moment(pose, share) for share in _ease(ENTER_S, fps)]
        elif pose is not None and target is not None and pose != target:
            moments += [_Moment(blend(pose, target, share), 0.0) for share in _ease(MORPH_S, fps)]
        held = max(round(step.seconds * fps), 1)
        if target is not None and step.gesture is not None:
            captions.append(Caption(len(moments) / fps, (len(moments) + held) / fps, step.gesture))
        moments += [_Moment(target or RELAXED, 1.0 if target is None else 0.0)] * held
        pose = target
    return moments, tuple(captions)


def _ease(seconds: float, fps: int) -> list[float]:
    """Shares of a movement's way, frame by frame, its start and its end left out."""
    t = np.arange(1, round(seconds * fps)) / round(seconds * fps)
    return [float(share) for share in 10 * t**3 - 15 * t**4 + 6 * t**5]


def _tremble(
    count: int, fps: int, amount: float, generator: np.random.Generator
) -> NDArray[np.float64]:
    """Shifts in pixels, shape (count, 2): tremor of slowly changing strength, and sway."""
    t = np.arange(count)[:, None] / fps
    phase = generator.uniform(0, 2 * np.pi, (4, 2))
    strength = 0.75 + 0.25 * np.sin(2 * np.pi * 0.7 * t + phase[0])
    tremor = strength * np.sin(2 * np.pi * TREMOR_HZ * t + phase[1] + np.sin(t + phase[2]))
    sway = np.sin(2 * np.pi * 0.23 * t + phase[3])
    return np.asarray(amount * (np.sqrt(2) * tremor + sway))
