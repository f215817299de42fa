"""Quality: is a photograph good enough to enrol, and if not, what is wrong, in plain words.

A template that is enrolled is compared with every frame from then on, so a bad one does harm every
day. What is judged is the mask and the pixels under it: the same for every way of binarising.
"""

import math
from typing import NamedTuple

import cv2
import numpy as np

from app.config import QualitySettings
from app.pipeline.palm import SIDES, Palm, PalmFinder
from app.pipeline.types import F32, U8
from app.pipeline.wrist import cut_at, erase_arm

CUT_OFF = 1.6
"""Palm radii. A hand that touches another side than the arm's on so much runs out of the picture;
finger tips that just touch it do not."""
PALM = 20.0
"""Pixels. A larger palm's radius is scaled down to it before sharpness is measured, so that blur
counts relative to the hand; a smaller one is measured as it is."""
FINE, COARSE = 0.7, 3.0
"""Pixels at that scale: standard deviations of the two Gaussians that sharpness compares."""
DIRECTIONS = 8
WRIST_CUT = 1.3
"""Palm radii; the arm below it is not looked at for sharpness."""
RING = 1.25
"""Palm radii. Where a wrist, if there is one, has to cross a circle round the palm's centre."""
WRIST_WIDTH = 1.0
"""Palm radii along that circle. A finger covers 0.4 to 0.6; 99% of the wrists in the photographs
cover more than this."""
AT_BORDER = 1.06
PALM_WIDTH = 2.3
"""Palm radii. The picture ends within the palm when its border touches the palm's circle and
crosses more than a palm's width of hand; the digit signs, many of which end at the wrist, reach
2.2."""
LITTLE_WRIST = 1.25
"""Palm radii from the palm's centre to the picture's border; with less, hardly any wrist shows."""
APART = 0.5
"""Palm radii between two pieces of the mask; nearer ones are parts of one hand."""
SECOND_AREA = 0.4
"""Least area of a second hand, in parts of the first one's."""


class Finding(NamedTuple):
    """Something about a photograph: a word for programs, and a sentence for people."""

    code: str
    message: str


class Quality(NamedTuple):
    """What became of one photograph.

    Attributes:
        problem: Why it should not be enrolled; None when it may be.
        advice: What would be better, though it may be enrolled as it is.
        sharpness: See :func:`sharpness`; about 1 is all blur.
    """

    problem: Finding | None
    advice: tuple[Finding, ...]
    sharpness: float


def judge(pixels: U8, mask: U8, palm: Palm, settings: QualitySettings) -> Quality:
    """Judge the hand that was found in a photograph.

    Args:
        pixels: (h, w, 3) BGR or (h, w, 1) grey.
        mask: (h, w) of 0 and 1: everything that was taken for a hand.
        palm: The hand in it.
        settings: How strict to be.
    """
    sharp = sharpness(pixels, palm)
    problem = (
        why_cut_off(palm)
        or _why_too_small(palm, settings)
        or _why_two(mask, palm, settings)
        or _why_no_wrist(palm)
        or _why_blurred(sharp, settings)
    )
    return Quality(problem, () if problem else _advice(palm, sharp, settings), sharp)


def why_cut_off(palm: Palm) -> Finding | None:
    """The side at which the hand, not the arm, runs out of the picture."""
    edges = (palm.piece[-1], palm.piece[:, 0], palm.piece[0], palm.piece[:, -1])
    for side, edge in zip(SIDES, edges, strict=True):
        if side != palm.arm and cv2.countNonZero(edge) > CUT_OFF * palm.radius:
            return Finding(
                "cut_off", f"the hand is cut off at the {side} of the picture: show all of it"
            )
    return None


def sharpness(pixels: U8, palm: Palm) -> float:
    """How much finer the picture of a hand is than it would have to be.

    With the picture ``I`` scaled so that the palm's radius is 20 pixels and smoothed against noise,
    and ``B_a`` the same blurred along the direction ``a`` by a one-dimensional Gaussian::

        sharpness = min_a  rms(dI/da) / rms(dB_a/da)     over the hand and its outline

    A picture that is blurred already loses little by being blurred again (after F. Crete et al.,
    "The blur effect", SPIE 6492, 2007), whatever its contrast. The minimum over eight directions
    finds the blur of a movement, too, which leaves the edges along its way sharp.

    Below the default of 1.4 are 0 of the 1006 digit signs and 0.7% of the 1023 webcam boxes, most
    of them blurred indeed, and nine of ten copies out of focus by a 25th of the hand's length.
    """
    hand = palm.piece.copy()
    erase_arm(hand, cut_at(palm, WRIST_CUT))
    x, y, width, height = cv2.boundingRect(hand)
    if width == 0:
        return 1.0
    edge = round(0.4 * palm.radius) + 1
    rows = slice(max(0, y - edge), y + height + edge)
    columns = slice(max(0, x - edge), x + width + edge)
    part = pixels[rows, columns]
    grey = cv2.cvtColor(part, cv2.COLOR_BGR2GRAY) if part.shape[2] == 3 else part
    scale = min(1.0, PALM / palm.radius)
    size = max(8, round(grey.shape[1] * scale)), max(8, round(grey.shape[0] * scale))
    scaled = cv2.resize(grey, size, interpolation=cv2.INTER_AREA).astype(np.float32)
    picture = np.asarray(cv2.GaussianBlur(scaled, (0, 0), FINE), np.float32)
    small = cv2.resize(hand[rows, columns], size, interpolation=cv2.INTER_NEAREST)
    where = np.asarray(cv2.dilate(small, np.ones((5, 5), np.uint8)), np.uint8)
    return min(_along(picture, where, k * 180 / DIRECTIONS) for k in range(DIRECTIONS))


