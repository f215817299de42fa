"""Decode: a JPEG's header is judged first, and only then is it decoded, at working size."""

import re
from typing import NamedTuple

import cv2
import numpy as np
import simplejpeg

from app.config import DecodeSettings
from app.errors import FrameRefused
from app.pipeline.types import U8

MIN_SIDE = 16
"""Pixels. A frame with a shorter side cannot show a hand."""

_STANDALONE = frozenset((0x01, *range(0xD0, 0xD8)))
"""Markers without a length: TEM and RST0 to RST7 (ITU-T T.81, table B.1)."""
_SOF = {
    0xC0: "baseline",
    0xC1: "extended sequential",
    0xC2: "progressive",
    0xC3: "lossless",
    0xC5: "hierarchical",
    0xC6: "hierarchical progressive",
    0xC7: "hierarchical lossless",
    0xC9: "arithmetic-coded",
    0xCA: "arithmetic-coded progressive",
    0xCB: "arithmetic-coded lossless",
    0xCD: "arithmetic-coded hierarchical",
    0xCE: "arithmetic-coded hierarchical progressive",
    0xCF: "arithmetic-coded hierarchical lossless",
}
_NEXT_MARKER = re.compile(rb"\xff+([\x01-\xcf\xd8-\xfe])")
"""What ends entropy-coded data: not a stuffed FF00 and not RST0 to RST7 (T.81, B.1.1.5)."""


class JpegHeader(NamedTuple):
    """What a JPEG says of itself. ``end`` is the offset after its EOI marker."""

    width: int
    height: int
    components: int
    end: int


class Decoded(NamedTuple):
    """A picture at working size.

    Attributes:
        pixels: (h, w, 3) BGR, or (h, w, 1) when the JPEG is grey. A buffer: the next call
            overwrites it.
        width: Of the frame as sent, pixels.
        height: Of the frame as sent, pixels.
    """

    pixels: U8
    width: int
    height: int


def _broken(why: str) -> FrameRefused:
    return FrameRefused(f"the JPEG is broken: {why}", code="frame_broken")


def _cut_short() -> FrameRefused:
    return FrameRefused(
        "the JPEG is cut short: its end marker (FFD9) is missing", code="frame_cut_short"
    )


def read_header(data: bytes) -> JpegHeader:
    """Read a JPEG's markers (ITU-T T.81, annex B) without decoding anything.

    Only baseline files (SOF0) with one interleaved scan pass. Progressive files, and baseline
    files with many scans, can take a decoder seconds at a few hundred KB; no browser's
    ``canvas.toBlob`` writes them.

    Raises:
        FrameRefused: ``frame_empty``, ``frame_not_jpeg``, ``frame_not_baseline``,
            ``frame_cut_short`` or ``frame_broken``.
    """
    if not data:
        raise FrameRefused("the frame is empty: a JPEG was expected", code="frame_empty")
    if data[:2] != b"\xff\xd8":
        raise FrameRefused(
            f"not a JPEG: it starts with {bytes(data[:2]).hex()} where ffd8 was expected",
            code="frame_not_jpeg",
        )
    size: tuple[int, int, int] | None = None
    at, n = 2, len(data)
    while True:
        if at >= n:
            raise _cut_short()
        if data[at] != 0xFF:
            raise _broken(f"no marker at byte {at}")
        while at < n and data[at] == 0xFF:
            at += 1
        if at >= n:
            raise _cut_short()
        marker = data[at]
        at += 1
        if marker in _STANDALONE:
            continue
        if marker in (0x00, 0xD8, 0xD9):
            raise _broken(f"marker FF{marker:02X} before any picture")
        if at + 2 > n:
            raise _cut_short()
        length = int.from_bytes(data[at : at + 2], "big")
        if length < 2:
            raise _broken(f"segment FF{marker:02X} of length {length}")
        if at + length > n:
            raise _cut_short()
        if marker in _SOF:
            if marker != 0xC0:
                raise FrameRefused(
                    f"{_SOF[marker]} JPEG: only baseline JPEG is accepted",
                    code="frame_not_baseline",
                    kind=_SOF[marker],
                )
            if size is not None:
                raise _broken("two frame headers")
            if length < 8 or length != 8 + 3 * data[at + 7]:
                raise _broken("frame header of wrong length")
            if data[at + 2] != 8:
                raise _broken(f"{data[at + 2]} bits a sample where 8 were expected")
            components = data[at + 7]
            if components not in (1, 3):
                raise _broken(f"{components} colour components where 1 or 3 were expected")
            height = int.from_bytes(data[at + 3 : at + 5], "big")
            width = int.from_bytes(data[at + 5 : at + 7], "big")
            size = (width, height, components)
        elif marker == 0xDA:
            if size is None:
                raise _broken("a scan before the frame header")
            if data[at + 2] != size[2]:
                raise FrameRefused(
                    "JPEG with more than one scan: only baseline JPEG with one is accepted",
                    code="frame_not_baseline",
                    kind="several scans",
                )
            at += length
            break
        at += length
    found = _NEXT_MARKER.search(data, at)
    if found is None:
        raise _cut_short()
    if found[1] != b"\xd9":
        raise _broken(f"marker FF{found[1].hex().upper()} inside the picture's data")
    return JpegHeader(*size, end=found.end())


