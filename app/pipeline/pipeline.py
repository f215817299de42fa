"""The pipeline: the order of the stages, and a name for everything between them."""

import zlib

from app.config import PipelineSettings
from app.pipeline.agreement import Agreement
from app.pipeline.decode import Decode
from app.pipeline.hand import FindHand, Stopwatch
from app.pipeline.hand_landmarks.shape import HandShape, ShapeFeatures
from app.pipeline.hand_landmarks.stillness import Stillness
from app.pipeline.hand_landmarks.types import HandLandmarks
from app.pipeline.match import Matched, PcaMatcher
from app.pipeline.motion import Motion, MotionGate
from app.pipeline.palm import Palm
from app.pipeline.rest import AtRest
from app.pipeline.roi import RegionOfInterest
from app.pipeline.template import MakeTemplate
from app.pipeline.types import F32, U8, Box, Cause, Circle, FrameResult, GestureEvent, WristCut
from app.pipeline.views import Views
from app.pipeline.wrist import WristCrop

STAGES = (
    "decode",
    "find",
    "choose",
    "channel",
    "smooth",
    "normalise",
    "binarise",
    "palm",
    "motion",
    "wrist",
    "roi",
    "alone",
    "template",
    "views",
    "match",
)
"""Names in ``FrameResult.timing_ms``, beside ``total``."""
NOT_YET: dict[Cause, str] = {
    "settling": "{} is seen, but the hand has just changed: hold it still",
    "agreeing": "{} is seen, but not for long enough yet",
    "doubtful": "{} is seen, but only just like what is taught: show it more clearly",
}
"""Why a gesture that is seen does not start with this frame."""


class Pipeline:
    """JPEG to gesture event. One per operator: it holds buffers, the gate and the agreement.

    Attributes:
        matcher: May be replaced at any time, when the gallery changed.
    """

    def __init__(self, settings: PipelineSettings, matcher: PcaMatcher) -> None:
        self.settings = settings
        self.matcher = matcher
        self._find_hand = FindHand(settings)
        side = settings.decode.working_side
        if self._find_hand.by_landmarks:
            side = max(side, settings.landmarks.working_side)
        self._decode = Decode(settings.decode.model_copy(update={"working_side": side}))
        self._gate = MotionGate(settings.motion)
        self._stillness = Stillness(settings.motion)
        self._shape_features = ShapeFeatures(either_hand=settings.match.either_hand)
        self._crop_wrist = WristCrop(settings.wrist)
        self._find_box = RegionOfInterest(settings.roi)
        self._make_template = MakeTemplate()
        self._make_views = Views(settings.match)
        self._agree = Agreement(settings.agreement)

    def reset(self) -> None:
        """Forget the frames seen and the gesture held, without an event."""
        self._find_hand.reset()
        self._gate.reset()
        self._stillness.reset()
        self._agree.reset()

    def tick(self, now: float) -> GestureEvent | None:
        """End a held gesture when frames stop coming; ``now`` in seconds, monotonic."""
        return self._agree.tick(now)

    def __call__(self, jpeg: bytes, *, seq: int, now: float) -> FrameResult:
        """Process one frame.

        Args:
            jpeg: Baseline JPEG.
            seq: The frame's number, carried through to the events.
            now: Seconds, monotonic.

        Raises:
            FrameRefused: see :class:`~app.pipeline.decode.Decode`; nothing is changed by it.
        """
        watch = Stopwatch(dict.fromkeys((*STAGES, "total"), 0.0))
        frame = self._decode(jpeg)
        digest = zlib.crc32(frame.pixels.data)
        watch.lap("decode")
        held = self._agree.gesture is not None
        # Where every gesture has landmarks the outline is only shown, and drawn from them.
        by_outline = self.matcher.by_landmarks is None and bool(self.matcher.labels)
        palm = self._find_hand(frame.pixels, watch, held=held, mask=by_outline)
        hand = self._find_hand.hand
        features = None if hand is None else self._shape_features(HandShape.of([hand]))
        motion = self._gate(palm.piece, now)
        rest = self._at_rest(motion, hand, features, now)
        watch.lap("motion")

        box: Box | None = None
        cut: WristCut | None = None
        template: U8 | None = None
        matched, by_landmarks = Matched(None, {}), False
        cause: Cause | None = None
        reason = self._find_hand.why_none(palm)
        if reason is None:
            cropped, cut = self._crop_wrist(palm)
            watch.lap("wrist")
            box = self._find_box(cropped)
            watch.lap("roi")
            if box is None:
                reason = "no hand in the picture: nothing is left above the wrist"
        if reason is not None:
            cause = "no_hand"
        elif self._find_hand.two_hands(palm):
            cause, reason = "two_hands", "two hands in the picture: show one"
        watch.lap("alone")
        if reason is None and rest.waits:
            cause, reason = "waiting", "waiting for three frames"
        elif reason is None and not (rest.still or (held and rest.nearly_still)):
            cause, reason = "moving", rest.why_moving
        elif reason is None and box is not None:
            template = self._make_template(cropped, box)
            watch.lap("template")
            by_hand = None if features is None else self.matcher.match_features(features)
            if by_hand is not None:
                matched, by_landmarks = by_hand, True
            else:
                views = self._make_views(whole_or_cut(palm, cropped, self.settings))
                watch.lap("views")
                matched = self.matcher(views)
            watch.lap("match")
            cause, reason = why_unmatched(matched, at_rest=rest.still)

        shown = matched.match.gesture if matched.match and matched.match.accepted else None
        strangeness = matched.match.strangeness if matched.match else 1.0
        event = self._agree(shown, seq, now, strangeness=strangeness, settled=rest.settled)
        if shown is not None and self._agree.pending is not None:
            cause = self._agree.pending
            reason = NOT_YET[cause].format(shown)
        mismatch = self._gate.mismatch
        scale_x, scale_y = frame.width / palm.piece.shape[1], frame.height / palm.piece.shape[0]
        return FrameResult(
            seq=seq,
            motion=motion.fraction,
            still=rest.still,
            roi=scale_box(box, scale_x, scale_y),
            wrist=scale_cut(cut, scale_x, scale_y),
            mask=palm.piece.copy(),
            way=self._find_hand.way,
            template=template,
            match=matched.match,
            distances=matched.distances,
            reason=reason,
            cause=cause,
            digest=digest,
            timing_ms=watch.timing_ms,
            event=event,
            gesture=self._agree.gesture,
            looks=self._find_hand.looks,
            mismatch=None if mismatch is None else mismatch.copy(),
            palm=None if cause == "no_hand" else scale_palm(palm, scale_x, scale_y),
            look=matched.look,
            hand=None if hand is None else hand.scaled(frame.width / frame.pixels.shape[1]),
            by_landmarks=by_landmarks,
        )

    def _at_rest(
        self, motion: Motion, hand: HandLandmarks | None, features: F32 | None, now: float
    ) -> AtRest:
        """Whether the hand rests: by its landmarks where they are known, else by its mask."""
        if hand is None or features is None:
            self._stillness.reset()
            return AtRest.of_mask(motion)
        return AtRest.of_hand(self._stillness(hand, features, now))


