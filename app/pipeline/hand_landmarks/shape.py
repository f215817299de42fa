"""Shape: a hand's landmarks as they are kept with a sample, and as a vector to compare."""

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

from app.errors import Invalid
from app.pipeline.hand_landmarks.types import (
    INDEX_MCP,
    PALM,
    PINKY_MCP,
    POINTS,
    WRIST,
    HandLandmarks,
)
from app.pipeline.types import F32

BONES = tuple((0 if i % 4 == 1 else i - 1, i) for i in range(1, POINTS))
"""The 20 bones, from joint to joint; each finger's first begins at the wrist."""
DIMENSIONS = 2 * 19 + 3 * 60
SPREAD = {"angles": 1.8, "seen_angles": 2.3, "world": 3.52, "seen": 3.47, "own": 2.92}
"""Root mean square, over the photographs of development, of what differs between hands."""
WEIGHT = {"angles": 1.0, "seen_angles": 0.5, "world": 0.5, "seen": 0.5, "own": 0.5}
SCALE = 0.42
"""Brings distances to the unit of the silhouette's: what is accepted at most is about 0.44."""
DOUBTFUL = 0.2
"""A hand whose sides are less sure than this is compared as either."""
_START = np.array([start for start, _ in BONES])
_END = np.array([end for _, end in BONES])
FORMAT = 1
UNIT = 1 / 8192
"""Of a packed coordinate, in palm lengths in the picture and in metres of the hand."""
PACKED_BYTES = 2 + 2 * POINTS * 3 * 2


class HandShape(NamedTuple):
    """A hand without its place and size.

    Attributes:
        points: (21, 3) from the wrist, in palm lengths: x right, y down, z away from the camera.
        world: (21, 3) metres.
        right: Probability, 0 to 1, that it is a right hand.
    """

    points: F32
    world: F32
    right: float

    @classmethod
    def of(cls, hands: Sequence[HandLandmarks]) -> Self:
        """The mean of several looks at one hand; at least one."""
        points = [
            (hand.points - hand.points[WRIST]) / max(hand.palm_length, 1e-3) for hand in hands
        ]
        world = [hand.world for hand in hands]
        right = float(np.mean([hand.right for hand in hands]))
        return cls(
            np.mean(points, axis=0, dtype=np.float32),
            np.mean(world, axis=0, dtype=np.float32),
            right,
        )

    def mirrored(self) -> "HandShape":
        """The same hand in a mirror."""
        other = np.array([-1, 1, 1], np.float32)
        return HandShape(self.points * other, self.world * other, 1 - self.right)

    def pack(self) -> bytes:
        """254 bytes: format, sides, then both sets of points as 16-bit integers, little-endian."""
        numbers = [
            np.clip(np.rint(points / UNIT), -32768, 32767).astype("<i2").tobytes()
            for points in (self.points, self.world)
        ]
        return bytes((FORMAT, round(255 * min(max(self.right, 0.0), 1.0)))) + b"".join(numbers)

    @classmethod
    def unpack(cls, packed: bytes) -> Self:
        """From what :meth:`pack` made.

        Raises:
            Invalid: another length or format.
        """
        if len(packed) != PACKED_BYTES or packed[0] != FORMAT:
            raise Invalid(
                f"packed landmarks have {PACKED_BYTES} bytes and begin with {FORMAT}, "
                f"not {len(packed)} bytes"
            )
        numbers = np.frombuffer(packed, "<i2", offset=2).astype(np.float32) * np.float32(UNIT)
        points, world = numbers.reshape(2, POINTS, 3)
        return cls(points, world, packed[1] / 255)


class ShapeFeatures:
    """A hand to (v, 218) float32: what its joints and bones do, whichever hand it is.

    Five parts, each divided by :data:`SPREAD` and times :data:`WEIGHT`:

    - *angles*: at the 15 joints between consecutive bones and the four between neighbouring
      fingers, rad, from the points in metres: without the hand's turn and side;
    - *seen_angles*: the same from the points in the picture;
    - *world* and *seen*: the unit vectors of the 20 bones, from both: with the hand's turn, which
      tells thumb up from thumb down;
    - *own*: those in the hand's own axes: along the palm, across it, and out of it.

    A left hand is mirrored first (``either_hand``), so that a gesture taught with one hand is known
    of the other. Without that, left and right are as far apart as two gestures.
    """

    def __init__(self, *, either_hand: bool) -> None:
        self._either = either_hand

    def __call__(self, shape: HandShape) -> F32:
        """Returns one row, or two when it is not sure which hand it is."""
        rows = []
        if not self._either or shape.right >= DOUBTFUL:
            rows.append(_vector(shape))
        if self._either and shape.right < 1 - DOUBTFUL:
            rows.append(_vector(shape.mirrored()))
        return np.stack(rows)


def _vector(shape: HandShape) -> F32:
    world, seen = _bones(shape.world), _bones(shape.points)
    parts = {
        "angles": _angles(world),
        "seen_angles": _angles(seen),
        "world": world.ravel(),
        "seen": seen.ravel(),
        "own": (world @ _axes(shape.world).T).ravel(),
    }
    return np.concatenate(
        [part * np.float32(SCALE * WEIGHT[name] / SPREAD[name]) for name, part in parts.items()]
    )


def _bones(points: F32) -> F32:
    """(20, 3) unit vectors."""
    return _unit(points[_END] - points[_START])


def _unit(vectors: F32) -> F32:
    lengths = np.sqrt(np.einsum("...i,...i->...", vectors, vectors))
    units: F32 = vectors / np.maximum(lengths, 1e-6)[..., None]
    return units


def _angles(bones: F32) -> F32:
    """(19,) rad: from each bone to the next of its finger, and between neighbouring fingers."""
    fingers = bones.reshape(5, 4, 3)
    along = np.einsum("fbi,fbi->fb", fingers[:, 1:], fingers[:, :-1]).ravel()
    across = np.einsum("fi,fi->f", fingers[:-1, 1], fingers[1:, 1])
    angles: F32 = np.arccos(np.clip(np.concatenate([along, across]), -1, 1))
    return angles


def _axes(points: F32) -> F32:
    """(3, 3) unit vectors: across the palm towards the index finger, along it, out of it."""
    along = _unit(points[list(PALM[1:])].mean(axis=0) - points[WRIST])
    out = _unit(np.cross(points[INDEX_MCP] - points[PINKY_MCP], along))
    return np.stack([np.cross(along, out), along, out])
