"""Still: the hand in one photograph, for enrolment and for asking what a picture shows."""

from typing import NamedTuple

import cv2

from app.config import PipelineSettings
from app.errors import ImageRefused
from app.pipeline.binarise import Binarise
from app.pipeline.channel import Channel
from app.pipeline.choose import Choose
from app.pipeline.hand import FindHand, Stopwatch, surely_hand
from app.pipeline.hand_landmarks.live import agrees, silhouette, wanted
from app.pipeline.hand_landmarks.photo import PhotoHand, find_in_photo
from app.pipeline.mask import LearnedMask
from app.pipeline.normalise import Normalise
from app.pipeline.palm import Palm
from app.pipeline.pipeline import scale_box, scale_cut, whole_or_cut
from app.pipeline.quality import TWO_HANDS, Finding, Quality, judge, why_cut_off
from app.pipeline.reading import at_most, read_image
from app.pipeline.roi import RegionOfInterest
from app.pipeline.seen import SeenHand, seen_by_landmarks
from app.pipeline.smooth import Smooth
from app.pipeline.template import MakeTemplate
from app.pipeline.types import U8, Extraction
from app.pipeline.views import Views
from app.pipeline.wrist import WristCrop

SAME_HAND = 0.3
"""Of the smaller one of two masks: with less in common they are of different things."""
SURELY = 0.8
"""Presence from which the landmarks are right, whatever else is like a hand to the mask's
network."""
UNCLEAR = Finding(
    "unclear",
    "it is not clear which thing in the picture is the hand: show one hand, and nothing else that "
    "is like one",
)


class Shot(NamedTuple):
    """A photograph that is good enough to enrol."""

    extraction: Extraction
    quality: Quality


def extract_template(data: bytes, settings: PipelineSettings, *, whole: bool = True) -> Extraction:
    """Find the hand in a photograph and make its template.

    Args:
        data: JPEG, PNG, WebP, HEIC or AVIF; any size up to ``still.max_bytes`` and
            ``still.max_pixels``, colour or grey, EXIF orientation honoured.
        settings: Of the pipeline; the same as for live frames.
        whole: Refuse a hand that runs out of the picture.

    Raises:
        TooLarge: too many bytes.
        Unreadable: no picture.
        ImageRefused: no usable hand in it, with the reason in plain words; ``detail`` as in
            :func:`take_shot`.
    """
    found = _find(data, settings)
    if whole:
        _refuse(why_cut_off(found.palm), found.shown)
    return _extract(found, settings)


def take_shot(data: bytes, settings: PipelineSettings) -> Shot:
    """Find the hand in a photograph that is to be enrolled, and judge the photograph.

    Raises:
        TooLarge: too many bytes.
        ImageRefused: no picture, no hand in it, or one that should not be enrolled: cut off, too
            small, blurred, without a wrist, not alone, or not clearly the hand.
            ``detail["problem"]`` is a word for it, and ``detail["seen"]`` what was found of it, as
            :meth:`SeenHand.as_json` has it; no picture has neither.
    """
    found = _find(data, settings)
    if found.elsewhere:
        _refuse(UNCLEAR, found.shown)
    quality = judge(found.pixels, _everything(found, settings), found.palm, settings.quality)
    if found.seen is not None and found.seen.second and settings.quality.second_hand:
        _refuse(TWO_HANDS, found.shown)
    _refuse(quality.problem, found.shown)
    return Shot(_extract(found, settings), quality)


class _Found(NamedTuple):
    """The hand in a photograph, before the arm is cut off; ``width`` x ``height`` is the photo.

    ``elsewhere``: the landmarks are hardly sure, and the mask's network is sure of something else.
    """

    pixels: U8
    width: int
    height: int
    palm: Palm
    mode: str
    seen: PhotoHand | None
    shown: SeenHand
    elsewhere: bool = False


