"""Reading: a picture's file to pixels, upright and scaled down."""

from typing import Any

import cv2
import numpy as np
import simplejpeg
from numpy.typing import NDArray

from app.config import PipelineSettings
from app.errors import TooLarge, Unreadable
from app.pipeline import heif
from app.pipeline.formats import ImageInfo, cut_short, read_info
from app.pipeline.types import U8

BAND = 256
"""Rows of a PNG or WebP that are brought to 8 bits without transparency at a time."""
MIN_SIDE = 32
"""Pixels. A smaller photograph does not fill a template of 60x80 with anything of its own."""


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
    pixels = _upright(at_most(pixels, side), info.orientation)
    turned = info.orientation >= 5
    return pixels, *((info.height, info.width) if turned else (info.width, info.height))


def at_most(pixels: U8, side: int) -> U8:
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
