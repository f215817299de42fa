"""Still: the hand in one photograph, for enrolment and for asking what a picture shows."""

from typing import Any, NamedTuple

import cv2
import numpy as np
import simplejpeg
from numpy.typing import NDArray

from app.config import PipelineSettings
from app.errors import ImageRefused, TooLarge, Unreadable
from app.pipeline import heif
from app.pipeline.binarise import Binarise
from app.pipeline.channel import Channel
from app.pipeline.choose import Choose
from app.pipeline.formats import ImageInfo, cut_short, read_info
from app.pipeline.hand import FindHand, Stopwatch, surely_hand
from app.pipeline.hand_landmarks.live import agrees, silhouette, wanted
from app.pipeline.hand_landmarks.photo import PhotoHand, find_in_photo
from app.pipeline.mask import LearnedMask
from app.pipeline.normalise import Normalise
from app.pipeline.palm import Palm
from app.pipeline.pipeline import scale_box, scale_cut, whole_or_cut
from app.pipeline.quality import TWO_HANDS, Finding, Quality, judge, why_cut_off
from app.pipeline.roi import RegionOfInterest
from app.pipeline.smooth import Smooth
from app.pipeline.template import MakeTemplate
from app.pipeline.types import U8, Extraction
from app.pipeline.views import Views
from app.pipeline.wrist import WristCrop

BAND = 256
"""Rows of a PNG or WebP that are brought to 8 bits without transparency at a time."""
MIN_SIDE = 32
"""Pixels. A smaller photograph does not fill a template of 60x80 with anything of its own."""


class Shot(NamedTuple):
    """A photograph that is good enough to enrol."""

    extraction: Extraction
    quality: Quality


def read_image(
    data: bytes, settings: PipelineSettings, side: int | None = None
) -> tuple[U8, int, int]:
    """Decode a picture's file, upright and scaled down.

    Returns:
        (h, w, 3) BGR or (h, w, 1) grey, the longer side at most ``side``, by default
        ``still.working_side``; then the width and the height of the whole picture when upright.

    Raises:
        TooLarge: too many bytes.
        Unreadable: not a picture, broken, or too many pixels; judged by its header.
    """
    limits = settings.still
    side = side or limits.working_side
    if len(data) > limits.max_bytes:
        raise TooLarge(
            f"the file has {len(data)} bytes: at most {limits.max_bytes} are accepted",
            bytes=len(data),
            max_bytes=limits.max_bytes,
        )
    info = read_info(data)
    # Other formats than JPEG have to be decoded at full size before they can be made smaller.
    most = limits.max_pixels if info.kind == "jpeg" else limits.max_pixels // 2
    if info.width * info.height > most:
        raise Unreadable(
            f"the picture is {info.width}x{info.height}: at most {most / 1e6:.3g} million pixels "
            f"are accepted ({info.kind.upper()})",
            width=info.width,
            height=info.height,
        )
    if min(info.width, info.height) < MIN_SIDE:
        raise Unreadable(
            f"the picture is {info.width}x{info.height}: at least {MIN_SIDE}x{MIN_SIDE} is needed",
            width=info.width,
            height=info.height,
        )
    try:
        pixels = _pixels(data, info, side)
    except (cv2.error, ValueError, RuntimeError, MemoryError):
        raise cut_short() from None
    pixels = _upright(_at_most(pixels, side), info.orientation)
    turned = info.orientation >= 5
    return pixels, *((info.height, info.width) if turned else (info.width, info.height))


def _at_most(pixels: U8, side: int) -> U8:
    """(h, w, c), scaled down until its longer side has at most so many pixels."""
    scale = side / max(pixels.shape[:2])
    if scale < 1:
        height, width = pixels.shape[:2]
        size = max(1, round(width * scale)), max(1, round(height * scale))
        pixels = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA).astype(np.uint8)
    return pixels.reshape(*pixels.shape[:2], -1)


def _pixels(data: bytes, info: ImageInfo, side: int) -> U8:
    match info.kind:
        case "jpeg":
            return _jpeg(data, info, side)
        case "heic" | "avif":
            shown = heif.decode(data, info.kind)
            if shown is None:
                raise cut_short()
            # To BGR, and BGRA, as OpenCV has it.
            order = [2, 1, 0, 3][: shown.shape[2]]
            return _on_white(shown[:, :, order])
    return _other(data)


