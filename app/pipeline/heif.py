"""HEIC and AVIF: the formats in which telephones keep photographs.

Pillow reads both, HEIC through pi-heif (libheif with the decoder libde265; no encoder). What the
header says is known before a pixel is decoded.
"""

import io
from typing import Literal, NamedTuple

import numpy as np
import pi_heif
from numpy.typing import NDArray
from PIL import AvifImagePlugin, Image, ImageOps

Kind = Literal["heic", "avif"]

_AVIF = (b"avif", b"avis")
_HEIC = (b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1")
_MAX_BRANDS = 256
"""Bytes of the list of brands that are looked at; files have three to six of four bytes."""
_PILLOW: dict[Kind, str] = {"heic": "HEIF", "avif": "AVIF"}

pi_heif.register_heif_opener(thumbnails=False, depth_images=False, aux_images=False)
# One picture at a time has its own thread already.
pi_heif.options.DECODE_THREADS = 1
AvifImagePlugin.DEFAULT_MAX_THREADS = 1


class Header(NamedTuple):
    """What the header says; width and height in pixels, as shown."""

    width: int
    height: int
    pictures: int


def kind_of(data: bytes) -> Kind | None:
    """Which of the two a file is by its brands (ISO/IEC 14496-12, ``ftyp``), or None."""
    if data[4:8] != b"ftyp":
        return None
    length = min(int.from_bytes(data[:4], "big"), _MAX_BRANDS)
    # The major brand, a version, and the brands that it is compatible with.
    brands = [data[8:12], *(data[at : at + 4] for at in range(16, length, 4))]
    if any(brand in _AVIF for brand in brands):
        return "avif"
    return "heic" if any(brand in _HEIC for brand in brands) else None


def read_header(data: bytes, kind: Kind) -> Header | None:
    """Read the header; None for a file that is broken or cut short."""
    try:
        with _open(data, kind) as image:
            turned = image.getexif().get(_ORIENTATION, 1) in (5, 6, 7, 8)
            width, height = image.size[::-1] if turned else image.size
            return Header(width, height, getattr(image, "n_frames", 1))
    except _BROKEN:
        return None


def decode(data: bytes, kind: Kind) -> NDArray[np.uint8] | None:
    """Decode the picture, upright.

    Returns:
        (h, w, 4) RGBA or (h, w, 3) RGB; None for a file that is broken.
    """
    try:
        with _open(data, kind) as image:
            image.load()
            upright = ImageOps.exif_transpose(image)
            return np.asarray(upright.convert("RGBA" if upright.has_transparency_data else "RGB"))
    except _BROKEN:
        return None


_ORIENTATION = 0x0112
_BROKEN = (OSError, ValueError, RuntimeError, SyntaxError, EOFError, MemoryError)
"""What Pillow and its plugins raise for files that are not what they seem."""


def _open(data: bytes, kind: Kind) -> Image.Image:
    return Image.open(io.BytesIO(data), formats=[_PILLOW[kind]])