def _find(data: bytes, settings: PipelineSettings) -> _Found:
    if not wanted(settings):
        return _find_by_mask(*read_image(data, settings), settings)
    fine, width, height = read_image(data, settings, settings.still.landmark_side)
    pixels = at_most(fine, settings.still.working_side)
    seen = find_in_photo(fine, settings.landmarks)
    if seen is None:
        if Choose(settings.binarise)(pixels).mode == "threshold":
            found = _find_by_mask(pixels, width, height, settings)
            if found.mode == "threshold" and _network_sees(found, settings):
                return found
        _refuse(Finding("no_hand", "no hand found"), SeenHand((width, height)))
    assert seen is not None
    h, w = pixels.shape[:2]
    drawn = silhouette(seen.hand, (h, w), (w / fine.shape[1], h / fine.shape[0]))
    scale = width / fine.shape[1], height / fine.shape[0]
    # The outline is kept, too: for the paper's way, and for galleries without landmarks.
    by_mask = _mask_finder(settings)
    palm = by_mask(pixels, Stopwatch())
    any_mask = by_mask.why_none(palm) is None
    if any_mask and agrees(palm, drawn, seen.hand, fine, pixels):
        shown = seen_by_landmarks(seen, scale, (width, height), True)
        return _Found(pixels, width, height, palm, by_mask.way.mode, seen, shown)
    shown = seen_by_landmarks(seen, scale, (width, height), False if any_mask else None)
    elsewhere = any_mask and seen.hand.presence < SURELY and _in_common(palm, drawn) < SAME_HAND
    return _Found(pixels, width, height, drawn, "landmarks", seen, shown, elsewhere)


def _in_common(one: Palm, other: Palm) -> float:
    """Pixels that two masks share, in parts of the smaller one."""
    both = cv2.countNonZero(cv2.bitwise_and(one.piece, other.piece))
    return both / max(min(one.area, other.area), 1)


def _network_sees(found: _Found, settings: PipelineSettings) -> bool:
    """Whether the mask's network takes for a hand what the threshold has found."""
    masked = LearnedMask()(found.pixels)
    if masked.sure < settings.binarise.min_sure:
        return False
    both = cv2.countNonZero(cv2.bitwise_and(found.palm.piece, masked.mask))
    least = min(found.palm.area, cv2.countNonZero(masked.mask))
    return both >= SAME_HAND * max(least, 1)


def _mask_finder(settings: PipelineSettings) -> FindHand:
    alone = settings.landmarks.model_copy(update={"mode": "off"})
    return FindHand(settings.model_copy(update={"landmarks": alone}))


def _find_by_mask(pixels: U8, width: int, height: int, settings: PipelineSettings) -> _Found:
    find_hand = _mask_finder(settings)
    palm = find_hand(pixels, Stopwatch())
    reason = find_hand.why_none(palm)
    shown = SeenHand((width, height))
    if reason is not None:
        words = reason.replace("no hand in the picture", "no hand found", 1)
        _refuse(Finding("no_hand", words), shown)
    return _Found(pixels, width, height, palm, find_hand.way.mode, None, shown)


def _everything(found: _Found, settings: PipelineSettings) -> U8:
    """(h, w) mask of all that looks like a hand, wherever in the picture it is."""
    if found.seen is not None:
        # Whether there is a second hand was asked of the detector.
        return found.palm.piece
    if found.mode == "learned":
        # The hand's own mask may come from a look at its part of the picture alone.
        height, width = found.palm.piece.shape
        whole = (0, 0, width, height)
        share = LearnedMask()._look(found.pixels, whole)
        return surely_hand(share, width, height)
    plane = Channel(settings.binarise.channel)(found.pixels)
    normalised = Normalise(settings.normalise)(Smooth(settings.smooth)(plane))
    return Binarise(settings.binarise)(normalised).mask


def _refuse(problem: Finding | None, shown: SeenHand) -> None:
    if problem is not None:
        raise ImageRefused(problem.message, problem=problem.code, seen=shown.as_json())


def _extract(found: _Found, settings: PipelineSettings) -> Extraction:
    palm, width, height = found.palm, found.width, found.height
    hand, cut = WristCrop(settings.wrist)(palm)
    box = RegionOfInterest(settings.roi)(hand)
    if box is None:
        _refuse(Finding("no_hand", "no hand found: nothing is left above the wrist"), found.shown)
    assert box is not None
    scale_x, scale_y = width / palm.piece.shape[1], height / palm.piece.shape[0]
    roi = scale_box(box, scale_x, scale_y)
    assert roi is not None
    return Extraction(
        mask=palm.piece.copy(),
        roi=roi,
        wrist=scale_cut(cut, scale_x, scale_y),
        template=MakeTemplate()(hand, box),
        views=Views(settings.match)(whole_or_cut(palm, hand, settings)),
        width=width,
        height=height,
        hand=None if found.seen is None else found.seen.shape,
        seen=found.shown._replace(region=roi),
    )
