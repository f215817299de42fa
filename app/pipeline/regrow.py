"""Fingers that the network lost, won back by colour.

Before a plain wall as light as the skin the network may hardly see a thin finger, and a pointing
hand becomes a fist. What the network is sure of says which colours the hand and the rest have in
this picture. Where these are far apart, a thin piece of the hand's colour that begins at the hand
belongs to it; where they are not, as before wood, a face or a room, nothing is changed.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from app.pipeline.types import F32, U8

HAND, REST = 0.9, 0.1
"""Share of hand from which a pixel is a sample of the hand, and up to which of the rest."""
APART = 8.0
"""Standard deviations between the two colours from which colour counts. At 5, 30 of 254 whole
webcam pictures of rooms were changed, with parts of faces and sleeves in the hand; at 8, one."""
LIKE = 0.5
"""On the way from the rest's mean colour (0) to the hand's (1): from here a pixel is like the
hand."""
THIN = 0.55
"""Palm radii: a piece into which a circle of this radius fits is no finger."""
BEYOND, LEAST = 2, 12
"""Pixels of the share: only what reaches farther than the first from the hand, with so many pixels,
is a finger. Less is the hand's rim, which is a little other in every frame: giving that back would
look like motion."""
MOST = 0.35
"""Of the hand's pixels: more cannot be fingers that were lost."""
FEWEST = 60
"""Samples of either colour, at least."""
_RIM = np.ones((3, 3), np.uint8)


def regrow(share: F32, seen: U8, threshold: float) -> F32:
    """Give back the fingers that a look had lost.

    Args:
        share: (h, w), 0 to 1, the network's share of hand.
        seen: (H, W, 3), BGR, what it looked at.
        threshold: Share from which a pixel is hand.

    Returns:
        (h, w), the share, 1 where a piece is given back; the same array when none is.
    """
    found: U8 = (share > threshold).view(np.uint8)
    # A finger whose root alone was lost lies apart from the hand, and is lost with it.
    hand = _largest(found)
    rest = (cv2.dilate(found, _RIM) == 0) & (share < REST)
    along = colour_axis(
        np.asarray(cv2.resize(seen, share.shape[::-1], interpolation=cv2.INTER_AREA), np.float32),
        share > HAND,
        rest,
    )
    if along is None:
        return share
    like = (along > LIKE).view(np.uint8) | found
    more = like & ~hand & 1
    framed = cv2.copyMakeBorder(hand, 1, 1, 1, 1, cv2.BORDER_CONSTANT)
    palm = float(cv2.distanceTransform(framed, cv2.DIST_L2, 3).max())
    wide = 2 * int(THIN * palm) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (wide, wide))
    thick = cv2.morphologyEx(like, cv2.MORPH_OPEN, disc)
    # At the hand itself every piece is thick, together with the hand.
    more[(thick != 0) & (cv2.dilate(hand, _RIM, iterations=2) == 0)] = 0
    _, labels = cv2.connectedComponents(more | hand)
    more[~np.isin(labels, np.unique(labels[hand != 0]))] = 0
    fingers = more.copy()
    fingers[cv2.dilate(hand, _RIM, iterations=BEYOND) != 0] = 0
    if cv2.countNonZero(fingers) < LEAST:
        return share
    for _ in range(2 * BEYOND):  # back to the hand, but not along its rim
        fingers = np.asarray(cv2.dilate(fingers, _RIM), np.uint8) & more
    if cv2.countNonZero(fingers) > MOST * cv2.countNonZero(hand):
        return share
    return np.where(fingers != 0, np.float32(1.0), share)


def _largest(mask: U8) -> U8:
    """The largest connected piece of a mask of 0 and 1; an empty one as it is."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
    if count <= 2:
        return mask
    largest: U8 = (labels == 1 + stats[1:, cv2.CC_STAT_AREA].argmax()).view(np.uint8)
    return largest


def colour_axis(colours: F32, hand: NDArray[np.bool_], rest: NDArray[np.bool_]) -> F32 | None:
    """Each pixel's place on the axis that tells the hand's colour from the rest's best.

    By Fisher's linear discriminant (Fisher 1936): with the means m and covariances S of the two,
    the axis is (S_hand + S_rest)^-1 (m_hand - m_rest).

    Args:
        colours: (h, w, 3).
        hand: (h, w); samples of the hand.
        rest: (h, w); samples of what is not.

    Returns:
        (h, w), 0 at the rest's mean and 1 at the hand's; None when the samples are too few or
        their means are less than :data:`APART` standard deviations from each other.
    """
    if min(np.count_nonzero(hand), np.count_nonzero(rest)) < FEWEST:
        return None
    of_hand, of_rest = colours[hand], colours[rest]
    between = of_hand.mean(0) - of_rest.mean(0)
    # A camera's noise is no less than a level; without it a drawn wall would have no spread at all.
    within = np.cov(of_hand.T) + np.cov(of_rest.T) + np.eye(3)
    axis = np.linalg.solve(within, between)
    # On this axis the difference of the means is also the sum of the two variances.
    separation = float(axis @ between)
    if separation < APART**2 / 2:
        return None
    return np.asarray((colours - of_rest.mean(0)) @ axis / separation, np.float32)
