"""Playing a stream, and what is counted.

A stream is played once with the motion gate open, so that every frame is matched; what the gate and
the agreement make of it is then worked out from that record, with any settings, in a moment. A test
holds that the pipeline itself comes to the same.

- **false starts**: starts where the label is ``none``, except within :data:`AFTER_S` after a
  gesture was shown.
- **wrong starts**: from the first frame that leaves gesture A to :data:`AFTER_S` after B rests (or,
  when A or B is none, while the hand comes or goes), a start of any third gesture. One that begins
  with B at rest and then lasts is not of the transition: B itself is taken for another, and it
  counts as mistaken.
- **mistaken**: at rest, any other start of a gesture that is not the one that rests.
- **missed**: rests of at least :data:`LONG_S` during which, and on the way to which, the gesture
  does not start.
- **dropped**: rests during which a gesture that had started ends.
- **latency**: from the capture of the first frame at rest to the start; a frame's processing time
  comes on top. 0 when the start was earlier: the end of a movement is slower than the gate asks.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby

import numpy as np
import simplejpeg

from app.config import PipelineSettings
from app.pipeline import Gallery, GestureEvent, PcaMatcher, Pipeline
from app.pipeline.agreement import Agreement
from app.pipeline.motion import MotionGate
from app.pipeline.types import U8, Match
from benchmarks.streams.scene import Frame, Label

AFTER_S = 0.3
LONG_S = 0.55
QUALITY = 80


@dataclass(frozen=True)
class Seen:
    """What the pipeline saw in one frame, whether or not the hand moved."""

    at: float
    label: Label
    match: Match | None
    mask: U8
    """Packed by eight along its rows."""
    shape: tuple[int, int]
    ms: float


def to_jpeg(picture: U8) -> bytes:
    """The picture as a browser would send it."""
    data: bytes = simplejpeg.encode_jpeg(picture, QUALITY, "BGR", colorsubsampling="420")
    return data


def record(
    stream: Iterable[Frame], settings: PipelineSettings, gallery: Gallery, fps: float
) -> Iterator[Seen]:
    """Play a stream through the pipeline with the motion gate open.

    Hands are found by mask: what :func:`decide` makes of a record rests on masks alone.
    """
    open_gate = settings.motion.model_copy(update={"threshold": 1.0, "held_threshold": 1.0})
    by_mask = settings.landmarks.model_copy(update={"mode": "off"})
    opened = settings.model_copy(update={"motion": open_gate, "landmarks": by_mask})
    pipeline = Pipeline(opened, PcaMatcher.fit(gallery, settings.match))
    for seq, (picture, label) in enumerate(stream):
        result = pipeline(to_jpeg(picture), seq=seq, now=seq / fps)
        yield Seen(
            at=seq / fps,
            label=label,
            match=result.match,
            mask=np.packbits(result.mask, axis=1),
            shape=(result.mask.shape[0], result.mask.shape[1]),
            ms=result.timing_ms["total"],
        )


Event = tuple[int, GestureEvent]
"""The number of a frame, and the start or end that it brought."""


def decide(seen: Sequence[Seen], settings: PipelineSettings) -> list[Event]:
    """What gate and agreement make of a record; as ``Pipeline.__call__`` does, stage by stage."""
    gate, agree = MotionGate(settings.motion), Agreement(settings.agreement)
    events: list[Event] = []
    for seq, one in enumerate(seen):
        mask = np.unpackbits(one.mask, axis=1, count=one.shape[1])
        motion = gate(mask, one.at)
        held = agree.gesture is not None
        looked_at = motion.still or motion.trembling or (held and motion.nearly_still)
        shown = one.match.gesture if one.match and one.match.accepted and looked_at else None
        strangeness = one.match.strangeness if one.match else 1.0
        event = agree(shown, seq, one.at, strangeness=strangeness, settled=motion.settled)
        if event is not None and event.phase != "hold":
            events.append((seq, event))
    return events


@dataclass
class Figures:
    """What came of a stream."""

    seconds: float = 0.0
    false_starts: list[tuple[float, str]] = field(default_factory=list)
    """When, s, and which gesture."""
    wrong_starts: list[tuple[float, str]] = field(default_factory=list)
    mistaken: list[tuple[float, str]] = field(default_factory=list)
    transitions: int = 0
    """From one enrolled gesture to another."""
    rests: int = 0
    missed: int = 0
    dropped: int = 0
    latency_ms: list[float] = field(default_factory=list)


def count(labels: Sequence[Label], events: Sequence[Event], fps: float) -> Figures:
    """Hold the events against the truth; see the top of this file."""
    figures = Figures(seconds=len(labels) / fps)
    after = round(AFTER_S * fps)
    spans: list[tuple[int, int, Label]] = []
    at = 0
    for label, group in groupby(labels):
        length = sum(1 for _ in group)
        spans.append((at, at + length, label))
        at += length
    starts = [(seq, event.gesture) for seq, event in events if event.phase == "start"]
    ends = [seq for seq, event in events if event.phase == "end"]

    def lasts(start: int) -> bool:
        return next((seq for seq in ends if seq > start), len(labels)) - start >= after

    earlier: set[str | None] = set()
    came = 0  # first frame of the way to the gesture that rests
    for number, (first, last, label) in enumerate(spans):
        allowed = {label.before, label.after}
        inside = [(seq, name) for seq, name in starts if first <= seq < last]
        for seq, name in inside:
            early = seq - first < after
            if name in allowed or (early and name in earlier and label.kind != "rest"):
                continue
            when = (seq / fps, name)
            if label.kind == "none":
                figures.false_starts.append(when)
            elif label.kind == "moving" or (early and not lasts(seq)):
                # Just come to rest, the gesture before may not start again either.
                figures.wrong_starts.append(when)
            else:
                figures.mistaken.append(when)
        if label.kind == "moving":
            figures.transitions += label.before is not None and label.after is not None
            came = first
        if label.kind == "rest" and last - first >= LONG_S * fps:
            figures.rests += 1
            own = [seq for seq, name in starts if came <= seq < last and name == label.after]
            if not own:
                figures.missed += 1
            else:
                figures.latency_ms.append(max(0.0, (own[0] - first) / fps * 1e3))
                figures.dropped += any(max(first, own[0]) < seq < last for seq in ends)
        earlier = allowed if number else set()
    return figures
