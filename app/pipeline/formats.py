"""Image files for enrolment: what their headers say, read before anything is decoded.

Formats: JPEG (ITU-T T.81), PNG (ISO/IEC 15948), WebP (RFC 9649), HEIC (ISO/IEC 23008-12) and AVIF;
EXIF orientation (CIPA DC-008, tag 0x0112) from any of them.
"""

import re
import struct
from typing import Literal, NamedTuple

from app.errors import Unreadable
from app.pipeline import heif

MAX_WORK = 400_000_000
"""Pixels times scans of a JPEG. Progressive files with hundreds of scans can keep a decoder busy
for seconds; cameras write one scan and web tools about ten."""

_PNG = b"\x89PNG\r\n\x1a\n"
_MARKER = re.compile(rb"\xff+([\x01-\xcf\xd8-\xfe])")


class ImageInfo(NamedTuple):
    """What a file's header says.

    Attributes:
        kind: ``jpeg``, ``png``, ``webp``, ``heic`` or ``avif``.
        width: Pixels as stored.
        height: Pixels as stored.
        orientation: EXIF orientation, 1 to 8; 1 is upright.
        components: Of a JPEG: 1 is grey, 3 is colour.
    """

    kind: Literal["jpeg", "png", "webp", "heic", "avif"]
    width: int
    height: int
    orientation: int = 1
    components: int = 3


def read_info(data: bytes) -> ImageInfo:
    """Read a file's header.

    Raises:
        Unreadable: empty, of another format, cut short or broken.
    """
    if not data:
        raise Unreadable("the file is empty: a JPEG, PNG, WebP, HEIC or AVIF picture is needed")
    try:
        if data[:2] == b"\xff\xd8":
            return _jpeg(data)
        if data[:8] == _PNG:
            return _png(data)
        if data[:4] == b"RIFF" and data[8:12] == b"WEBP":
            return _webp(data)
        if (kind := heif.kind_of(data)) is not None:
            return _heif(data, kind)
    except (IndexError, struct.error):
        raise cut_short() from None
    raise Unreadable("not a picture that can be read: JPEG, PNG, WebP, HEIC or AVIF is needed")


def cut_short() -> Unreadable:
    """The error for a file that ends too early."""
    return Unreadable("the picture is cut short or broken: please save it again")


def _jpeg(data: bytes) -> ImageInfo:
    size: tuple[int, int, int] | None = None
    orientation, scans, at = 1, 0, 2
    while True:
        found = _MARKER.search(data, at)
        if found is None:
            raise cut_short()
        marker, at = found[1][0], found.end()
        if marker == 0xD9:
            break
        if marker in (0x01, 0xD8):
            continue
        length = struct.unpack_from(">H", data, at)[0]
        if length < 2 or at + length > len(data):
            raise cut_short()
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width, components = struct.unpack_from(">HHB", data, at + 3)
            if size is not None or marker > 0xC2:
                raise Unreadable("a JPEG of a rare kind: baseline or progressive is needed")
            size = (width, height, components)
        elif marker == 0xE1 and data[at + 2 : at + 8] == b"Exif\0\0":
            orientation = _exif_orientation(data[at + 8 : at + length])
        elif marker == 0xDA:
            scans += 1
        at += length
    if size is None or scans == 0:
        raise cut_short()
    if size[2] not in (1, 3):
        raise Unreadable(
            f"a JPEG with {size[2]} colour components: 1 (grey) or 3 (colour) are needed"
        )
    if size[0] * size[1] * scans > MAX_WORK:
        raise Unreadable(
            f"a JPEG of {size[0]}x{size[1]} in {scans} scans takes too long to decode: "
            "please save it smaller, or as baseline"
        )
    return ImageInfo("jpeg", size[0], size[1], orientation, size[2])


def _png(data: bytes) -> ImageInfo:
    if data[12:16] != b"IHDR":
        raise cut_short()
    width, height = struct.unpack_from(">II", data, 16)
    orientation, at = 1, 8
    while True:
        length, kind = struct.unpack_from(">I4s", data, at)
        if at + 12 + length > len(data):
            raise cut_short()
        if kind == b"eXIf":
            orientation = _exif_orientation(data[at + 8 : at + 8 + length])
        if kind == b"IEND":
            return ImageInfo("png", width, height, orientation)
        at += 12 + length


def _webp(data: bytes) -> ImageInfo:
    if 8 + int(struct.unpack_from("<I", data, 4)[0]) > len(data) + 1:
        raise cut_short()
    sizes: list[tuple[int, ...]] = []
    orientation, at = 1, 12
    while at + 8 <= len(data):
        kind, length = struct.unpack_from("<4sI", data, at)
        body = data[at + 8 : at + 8 + length]
        if len(body) < length:
            raise cut_short()
        if kind == b"VP8X":
            if body[0] & 0x02:
                raise Unreadable("an animated WebP: a single picture is needed")
            sizes.append(
                (1 + int.from_bytes(body[4:7], "little"), 1 + int.from_bytes(body[7:10], "little"))
            )
        elif kind == b"VP8 ":
            sizes.append(tuple(side & 0x3FFF for side in struct.unpack_from("<HH", body, 6)))
        elif kind == b"VP8L":
            bits = struct.unpack_from("<I", body, 1)[0]
            sizes.append((1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)))
        elif kind == b"EXIF":
            orientation = _exif_orientation(body.removeprefix(b"Exif\0\0"))
        at += 8 + length + (length & 1)
    # Which of several pictures a decoder takes is its own affair: the largest counts.
    width, height = (max(sides) for sides in zip(*sizes, strict=True)) if sizes else (0, 0)
    if width == 0 or height == 0:
        raise cut_short()
    return ImageInfo("webp", width, height, orientation)


def _heif(data: bytes, kind: heif.Kind) -> ImageInfo:
    header = heif.read_header(data, kind)
    if header is None:
        raise cut_short()
    if header.pictures > 1 and kind == "avif":
        raise Unreadable("an animated AVIF: a single picture is needed")
    return ImageInfo(kind, header.width, header.height)


def _exif_orientation(tiff: bytes) -> int:
    """Orientation of a TIFF header's first directory; 1 when it says nothing sensible."""
    order = {b"II": "<", b"MM": ">"}.get(tiff[:2])
    if order is None or len(tiff) < 10:
        return 1
    try:
        start = struct.unpack_from(order + "I", tiff, 4)[0]
        entries = struct.unpack_from(order + "H", tiff, start)[0]
        for entry in range(entries):
            tag, _, _, value = struct.unpack_from(order + "HHIH", tiff, start + 2 + 12 * entry)
            if tag == 0x0112:
                return value if 1 <= value <= 8 else 1
    except struct.error:
        pass
    return 1
