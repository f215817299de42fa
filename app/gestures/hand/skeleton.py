"""Forward kinematics: from joint angles to rounded cones in space.

The hand's frame: origin at the middle of the wrist, x to the thumb's side of a right hand that
shows its palm, y along the hand, z out of the palm; lengths are ratios of the hand's length.

A finger that is bent by the sum ``b`` of its joints points along

    d = (sin(spread) cos b, cos(spread) cos b, sin b)

and each phalanx starts where the one before it ends. The thumb bends sideways instead, its
metacarpal turned out of the palm's plane by ``lift``.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.gestures.hand import anatomy
from app.gestures.hand.pose import Finger, HandPose, Thumb

PALM, INDEX, MIDDLE, RING, LITTLE, THUMB = range(6)
"""Parts of a hand: what is drawn with soft transitions within itself."""


class Cone(NamedTuple):
    """A rounded cone: the hull of two balls."""

    part: int
    start: NDArray[np.float64]
    """Centre of the first ball, shape (3,)."""
    end: NDArray[np.float64]
    start_radius: float
    end_radius: float
    depth: float = 1.0
    """How thick it is compared with how wide; a palm is flat."""


class Chain(NamedTuple):
    """A finger or the thumb: its joints from the palm to the tip."""

    part: int
    joints: NDArray[np.float64]
    """Shape (4, 3)."""
    radii: tuple[float, float, float, float]
    bend: tuple[float, float, float]
    """Sum of bending at each bone, rad: under pi/2 the palm side is seen, over it the nail's."""


class Skeleton(NamedTuple):
    """A posed hand."""

    cones: tuple[Cone, ...]
    chains: tuple[Chain, ...]
    """Index to little finger, then the thumb."""


def pose_skeleton(pose: HandPose) -> Skeleton:
    """Place all bones of a right hand that shows its palm."""
    chains = [
        _finger(part, anatomy.FINGERS[part - INDEX], finger)
        for part, finger in zip((INDEX, MIDDLE, RING, LITTLE), pose.fingers, strict=True)
    ]
    thumb = _thumb(pose.thumb)
    cones = [*_palm(thumb)]
    for chain in (*chains, thumb):
        first = 1 if chain.part == THUMB else 0
        for bone in range(first, 3):
            cones.append(
                Cone(
                    chain.part,
                    chain.joints[bone],
                    chain.joints[bone + 1],
                    chain.radii[bone],
                    chain.radii[bone + 1],
                )
            )
    return Skeleton(tuple(cones), (*chains, thumb))


def _finger(part: int, shape: anatomy.FingerAnatomy, finger: Finger) -> Chain:
    bends = np.cumsum([finger.mcp, finger.pip, finger.dip])
    lengths = [*shape.phalanges]
    lengths[2] -= shape.radii[3]  # the last ball's skin, not its centre, is the tip
    joints = [np.array([*shape.knuckle, 0.0])]
    for bend, length in zip(bends, lengths, strict=True):
        along = np.cos(bend)
        direction = np.array(
            [np.sin(finger.spread) * along, np.cos(finger.spread) * along, np.sin(bend)]
        )
        joints.append(joints[-1] + length * direction)
    return Chain(part, np.array(joints), shape.radii, (bends[0], bends[1], bends[2]))


def _thumb(thumb: Thumb) -> Chain:
    turns = thumb.spread - np.cumsum([0.0, thumb.mcp, thumb.ip])
    lengths = [*anatomy.THUMB_BONES]
    lengths[2] -= anatomy.THUMB_RADII[3]
    # The tip follows the palm's curve: each bone leans out a little less than the one before.
    lifts = thumb.lift * np.array([1.0, 0.9, 0.6])
    joints = [np.array([*anatomy.THUMB_BASE, 0.03])]
    for turn, lift, length in zip(turns, lifts, lengths, strict=True):
        direction = np.array(
            [np.sin(turn) * np.cos(lift), np.cos(turn) * np.cos(lift), np.sin(lift)]
        )
        joints.append(joints[-1] + length * direction)
    bend = float(turns[0] - turns[2])
    return Chain(THUMB, np.array(joints), anatomy.THUMB_RADII, (0.0, 0.0, bend))


def _palm(thumb: Chain) -> list[Cone]:
    """Metacarpals, the balls of thumb and little finger, wrist and forearm."""
    point = np.array
    cones = []
    roots = ((0.075, 0.05), (0.025, 0.04), (-0.030, 0.04), (-0.075, 0.06))
    for root, finger in zip(roots, anatomy.FINGERS, strict=True):
        knuckle = point([*finger.knuckle, 0.0])
        knuckle[1] += 0.035  # the web reaches about half way up the first phalanx
        cones.append(Cone(PALM, point([*root, 0.0]), knuckle, 0.072, finger.radii[0] * 1.08, 0.8))
    cones.append(
        Cone(PALM, point([-0.075, 0.08, 0.02]), point([-0.137, 0.30, 0.01]), 0.085, 0.075, 0.8)
    )
    cones.append(
        Cone(
            PALM,
            thumb.joints[0],
            thumb.joints[1],
            anatomy.THUMB_RADII[0],
            anatomy.THUMB_RADII[1],
            0.9,
        )
    )
    wrist = point([0.0, -0.04, -0.03])
    middle = point([0.0, -1.0, -0.03])
    elbow = point([0.0, -2.8, -0.03])
    thick, thin = anatomy.FOREARM_HALF, anatomy.WRIST_HALF
    cones.append(Cone(PALM, wrist, point([0.0, 0.10, 0.0]), thin, thin * 0.93, 0.62))
    cones.append(Cone(PALM, wrist, middle, thin, thick, 0.70))
    cones.append(Cone(PALM, middle, elbow, thick, thick * 1.15, 0.70))
    return cones