def why_unmatched(matched: Matched, *, at_rest: bool) -> tuple[Cause | None, str | None]:
    """Why the hand that was matched is no gesture, for programs and in plain words."""
    if matched.match is None:
        return "nothing_enrolled", "no gesture is enrolled yet"
    unknown = not matched.match.accepted
    return "moving" if unknown and not at_rest else matched.match.cause, matched.match.reason


def whole_or_cut(palm: Palm, hand: U8, settings: PipelineSettings) -> Palm:
    """What views are made of: the hand with its arm when views vary the cut, else without."""
    if settings.wrist.mode == "circle" and settings.match.cuts:
        return palm
    return palm._replace(piece=hand)


def scale_box(box: Box | None, scale_x: float, scale_y: float) -> Box | None:
    """A box of the working picture in pixels of the source."""
    if box is None:
        return None
    x, y, width, height = box
    left, top = round(x * scale_x), round(y * scale_y)
    return left, top, round((x + width) * scale_x) - left, round((y + height) * scale_y) - top


def scale_palm(palm: Palm, scale_x: float, scale_y: float) -> Circle:
    """The palm of the working picture in pixels of the source; its radius by the mean scale."""
    radius = palm.radius * (scale_x + scale_y) / 2
    return Circle(round(palm.x * scale_x), round(palm.y * scale_y), radius)


def scale_cut(cut: WristCut | None, scale_x: float, scale_y: float) -> WristCut | None:
    """A cut of the working picture in pixels of the source."""
    if cut is None:
        return None
    scale = scale_y if cut.side in ("bottom", "top") else scale_x
    return cut._replace(at=round(cut.at * scale))