def _jpeg(data: bytes, info: ImageInfo, side: int) -> U8:
    factor = 1
    while factor < 8 and max(info.width, info.height) // (2 * factor) >= side:
        factor *= 2
    pixels: U8 = simplejpeg.decode_jpeg(
        data,
        "GRAY" if info.components == 1 else "BGR",
        min_width=-(-info.width // factor),
        min_height=-(-info.height // factor),
        min_factor=factor,
    )
    return pixels


def _other(data: bytes) -> U8:
    # The EXIF orientation is applied here, once, for all formats.
    flags = cv2.IMREAD_UNCHANGED | cv2.IMREAD_IGNORE_ORIENTATION
    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    if pixels is None:
        raise cut_short()
    return _on_white(pixels.reshape(*pixels.shape[:2], -1))


def _on_white(pixels: NDArray[Any]) -> U8:
    """(h, w, 1 to 4) of 8 or 16 bits to (h, w, 1) grey or (h, w, 3) BGR of 8 bits."""
    height, width, planes = pixels.shape
    picture = np.empty((height, width, 1 if planes < 3 else 3), np.uint8)
    # Band by band: copies of a picture of 25 million pixels would take half a gigabyte.
    for top in range(0, height, BAND):
        picture[top : top + BAND] = _opaque(pixels[top : top + BAND])
    return picture


def _opaque(band: NDArray[Any]) -> U8:
    """8 bits a channel, and what is transparent on white, as every viewer shows it."""
    if band.dtype == np.uint16:
        band = band // np.uint16(256)
    if band.shape[2] in (1, 3):
        return band.astype(np.uint8)
    alpha = band[:, :, -1:].astype(np.uint16)
    mixed = band[:, :, :-1] * alpha + 255 * (255 - alpha)
    return (mixed // 255).astype(np.uint8)


def _upright(pixels: U8, orientation: int) -> U8:
    """Turn a stored picture the way it is shown (CIPA DC-008, tag 0x0112)."""
    if orientation in (5, 6, 7, 8):
        pixels = pixels.transpose(1, 0, 2)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return np.ascontiguousarray(pixels)


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
        ImageRefused: no usable hand in it, with the reason in plain words.
    """
    found = _find(data, settings)
    if whole:
        _refuse(why_cut_off(found.palm))
    return _extract(found, settings)


def take_shot(data: bytes, settings: PipelineSettings) -> Shot:
    """Find the hand in a photograph that is to be enrolled, and judge the photograph.

    Raises:
        TooLarge: too many bytes.
        ImageRefused: no picture, no hand in it, or one that should not be enrolled: cut off, too
            small, blurred, without a wrist, or not alone. ``detail["problem"]`` is a word for it.
    """
    found = _find(data, settings)
    quality = judge(found.pixels, _everything(found, settings), found.palm, settings.quality)
    if found.seen is not None and found.seen.second and settings.quality.second_hand:
        _refuse(TWO_HANDS)
    _refuse(quality.problem)
    return Shot(_extract(found, settings), quality)


class _Found(NamedTuple):
    """The hand in a photograph, before the arm is cut off; ``width`` x ``height`` is the photo."""

    pixels: U8
    width: int
    height: int
    palm: Palm
    mode: str
    seen: PhotoHand | None


def _find(data: bytes, settings: PipelineSettings) -> _Found:
    if not wanted(settings):
        return _find_by_mask(*read_image(data, settings), settings)
    fine, width, height = read_image(data, settings, settings.still.landmark_side)
    pixels = _at_most(fine, settings.still.working_side)
    seen = find_in_photo(fine, settings.landmarks)
    if seen is None:
        if Choose(settings.binarise)(pixels).mode == "threshold":
            return _find_by_mask(pixels, width, height, settings)
        _refuse(Finding("no_hand", "no hand found"))
    assert seen is not None
    h, w = pixels.shape[:2]
    drawn = silhouette(seen.hand, (h, w), (w / fine.shape[1], h / fine.shape[0]))
    # The outline is kept, too: for the paper's way, and for galleries without landmarks.
    by_mask = _mask_finder(settings)
    palm = by_mask(pixels, Stopwatch())
    if by_mask.why_none(palm) is None and agrees(palm, drawn, seen.hand, fine, pixels):
        return _Found(pixels, width, height, palm, by_mask.way.mode, seen)
    return _Found(pixels, width, height, drawn, "landmarks", seen)


def _mask_finder(settings: PipelineSettings) -> FindHand:
    alone = settings.landmarks.model_copy(update={"mode": "off"})
    return FindHand(settings.model_copy(update={"landmarks": alone}))


def _find_by_mask(pixels: U8, width: int, height: int, settings: PipelineSettings) -> _Found:
    find_hand = _mask_finder(settings)
    palm = find_hand(pixels, Stopwatch())
    reason = find_hand.why_none(palm)
    if reason is not None:
        _refuse(Finding("no_hand", reason.replace("no hand in the picture", "no hand found", 1)))
    return _Found(pixels, width, height, palm, find_hand.way.mode, None)


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


def _refuse(problem: Finding | None) -> None:
    if problem is not None:
        raise ImageRefused(problem.message, problem=problem.code)


def _extract(found: _Found, settings: PipelineSettings) -> Extraction:
    palm, width, height = found.palm, found.width, found.height
    hand, cut = WristCrop(settings.wrist)(palm)
    box = RegionOfInterest(settings.roi)(hand)
    if box is None:
        raise ImageRefused("no hand found: nothing is left above the wrist", problem="no_hand")
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
    )
