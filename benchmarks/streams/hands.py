"""The hands that are shown: the drawn one, cut out photographs, and whole frames of a webcam."""

import zlib
from dataclasses import dataclass, field

import cv2
import numpy as np

from app.gestures.hand.pose import Finger, HandPose, Thumb, blend, jitter
from app.gestures.hand.poses import POSES, RELAXED
from app.gestures.hand.render import HandLook, HandView, render_sprite
from app.gestures.hand.skin import TONES
from benchmarks.streams.scene import F32, HEIGHT, U8, WIDTH, Cutout

_BENT = Finger(mcp=1.40, pip=1.75, dip=0.55)
_HALF = Finger(mcp=0.7, pip=1.0, dip=0.5)
_STRAIGHT = Finger(mcp=0.05, pip=0.06, dip=0.04)
_ACROSS = Thumb(spread=0.62, lift=0.62, mcp=0.95, ip=0.75)
_OUT = Thumb(spread=1.02, lift=0.12, mcp=-0.30, ip=-0.18)


def _straight(spread: float) -> Finger:
    return Finger(0.05, 0.06, 0.04, spread)


OTHERS: dict[str, HandPose] = {
    "relaxed": RELAXED,
    "three": HandPose(_straight(0.17), _straight(0.0), _straight(-0.17), _BENT, _ACROSS),
    "gun": HandPose(_straight(0.17), _straight(-0.1), _BENT, _BENT, _OUT),
    "claw": HandPose(_HALF, _HALF, _HALF, _HALF, _OUT),
    "rock": HandPose(_straight(0.22), _BENT, _BENT, _straight(-0.42), _OUT),
    "ring and little": HandPose(_BENT, _BENT, _straight(-0.1), _straight(-0.36), _ACROSS),
    "w": HandPose(_BENT, _straight(0.14), _straight(-0.1), _straight(-0.34), _ACROSS),
}
"""Poses that nobody enrolled. Each differs from the ten of the starter set by a finger or more; a
fist that is not quite closed is not among them, because people take it for a fist, too."""


@dataclass
class Drawn:
    """The drawn hand of one person: where it is held, how large, and how its joints differ."""

    view: HandView
    look: HandLook
    seed: int
    _last: tuple[HandPose, Cutout] | None = field(default=None, repr=False)

    @classmethod
    def of(cls, generator: np.random.Generator) -> "Drawn":
        """Any person."""
        view = HandView(
            float(generator.uniform(190, 330)),
            (
                WIDTH * float(generator.uniform(0.35, 0.65)),
                HEIGHT * float(generator.uniform(0.47, 0.6)),
            ),
            turn=float(generator.uniform(-0.15, 0.15)),
        )
        skin = TONES[str(generator.choice(["light", "medium", "tan", "brown"]))]
        return cls(view, HandLook(skin=skin), int(generator.integers(1 << 30)))

    def pose(self, name: str) -> HandPose:
        """The pose of that name, as this person shows it."""
        # crc32 and not hash(), which differs from run to run.
        generator = np.random.default_rng([self.seed, zlib.crc32(name.encode())])
        return jitter(POSES.get(name) or OTHERS[name], 0.04, generator)

    def cut(self, pose: HandPose) -> Cutout:
        """The hand in that pose."""
        if self._last is None or self._last[0] != pose:
            sprite = render_sprite(pose, (WIDTH, HEIGHT), self.view, self.look, fine=1)
            colour, cover = (cv2.GaussianBlur(p, (0, 0), 0.7) for p in sprite)
            self._last = pose, Cutout.of(np.asarray(colour), np.asarray(cover), arm=160)
        return self._last[1]

    def between(self, start: HandPose, end: HandPose, share: float) -> Cutout:
        """On the way from one pose to another."""
        return self.cut(blend(start, end, share))


def photo_cutout(colour: U8, cover: F32, generator: np.random.Generator) -> Cutout:
    """A photographed hand, its wrist at the photograph's lower edge, standing on the picture's.

    Args:
        colour: (h, w, 3) BGR.
        cover: (h, w), 0 to 1.
        generator: For its size and place.
    """
    side = int(generator.integers(300, 420))
    size = (round(side * colour.shape[1] / colour.shape[0]), side)
    large = cv2.resize(colour.astype(np.float32), size, interpolation=cv2.INTER_CUBIC)
    mask = np.clip(cv2.resize(cover, size, interpolation=cv2.INTER_CUBIC), 0, 1)
    premultiplied = np.clip(large, 0, 255) * mask[..., None]
    made = Cutout.of(premultiplied.astype(np.float32), mask.astype(np.float32), arm=120)
    left = int(generator.integers(20, max(21, WIDTH - size[0] - 20)))
    return made._replace(top=made.top + HEIGHT - side, left=made.left + left)


def thing_cutout(source: U8, generator: np.random.Generator) -> Cutout:
    """An object: a round, square or long piece of any picture, tinted anyhow."""
    height, width = (int(n) for n in generator.integers(60, 260, 2))
    y, x = int(generator.integers(HEIGHT - height)), int(generator.integers(WIDTH - width))
    colour = source[y : y + height, x : x + width].astype(np.float32)
    tint = generator.uniform(0.5, 1.2, 3).astype(np.float32)
    if generator.random() < 0.3:  # wood, card and leather are coloured like skin
        colour = 0.3 * colour + 0.7 * np.array([110, 150, 205], np.float32)
        tint = np.ones(3, np.float32)
    mask = np.zeros((height, width), np.uint8)
    if generator.random() < 0.5:
        cv2.ellipse(
            mask, (width // 2, height // 2), (width // 2 - 3, height // 2 - 3), 0, 0, 360, 1, -1
        )
    else:
        corners = generator.uniform(0, 0.2, (4, 2)) * [width, height]
        at = np.array([[0, 0], [width, 0], [width, height], [0, height]])
        inwards = corners * [[1, 1], [-1, 1], [-1, -1], [1, -1]]
        cv2.fillPoly(mask, [np.round(at + inwards).astype(np.int32)], (1,))
    cover = cv2.GaussianBlur(mask.astype(np.float32), (0, 0), 1.0)
    planes = np.dstack([np.clip(colour * tint, 0, 255) * cover[..., None], cover])
    padded = np.pad(planes, ((3, 3), (3, 3), (0, 0))).astype(np.float32)
    return Cutout(padded, (HEIGHT - height) // 2, (WIDTH - width) // 2)
