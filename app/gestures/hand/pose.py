"""What a hand does: the angles of its joints."""

from dataclasses import astuple, dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Finger:
    """Angles of one finger in rad; 0 everywhere is straight and parallel to the hand's axis."""

    mcp: float = 0.0
    """Bending at the knuckle, 0 to about 1.6."""
    pip: float = 0.0
    """Bending at the middle joint, 0 to about 1.9."""
    dip: float = 0.0
    """Bending at the last joint, 0 to about 1.4."""
    spread: float = 0.0
    """Sideways, positive to the thumb's side."""


@dataclass(frozen=True, slots=True)
class Thumb:
    """Angles of the thumb in rad."""

    spread: float = 0.6
    """Of its metacarpal away from the hand's axis, in the palm's plane."""
    lift: float = 0.2
    """Out of the palm's plane, towards whom the palm faces."""
    mcp: float = 0.0
    """Bending of the middle joint, towards the little finger."""
    ip: float = 0.0
    """Bending of the last joint, towards the little finger."""


@dataclass(frozen=True, slots=True)
class HandPose:
    """All joints of one hand."""

    index: Finger = Finger()
    middle: Finger = Finger()
    ring: Finger = Finger()
    little: Finger = Finger()
    thumb: Thumb = Thumb()

    @property
    def fingers(self) -> tuple[Finger, Finger, Finger, Finger]:
        """Index to little finger."""
        return self.index, self.middle, self.ring, self.little

    def angles(self) -> tuple[float, ...]:
        """All twenty angles in rad: four of each finger, then four of the thumb."""
        return tuple(angle for part in (*self.fingers, self.thumb) for angle in astuple(part))

    @classmethod
    def from_angles(cls, angles: tuple[float, ...]) -> "HandPose":
        """The pose with the twenty angles that :meth:`angles` gives."""
        index, middle, ring, little = (Finger(*angles[i : i + 4]) for i in (0, 4, 8, 12))
        return cls(index, middle, ring, little, Thumb(*angles[16:20]))


def blend(start: HandPose, end: HandPose, share: float) -> HandPose:
    """The pose on the way from ``start`` (share 0) to ``end`` (share 1), joint by joint."""
    pairs = zip(start.angles(), end.angles(), strict=True)
    return HandPose.from_angles(tuple(a + share * (b - a) for a, b in pairs))


def jitter(pose: HandPose, amount: float, generator: np.random.Generator) -> HandPose:
    """The pose as another person, or another day, would show it.

    Args:
        pose: What to vary.
        amount: Standard deviation of every angle in rad; spreads vary by half of it.
        generator: Source of chance.
    """
    scale = np.tile([1.0, 1.0, 1.0, 0.5], 5) * amount
    noise = generator.normal(0.0, 1.0, 20) * scale
    varied = [angle + float(extra) for angle, extra in zip(pose.angles(), noise, strict=True)]
    for finger in range(4):
        for joint in range(3):
            # Joints do not bend backwards.
            varied[4 * finger + joint] = max(varied[4 * finger + joint], 0.0)
    return HandPose.from_angles(tuple(varied))
