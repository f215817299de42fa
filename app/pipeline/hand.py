"""The stages from pixels to the hand's mask, in order, with one clock for all of them.

Live frames, photographs for enrolment and an edge node all take this way.
"""

from dataclasses import dataclass, field
from time import perf_counter

from app.config import PipelineSettings
from app.pipeline.binarise import Binarise, Binary
from app.pipeline.channel import Channel
from app.pipeline.normalise import Normalise
from app.pipeline.palm import Palm, PalmFinder
from app.pipeline.smooth import Smooth
from app.pipeline.types import U8


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
    """Pixels to the hand's piece of the mask."""

    def __init__(self, settings: PipelineSettings) -> None:
        self._channel = Channel(settings.binarise.channel)
        self._smooth = Smooth(settings.smooth)
        self._normalise = Normalise(settings.normalise)
        self._binarise = Binarise(settings.binarise)
        self._find_palm = PalmFinder()
        self._settings = settings.binarise

    def __call__(self, pixels: U8, watch: Stopwatch) -> Palm:
        """Find the hand in (h, w, 3) BGR or (h, w, 1) grey."""
        plane = self._channel(pixels)
        watch.lap("channel")
        smooth = self._smooth(plane)
        watch.lap("smooth")
        normalised = self._normalise(smooth)
        watch.lap("normalise")
        self.binary: Binary = self._binarise(normalised)
        watch.lap("binarise")
        palm = self._find_palm(self.binary.mask)
        watch.lap("palm")
        return palm

    def why_none(self, palm: Palm) -> str | None:
        """Why the piece last found is no hand, in plain words; None when it may be one."""
        limits, binary = self._settings, self.binary
        if binary.contrast < limits.min_contrast or not palm.found:
            return (
                "no hand in the picture: hardly any contrast "
                f"({binary.contrast:.1f} levels, at least {limits.min_contrast:.1f} needed)"
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
