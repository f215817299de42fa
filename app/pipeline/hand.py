"""The stages from pixels to the hand's mask, in order, with one clock for all of them.

Live frames, photographs for enrolment and an edge node all take this way.
"""

from dataclasses import dataclass, field
from time import perf_counter

import cv2
import numpy as np

from app.config import PipelineSettings
from app.pipeline.binarise import Binarise
from app.pipeline.channel import Channel
from app.pipeline.choose import Choose
from app.pipeline.hand_landmarks.live import ByLandmarks, agrees
from app.pipeline.hand_landmarks.types import HandLandmarks
from app.pipeline.mask import LearnedMask, Masked
from app.pipeline.normalise import Normalise
from app.pipeline.palm import Palm, PalmFinder
from app.pipeline.quality import two_hands
from app.pipeline.smooth import Smooth
from app.pipeline.types import F32, U8, Way

SURE = 0.85
"""Share of hand from which a pixel counts towards a second hand: a face or a lamp that the network
half takes for one must not refuse a good picture."""


@dataclass
class Stopwatch:
    """Time spent in each stage, in ms. ``lap`` ends a stage; ``total`` is kept up to date."""

    timing_ms: dict[str, float] = field(default_factory=dict)
    started: float = field(default_factory=perf_counter)

    def __post_init__(self) -> None:
        self._lap = self.started

    def lap(self, stage: str) -> None:
        """The time since the last lap was spent in this stage."""
        now = perf_counter()
        self.timing_ms[stage] = (now - self._lap) * 1000
        self.timing_ms["total"] = (now - self.started) * 1000
        self._lap = now


