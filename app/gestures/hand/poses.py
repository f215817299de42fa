"""Ten poses that are easy to show and far apart as silhouettes, all with the palm to the camera.

An operator who raises the right hand sees the thumb on the left and the little finger on the
right: so the thumb means left, the little finger right. A fist closes the gripper, thumb and index
open it like a pair of pliers, the open hand stops.
"""

from app.gestures.hand.pose import Finger, HandPose, Thumb

HALF_BENT = 0.8
"""Rad at two joints together: a finger that is bent more is not stretched."""


def _folded(spread: float = 0.0) -> Finger:
    """Bent into the palm."""
    return Finger(mcp=1.40, pip=1.75, dip=0.55, spread=spread)


def _up(spread: float) -> Finger:
    """Straight, the way a relaxed straight finger is."""
    return Finger(mcp=0.05, pip=0.06, dip=0.04, spread=spread)


_FOLDED = (_folded(0.02), _folded(0.0), _folded(-0.02), _folded(-0.06))
_ACROSS = Thumb(spread=0.62, lift=0.62, mcp=0.95, ip=0.75)
"""Over the folded fingers."""
_TUCKED = Thumb(spread=0.55, lift=0.55, mcp=0.95, ip=0.85)
"""Over the palm, fingers straight."""
_OUT = Thumb(spread=1.02, lift=0.12, mcp=-0.30, ip=-0.18)
"""Away from the hand."""
_ASIDE = Thumb(spread=0.86, lift=0.12, mcp=-0.14, ip=-0.06)
"""Half way out, as in a hand that is opened without effort."""

RELAXED = HandPose(
    Finger(0.30, 0.35, 0.2, 0.05),
    Finger(0.35, 0.40, 0.2, 0.0),
    Finger(0.40, 0.45, 0.2, -0.04),
    Finger(0.45, 0.45, 0.2, -0.10),
    Thumb(0.62, 0.35, 0.15, 0.15),
)
"""Between gestures; not one of the ten."""

POSES: dict[str, HandPose] = {
    "forward": HandPose(_up(0.17), _up(-0.13), _FOLDED[2], _FOLDED[3], _ACROSS),
    "back": HandPose(_up(0.22), _up(0.06), _up(-0.12), _up(-0.34), _TUCKED),
    "left": HandPose(*_FOLDED, _OUT),
    "right": HandPose(_FOLDED[0], _FOLDED[1], _FOLDED[2], _up(-0.34), _ACROSS),
    "up": HandPose(_up(0.04), _FOLDED[1], _FOLDED[2], _FOLDED[3], _ACROSS),
    "down": HandPose(_up(0.22), _FOLDED[1], _FOLDED[2], _up(-0.42), _ACROSS),
    "open": HandPose(_up(0.06), _FOLDED[1], _FOLDED[2], _FOLDED[3], _OUT),
    "close": HandPose(*_FOLDED, _ACROSS),
    "home": HandPose(_FOLDED[0], _FOLDED[1], _FOLDED[2], _up(-0.38), _OUT),
    "stop": HandPose(_up(0.22), _up(0.05), _up(-0.13), _up(-0.36), _ASIDE),
}
"""By the name of the starter gesture."""

ALSO: dict[str, tuple[HandPose, ...]] = {
    "stop": (
        HandPose(_up(0.28), _up(0.05), _up(-0.17), _up(-0.44), _OUT),
        HandPose(_up(0.12), _up(0.02), _up(-0.08), _up(-0.24), _ASIDE),
        HandPose(_up(0.10), _up(0.02), _up(-0.06), _up(-0.18), Thumb(0.66, 0.15, -0.04, -0.02)),
    ),
}
"""Other ways to show a gesture that people use; to stop must work however the hand is opened."""


def stretched(pose: HandPose) -> tuple[bool, ...]:
    """Which fingers of a pose are stretched, thumb first: what tells one sign from another."""
    thumb = pose.thumb.mcp + pose.thumb.ip < HALF_BENT
    return thumb, *(finger.pip + finger.dip < HALF_BENT for finger in pose.fingers)
