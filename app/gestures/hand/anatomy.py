"""Lengths and widths of an average adult hand, as ratios of the hand's length.

The hand's length reaches from the wrist's crease to the tip of the middle finger.

Sources:
    Bones: Buryanov, A. and Kotiuk, V.: Proportions of hand segments. International Journal of
    Morphology 28(3), 2010, 755-758, table of the means of 66 adults; the distal ones include the
    soft tissue of the finger's tip.
    Hand's length 183 mm and breadth 84 mm: ACOPLA 95, 2,100 Colombian workers, men (Estrada et
    al., Revista Facultad Nacional de Salud Publica 13(2), 1998).
    Widths of fingers and the places of the knuckles were chosen by eye on photographs, inside
    these outer measures.
"""

from typing import NamedTuple

HAND_LENGTH_MM = 183.0
HAND_BREADTH = 84.0 / HAND_LENGTH_MM


class FingerAnatomy(NamedTuple):
    """One finger; all ratios of the hand's length, in the palm's plane: x to the thumb, y up."""

    knuckle: tuple[float, float]
    """The joint at the palm (MCP)."""
    phalanges: tuple[float, float, float]
    """Lengths of proximal, middle and distal phalanx, the last with the soft tip."""
    radii: tuple[float, float, float, float]
    """Half widths at the knuckle, the two joints, and near the tip."""


def _mm(*lengths: float) -> tuple[float, float, float]:
    first, second, third = (length / HAND_LENGTH_MM for length in lengths)
    return first, second, third


INDEX = FingerAnatomy((0.152, 0.470), _mm(39.8, 22.4, 15.8 + 3.8), (0.062, 0.0545, 0.0485, 0.0410))
MIDDLE = FingerAnatomy((0.045, 0.490), _mm(44.6, 26.3, 17.4 + 4.0), (0.064, 0.0560, 0.0495, 0.0425))
RING = FingerAnatomy((-0.060, 0.468), _mm(41.4, 25.7, 17.3 + 4.0), (0.060, 0.0525, 0.0465, 0.0395))
LITTLE = FingerAnatomy(
    (-0.152, 0.415), _mm(32.7, 18.1, 16.0 + 3.7), (0.053, 0.0460, 0.0415, 0.0345)
)
FINGERS = (INDEX, MIDDLE, RING, LITTLE)

THUMB_BASE = (0.095, 0.090)
"""The saddle joint (CMC) of the thumb."""
THUMB_BONES = _mm(46.2, 31.6, 21.7 + 5.7)
"""Metacarpal, proximal and distal phalanx."""
THUMB_RADII = (0.090, 0.073, 0.0620, 0.0480)
"""Half widths at the saddle joint, the two joints, and near the tip."""

WRIST_HALF = 0.150
"""Half the wrist's breadth."""
FOREARM_HALF = 0.215
"""Half the forearm's breadth, one hand's length below the wrist."""
