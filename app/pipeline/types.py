"""What the stages hand to one another and what a frame leads to.

Masks and templates are uint8 arrays that hold 0 and 1. Boxes are ``(x, y, width, height)``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from app.pipeline.hand_landmarks.shape import HandShape
    from app.pipeline.hand_landmarks.types import HandLandmarks

U8 = NDArray[np.uint8]
F32 = NDArray[np.float32]
Box = tuple[int, int, int, int]
Side = Literal["bottom", "left", "top", "right"]
Phase = Literal["start", "hold", "end"]
Cause = Literal[
    "no_hand",
    "two_hands",
    "waiting",
    "moving",
    "nothing_enrolled",
    "unknown_hand",
    "low_margin",
    "settling",
    "agreeing",
    "doubtful",
]
"""Why a frame starts no gesture, for programs. ``moving`` also stands for a hand that is not known
while it moves: it may be on its way from one gesture to another. With the last three a gesture is
seen and does not start yet: the hand has changed within the settling time; too few frames have
shown it; they have shown it too unlike what is taught."""


class Way(NamedTuple):
    """How the mask is made, and why so: words that go on from "because"."""

    mode: Literal["threshold", "learned", "landmarks"]
    why: str


class WristCut(NamedTuple):
    """A straight cut along the picture's axes, in pixels.

    ``side`` is where the arm enters; the cut runs along x (for ``bottom`` and ``top``) or y at
    ``at``, and everything from there to that side is not hand.
    """

    side: Side
    at: int


class Circle(NamedTuple):
    """The palm's largest inscribed circle, in pixels."""

    x: int
    y: int
    radius: float


class Look(NamedTuple):
    """Where one hand lies among the enrolled templates.

    Attributes:
        point: (k + 1,) coordinates of the view that is nearest to an enrolled one: the principal
            components, then the reconstruction error.
        distances: (n,) to each enrolled template, in the order of ``PcaMatcher.templates``.
        second: The gesture that is nearest but one; None when only one is enrolled.
    """

    point: F32
    distances: F32
    second: str | None


@dataclass(frozen=True)
class Match:
    """The enrolled gesture nearest to a picture.

    Attributes:
        gesture: Its name.
        distance: Root mean square over the features; 0 is the enrolled template itself.
        margin: Distance of the second gesture minus this one; None when only one is enrolled.
        error: Reconstruction error, in the unit of the distance.
        accepted: False when the distance, the margin or the error says that it is unknown.
        reason: Why it is not accepted, in plain words.
        cause: The same for programs.
        strangeness: How unlike anything enrolled, in one number: up to 1 is accepted, more is not.
    """

    gesture: str
    distance: float
    margin: float | None
    error: float
    accepted: bool
    reason: str | None = None
    strangeness: float = 0.0
    cause: Cause | None = None


@dataclass(frozen=True)
class GestureEvent:
    """A gesture begins, goes on or is over. ``seq`` is the frame that says so."""

    gesture: str
    phase: Phase
    seq: int


@dataclass(frozen=True)
class FrameResult:
    """All that one frame led to.

    Attributes:
        seq: The frame's number, as its sender gave it.
        motion: Part of the pixels (0 to 1) that changed; None before three frames were sampled.
        still: True when the motion gate lets the frame through.
        roi: The hand without the arm, in pixels of the frame as sent.
        wrist: Where the arm is cut off, in pixels of the frame as sent.
        mask: (h, w), hand with arm = 1, at the working resolution; its own copy.
        way: How the mask was made, and why so.
        template: (80, 60), or None when the frame did not get that far.
        match: The nearest gesture, also when it was not accepted; None without a template.
        distances: Distance to every enrolled gesture.
        reason: Why nothing comes of this frame, in plain words; None when a gesture was seen.
        cause: The same for programs.
        digest: Checksum of the pixels: that of the frame before, when nothing at all has changed.
        timing_ms: Time spent in each stage, and ``total``.
        event: What changed with this frame.
        gesture: The gesture that is held now.
        looks: How often the mask network ran; 0 by threshold, and when the last mask stands.
        mismatch: (h, w), 1 where the motion gate saw a change, as large as the mask; its own copy.
            None before three frames were sampled.
        palm: In pixels of the frame as sent; None without a hand.
        look: Where the hand lies among what is enrolled; None when nothing was matched.
        hand: Its landmarks; None where it was found by its mask, or not at all.
        by_landmarks: Whether it was matched by them: ``match``, ``distances`` and ``look`` are then
            those of :attr:`PcaMatcher.by_landmarks <app.pipeline.PcaMatcher.by_landmarks>`.
    """

    seq: int
    motion: float | None
    still: bool
    roi: Box | None
    wrist: WristCut | None
    mask: U8
    way: Way
    template: U8 | None
    match: Match | None
    reason: str | None
    timing_ms: Mapping[str, float]
    event: GestureEvent | None
    gesture: str | None
    distances: Mapping[str, float] = field(default_factory=dict)
    cause: Cause | None = None
    digest: int = 0
    looks: int = 0
    mismatch: U8 | None = None
    palm: Circle | None = None
    look: Look | None = None
    hand: "HandLandmarks | None" = None
    by_landmarks: bool = False

    def as_message(self, tick: int = 0) -> dict[str, Any]:
        """The ``frame`` message of docs/protocol.md. A match that was not accepted is null."""
        match = None
        if self.match is not None and self.match.accepted:
            match = {
                "gesture": self.match.gesture,
                "distance": round(self.match.distance, 4),
                "margin": None if self.match.margin is None else round(self.match.margin, 4),
            }
        return {
            "type": "frame",
            "seq": self.seq,
            "tick": tick,
            "motion": None if self.motion is None else round(self.motion, 5),
            "still": self.still,
            "roi": None if self.roi is None else list(self.roi),
            "mask": {"mode": self.way.mode, "why": self.way.why},
            "match": match,
            "reason": self.reason,
            "cause": self.cause,
            "timing_ms": {stage: round(ms, 3) for stage, ms in self.timing_ms.items()},
        }


@dataclass(frozen=True)
class Extraction:
    """The hand found in one photograph.

    Attributes:
        mask: (h, w), hand with arm = 1, at the working resolution.
        roi: The hand without the arm, in pixels of the photograph as it is shown (EXIF applied).
        wrist: Where the arm was cut off, in the same pixels, or None.
        template: (80, 60).
        views: (v, 80, 60): the template turned and cut in several ways, for matching.
        width: Of the photograph, pixels.
        height: Of the photograph, pixels.
        hand: Its landmarks without place and size; None where they were not found.
    """

    mask: U8
    roi: Box
    wrist: WristCut | None
    template: U8
    views: U8
    width: int
    height: int
    hand: "HandShape | None" = None