def _along(picture: F32, where: U8, degrees: float) -> float:
    """Rms of the derivative along a direction, over that of the picture blurred along it."""
    height, width = picture.shape
    if degrees:
        side = int(np.ceil(np.hypot(height, width))) + 1
        turn = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), degrees, 1.0)
        turn[:, 2] += (side - width) / 2, (side - height) / 2
        border = cv2.BORDER_REPLICATE
        picture = np.asarray(
            cv2.warpAffine(picture, turn, (side, side), flags=cv2.INTER_CUBIC, borderMode=border),
            np.float32,
        )
        where = np.asarray(
            cv2.warpAffine(where, turn, (side, side), flags=cv2.INTER_NEAREST), np.uint8
        )
    blurred = cv2.GaussianBlur(picture, (0, 0), sigmaX=COARSE, sigmaY=0.01)
    inside = where[:, 1:] > 0
    fine, coarse = np.diff(picture, axis=1)[inside], np.diff(blurred, axis=1)[inside]
    if not fine.size:
        return np.inf
    # A surface without any gradient is neither sharp nor blurred in this direction.
    least = 0.05
    return float((np.sqrt(np.mean(fine**2)) + least) / (np.sqrt(np.mean(coarse**2)) + least))


def _why_too_small(palm: Palm, settings: QualitySettings) -> Finding | None:
    if palm.radius >= settings.min_palm:
        return None
    return Finding(
        "too_small",
        f"the hand is too small: its palm is {2 * palm.radius:.0f} pixels wide, at least "
        f"{2 * settings.min_palm:.0f} are needed; come closer to the camera",
    )


def two_hands(mask: U8, palm: Palm, least: float) -> bool:
    """Whether the mask holds a second hand.

    A piece of its own, away from the hand, with at least ``least`` of its palm's radius and
    :data:`SECOND_AREA` of its area. Most masks have too little left beside the hand, which costs
    next to nothing to see.

    Args:
        mask: (h, w) of 0 and 1: everything that was taken for a hand.
        palm: The hand in it.
        least: In palm radii; 0: never.
    """
    if not least or not palm.found:
        return False
    rest = np.asarray(cv2.bitwise_and(mask, palm.piece ^ 1), np.uint8)
    if cv2.countNonZero(rest) < SECOND_AREA * palm.area:
        return False
    away = cv2.distanceTransform(palm.piece ^ 1, cv2.DIST_L2, 5)
    find = PalmFinder(towards_fingers=False)
    while True:
        second = find(rest)
        if second.radius < least * palm.radius:
            return False
        apart = float(away[second.piece > 0].min())
        if second.area >= SECOND_AREA * palm.area and apart > APART * palm.radius:
            return True
        rest[second.piece > 0] = 0


TWO_HANDS = Finding(
    "two_hands",
    "there are two hands in the picture, or a thing that looks like one: show one hand "
    "and nothing else",
)


def _why_two(mask: U8, palm: Palm, settings: QualitySettings) -> Finding | None:
    return TWO_HANDS if two_hands(mask, palm, settings.second_hand) else None


def _why_no_wrist(palm: Palm) -> Finding | None:
    seen = True
    if palm.arm is None:
        seen = _widest(palm) >= WRIST_WIDTH
    elif _to_border(palm) < AT_BORDER:
        edges = (palm.piece[-1], palm.piece[:, 0], palm.piece[0], palm.piece[:, -1])
        seen = cv2.countNonZero(edges[SIDES.index(palm.arm)]) <= PALM_WIDTH * palm.radius
    if seen:
        return None
    return Finding(
        "no_wrist", "no wrist in view: show the whole hand with its wrist, sleeves pulled back"
    )


def _widest(palm: Palm) -> float:
    """The widest part of the hand on the ring round its palm's centre, in palm radii."""
    angles = np.arange(360) * (np.pi / 180)
    columns = np.rint(palm.x + RING * palm.radius * np.cos(angles)).astype(int)
    rows = np.rint(palm.y + RING * palm.radius * np.sin(angles)).astype(int)
    height, width = palm.piece.shape
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    on = np.zeros(360, bool)
    on[inside] = palm.piece[rows[inside], columns[inside]] > 0
    off = np.flatnonzero(~on)
    run = 360 if not off.size else int(np.diff(np.r_[off, off[0] + 360]).max()) - 1
    return math.radians(run) * RING


def _to_border(palm: Palm) -> float:
    """From the palm's centre to the border where the arm leaves the picture, in palm radii."""
    height, width = palm.piece.shape
    ways = {"bottom": height - palm.y, "left": palm.x + 1, "top": palm.y + 1}
    way = ways.get(palm.arm or "", width - palm.x)
    return float(way) / palm.radius


def _why_blurred(sharp: float, settings: QualitySettings) -> Finding | None:
    if sharp >= settings.min_sharpness:
        return None
    return Finding(
        "blurred",
        f"the picture is blurred (sharpness {sharp:.2f}, at least {settings.min_sharpness:.2f} "
        "needed): hold the hand still, and give it more light",
    )


def _advice(palm: Palm, sharp: float, settings: QualitySettings) -> tuple[Finding, ...]:
    found = []
    if palm.arm is not None and _to_border(palm) < LITTLE_WRIST:
        found.append(Finding("little_wrist", "hardly any wrist is in view: hold the hand higher"))
    if sharp < 1.1 * settings.min_sharpness:
        found.append(Finding("soft", "the picture is a little soft: more light would help"))
    if palm.radius < 1.5 * settings.min_palm:
        found.append(Finding("small", "the hand is small: come closer to the camera"))
    return tuple(found)