class FindHand:
    """Pixels to the hand's piece of the mask, by the way that suits the picture.

    Attributes:
        way: How the last mask was made, and why so.
        looks: How often the mask network ran for it.
        hand: The landmarks that it was drawn from; None where it was found by its mask.
    """

    def __init__(self, settings: PipelineSettings) -> None:
        self._choose = Choose(settings.binarise)
        self._channel = Channel(settings.binarise.channel)
        self._smooth = Smooth(settings.smooth)
        self._normalise = Normalise(settings.normalise)
        self._binarise = Binarise(settings.binarise)
        self._learned: LearnedMask | None = None
        self._find_palm = PalmFinder()
        self._settings = settings.binarise
        self._second_hand = settings.quality.second_hand
        self._mask: U8 = np.empty(0, np.uint8)
        self._two = False
        self._contrast = self._sure = 0.0
        self._landmarks = ByLandmarks.where_wanted(settings)
        self.way = Way("threshold", "")
        self.looks = 0
        self.hand: HandLandmarks | None = None

    def __call__(
        self, pixels: U8, watch: Stopwatch, *, held: bool = False, mask: bool = True
    ) -> Palm:
        """Find the hand in a picture, the next of a stream.

        Args:
            pixels: (h, w, 3) BGR or (h, w, 1) grey.
            watch: Told how long each stage took.
            held: The hand holds a gesture.
            mask: Whether its outline counts. Without, and where its landmarks are seen, it is drawn
                from these and no mask is made.
        """
        self.looks = 0
        self.hand = None
        if self._landmarks is None:
            return self._by_mask(pixels, watch, held)
        self.hand, small, drawn = self._landmarks(pixels)
        watch.lap("find")
        if drawn is None:
            self.way = self._choose(small, held=held)
            watch.lap("choose")
            if self.way.mode == "threshold":
                palm = self._by_mask(small, watch, held, chosen=True)
                if self.way.mode == "threshold":
                    return palm
            # Where the landmarks see no hand, a mask of what is like skin is none.
            self.way = self._landmarks.way
            return self._landmarks.nothing(small)
        if mask:
            palm = self._by_mask(small, watch, held)
            if self.why_none(palm) is None and agrees(palm, drawn, self.hand, pixels, small):
                return palm
        self.way = self._landmarks.way
        return drawn

    def _by_mask(self, pixels: U8, watch: Stopwatch, held: bool, *, chosen: bool = False) -> Palm:
        if not chosen:
            self.way = self._choose(pixels, held=held)
            watch.lap("choose")
        if self.way.mode == "learned":
            return self._by_network(pixels, watch)
        plane = self._channel(pixels)
        watch.lap("channel")
        smooth = self._smooth(plane)
        watch.lap("smooth")
        normalised = self._normalise(smooth)
        watch.lap("normalise")
        binary = self._binarise(normalised)
        self._contrast, self._mask = binary.contrast, binary.mask
        watch.lap("binarise")
        palm = self._find_palm(binary.mask)
        watch.lap("palm")
        none = self.why_none(palm) is not None
        self._choose.found(0 if none else palm.area)
        if none or not self._choose.unproved:
            return palm
        learned = self._network(pixels)
        # The network may have looked at a part only; the arm goes on outside of it.
        x, y, width, height = learned.bounds
        part = slice(y, y + height), slice(x, x + width)
        other = self._choose.prove(palm.piece[part], learned.mask[part])
        if other is None:
            watch.lap("choose")
            return palm
        self.way = other
        return self._by_network(pixels, watch)

    @property
    def by_landmarks(self) -> bool:
        """Whether hands are looked for by their landmarks first."""
        return self._landmarks is not None

    def reset(self) -> None:
        """Forget the hand that is followed."""
        if self._landmarks is not None:
            self._landmarks.reset()

    def _by_network(self, pixels: U8, watch: Stopwatch) -> Palm:
        masked = self._network(pixels)
        self._sure = masked.sure
        watch.lap("binarise")
        palm = self._find_palm(masked.mask, masked.bounds)
        watch.lap("palm")
        return palm

    def _network(self, pixels: U8) -> Masked:
        # Made when first needed: with the threshold alone the network is never loaded.
        if self._learned is None:
            self._learned = LearnedMask()
        masked = self._learned(pixels)
        self.looks += self._learned.looks
        return masked

    def two_hands(self, palm: Palm) -> bool:
        """Whether there is a second hand beside the one that was just found.

        The network looks at the part round the hand, and at the whole picture every now and then;
        while there are two hands, every time.
        """
        if self._landmarks is not None and self.way.mode != "threshold":
            return self._landmarks.second and self._second_hand > 0
        if self.way.mode == "threshold":
            return two_hands(self._mask, palm, self._second_hand)
        assert self._learned is not None
        if (share := self._learned.everything) is not None:
            height, width = palm.piece.shape
            self._two = two_hands(surely_hand(share, width, height), palm, self._second_hand)
        if self._two:
            self._learned.look_round()
        return self._two

    def why_none(self, palm: Palm) -> str | None:
        """Why the piece last found is no hand, in plain words; None when it may be one."""
        limits = self._settings
        if self.way.mode == "landmarks":
            return None if palm.found or self._landmarks is None else self._landmarks.why_none()
        if self.way.mode == "learned":
            if not palm.found:
                return "no hand in the picture"
            if self._sure < limits.min_sure:
                return (
                    "no hand in the picture: what is most like one is hardly one "
                    f"({self._sure:.2f}, at least {limits.min_sure:.2f} needed)"
                )
        elif self._contrast < limits.min_contrast or not palm.found:
            return (
                "no hand in the picture: hardly any contrast "
                f"({self._contrast:.1f} levels, at least {limits.min_contrast:.1f} needed)"
            )
        part = palm.area / palm.piece.size
        if part < limits.min_area:
            return (
                f"no hand in the picture: the largest thing fills {part:.1%} of it, "
                f"at least {limits.min_area:.1%} needed"
            )
        if part > limits.max_area:
            return (
                f"no hand in the picture: the largest thing fills {part:.0%} of it, "
                f"at most {limits.max_area:.0%} allowed"
            )
        return None


def surely_hand(share: F32, width: int, height: int) -> U8:
    """The network's share of hand over a whole picture to its (h, w) mask of what is sure."""
    mask = cv2.resize(share, (width, height), interpolation=cv2.INTER_LINEAR) > SURE
    return mask.view(np.uint8)
