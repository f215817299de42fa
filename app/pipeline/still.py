"""Still: the hand in one photograph, for enrolment and for asking what a picture shows."""

import cv2
import numpy as np
import simplejpeg

from app.config import PipelineSettings
from app.errors import ImageRefused, TooLarge
from app.pipeline.formats import ImageInfo, cut_short, read_info
from app.pipeline.hand import FindHand, Stopwatch
from app.pipeline.palm import SIDES, Palm
from app.pipeline.pipeline import scale_box, scale_cut, whole_or_cut
from app.pipeline.roi import RegionOfInterest
from app.pipeline.template import MakeTemplate
from app.pipeline.types import U8, Extraction
from app.pipeline.views import Views
from app.pipeline.wrist import WristCrop

MIN_SIDE = 32
"""Pixels. A smaller photograph does not fill a template of 60x80 with anything of its own."""
CUT_OFF = 1.6
"""Palm radii. A hand that touches another side than the arm's on so much runs out of the picture;
finger tips that just touch it do not."""


def read_image(data: bytes, settings: PipelineSettings) -> tuple[U8, int, int]:
    """Decode a JPEG, PNG or WebP file, upright and scaled down.

    Returns:
        (h, w, 3) BGR or (h, w, 1) grey, the longer side at most ``still.working_side``; then the
        width and the height of the whole picture when upright.

    Raises:
        TooLarge: too many bytes.
        ImageRefused: not a picture, broken, or too many pixels; judged by its header.
    """
    limits = settings.still
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
        raise ImageRefused(
            f"the picture is {info.width}x{info.height}: at most {most / 1e6:.3g} million pixels "
            f"are accepted ({info.kind.upper()})",
            width=info.width,
            height=info.height,
        )
    if min(info.width, info.height) < MIN_SIDE:
        raise ImageRefused(
            f"the picture is {info.width}x{info.height}: at least {MIN_SIDE}x{MIN_SIDE} is needed",
            width=info.width,
            height=info.height,
        )
    try:
        pixels = _jpeg(data, info, limits.working_side) if info.kind == "jpeg" else _other(data)
    except (cv2.error, ValueError, RuntimeError, MemoryError):
        raise cut_short() from None
    scale = limits.working_side / max(pixels.shape[:2])
    if scale < 1:
        height, width = pixels.shape[:2]
        size = max(1, round(width * scale)), max(1, round(height * scale))
        pixels = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA).astype(np.uint8)
    pixels = _upright(pixels.reshape(*pixels.shape[:2], -1), info.orientation)
    turned = info.orientation >= 5
    return pixels, *((info.height, info.width) if turned else (info.width, info.height))


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
    if pixels.dtype == np.uint16:
        pixels = pixels // np.uint16(256)
    picture = pixels.astype(np.uint8).reshape(*pixels.shape[:2], -1)
    if picture.shape[2] in (2, 4):
        # What is transparent is shown on white by every viewer.
        alpha = picture[:, :, -1:].astype(np.uint16)
        mixed = picture[:, :, :-1] * alpha + 255 * (255 - alpha)
        picture = (mixed // 255).astype(np.uint8)
    return np.ascontiguousarray(picture)


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
        data: JPEG, PNG or WebP; any size up to ``still.max_bytes`` and ``still.max_pixels``, colour
            or grey, EXIF orientation honoured.
        settings: Of the pipeline; the same as for live frames.
        whole: Refuse a hand that runs out of the picture.

    Raises:
        TooLarge: too many bytes.
        ImageRefused: no picture, or no usable hand in it, with the reason in plain words.
    """
    pixels, width, height = read_image(data, settings)
    find_hand = FindHand(settings)
    palm = find_hand(pixels, Stopwatch())
    reason = find_hand.why_none(palm)
    if reason is None and whole:
        reason = _why_cut_off(palm)
    if reason is not None:
        raise ImageRefused(_as_refusal(reason))
    hand, cut = WristCrop(settings.wrist)(palm)
    box = RegionOfInterest(settings.roi)(hand)
    if box is None:
        raise ImageRefused("no hand found: nothing is left above the wrist")
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
    )


def _as_refusal(reason: str) -> str:
    return reason.replace("no hand in the picture", "no hand found", 1)


def _why_cut_off(palm: Palm) -> str | None:
    edges = (palm.piece[-1], palm.piece[:, 0], palm.piece[0], palm.piece[:, -1])
    for side, edge in zip(SIDES, edges, strict=True):
        if side != palm.arm and cv2.countNonZero(edge) > CUT_OFF * palm.radius:
            return f"the hand is cut off at the {side} of the picture: show all of it"
    return None