def read_within(jpeg: bytes, limits: DecodeSettings) -> JpegHeader:
    """Read the header of a frame, if the frame may be decoded.

    Raises:
        FrameRefused: see :func:`read_header`; also ``frame_too_large`` (bytes or pixels).
    """
    if len(jpeg) > limits.max_bytes:
        raise FrameRefused(
            f"the frame has {len(jpeg)} bytes: at most {limits.max_bytes} are accepted",
            code="frame_too_large",
            bytes=len(jpeg),
            max_bytes=limits.max_bytes,
        )
    header = read_header(jpeg)
    if header.width > limits.max_width or header.height > limits.max_height:
        raise FrameRefused(
            f"the frame is {header.width}x{header.height}: "
            f"at most {limits.max_width}x{limits.max_height} is accepted",
            code="frame_too_large",
            width=header.width,
            height=header.height,
        )
    return header


class Decode:
    """JPEG to 8-bit pixels at working size; refuses by header, before decoding.

    The decoder's own scaling (discrete cosine transform of 4x4 or 2x2 in place of 8x8; libjpeg) is
    used: 640x480 is decoded straight to 320x240, which holds all the chroma that 4:2:0 carries.
    """

    def __init__(self, settings: DecodeSettings) -> None:
        self._settings = settings
        self._buffer: U8 = np.empty(0, np.uint8)

    def __call__(self, jpeg: bytes) -> Decoded:
        """Decode one frame.

        Raises:
            FrameRefused: see :func:`read_within`; also ``frame_too_small``.
        """
        header = read_within(jpeg, self._settings)
        width, height = header.width, header.height
        if min(width, height) < MIN_SIDE:
            raise FrameRefused(
                f"the frame is {width}x{height}: at least {MIN_SIDE}x{MIN_SIDE} is needed",
                code="frame_too_small",
                width=width,
                height=height,
            )
        return Decoded(self._decode(jpeg[: header.end], header), width, height)

    def _decode(self, jpeg: bytes, header: JpegHeader) -> U8:
        factor = 1
        while factor < 8 and min(header.width, header.height) // (2 * factor) >= (
            self._settings.working_side
        ):
            factor *= 2
        # libjpeg rounds scaled sizes up.
        height, width = -(-header.height // factor), -(-header.width // factor)
        shape = (height, width, header.components)
        if self._buffer.shape != shape:
            self._buffer = np.empty(shape, np.uint8)
        try:
            pixels: U8 = simplejpeg.decode_jpeg(
                jpeg,
                "BGR" if header.components == 3 else "GRAY",
                fastdct=True,
                fastupsample=True,
                min_height=height,
                min_width=width,
                min_factor=factor,
                buffer=self._buffer,
                strict=True,
            )
        except (ValueError, RuntimeError, MemoryError) as error:
            raise _broken(str(error)) from None
        if pixels.shape != shape:
            return cv2.resize(pixels, (width, height)).reshape(shape).astype(np.uint8)
        return pixels
