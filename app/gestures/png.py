"""Templates as one-bit PNG files, exact in both directions.

Only what the exchange format allows is read: 60x80, one bit, greyscale, not interlaced. Written
out here in full, because image libraries read anything and turn it into something.
Source: PNG specification, third edition (W3C, 2025), sections 5, 7.3, 9 and 11.2.
"""

import struct
import zlib
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from app.errors import Invalid
from app.gestures.records import TEMPLATE_BYTES, TEMPLATE_HEIGHT, TEMPLATE_WIDTH

SIGNATURE = b"\x89PNG\r\n\x1a\n"
PNG_MAX_BYTES = 16 * 1024
"""A template's file has about 300 bytes; the rest is room for remarks of other programs."""
_HEADER = struct.pack(">IIBBBBB", TEMPLATE_WIDTH, TEMPLATE_HEIGHT, 1, 0, 0, 0, 0)
_ROW = (TEMPLATE_WIDTH + 7) // 8
"""8 bytes; the last four bits of a row are not used."""


def template_png(template: bytes) -> bytes:
    """A template as a PNG file: 60x80, one bit, the hand white.

    Args:
        template: 600 bytes.

    Returns:
        The same bytes for the same template, always.

    Raises:
        Invalid: not 600 bytes.
    """
    if len(template) != TEMPLATE_BYTES:
        raise Invalid(f"a template has {TEMPLATE_BYTES} bytes, not {len(template)}")
    pixels = np.unpackbits(np.frombuffer(template, np.uint8)).reshape(-1, TEMPLATE_WIDTH)
    rows = np.zeros((TEMPLATE_HEIGHT, 1 + _ROW), np.uint8)
    rows[:, 1:] = np.packbits(pixels, axis=1)
    data = zlib.compress(rows.tobytes(), 9)
    return SIGNATURE + _chunk(b"IHDR", _HEADER) + _chunk(b"IDAT", data) + _chunk(b"IEND", b"")


def read_template(data: bytes) -> bytes:
    """The template in a PNG file.

    Returns:
        600 bytes.

    Raises:
        Invalid: not a PNG, damaged, of another size, or not one bit a pixel.
    """
    if len(data) > PNG_MAX_BYTES:
        raise Invalid(f"has {len(data)} bytes; a template has at most {PNG_MAX_BYTES}")
    packed = b""
    for number, (kind, body) in enumerate(_chunks(data)):
        if (number == 0) != (kind == b"IHDR"):
            raise Invalid("is a damaged PNG: its header is not where it belongs")
        if kind == b"IHDR":
            _check_header(body)
        elif kind == b"IDAT":
            packed += body
        elif kind[0] & 0x20 == 0 and kind not in (b"IEND", b"PLTE"):
            raise Invalid(f"is a PNG with an unknown part {kind!r}")
    return _pixels(packed)


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    if not data.startswith(SIGNATURE):
        raise Invalid("is not a PNG file")
    position, kind = len(SIGNATURE), b""
    while kind != b"IEND":
        head = data[position : position + 8]
        length = int.from_bytes(head[:4], "big")
        kind, end = head[4:], position + 8 + length
        if len(head) < 8 or len(data) < end + 4:
            raise Invalid("is a PNG that was cut short")
        if zlib.crc32(data[position + 4 : end]) != int.from_bytes(data[end : end + 4], "big"):
            raise Invalid(f"is a damaged PNG: wrong checksum of {kind!r}")
        yield kind, data[position + 8 : end]
        position = end + 4
    if position != len(data):
        raise Invalid(f"has {len(data) - position} bytes after the end of the PNG")


def _check_header(body: bytes) -> None:
    if len(body) != 13:
        raise Invalid("is a damaged PNG: its header has a wrong length")
    width, height, depth, colour, compression, filtering, interlace = struct.unpack(
        ">IIBBBBB", body
    )
    if (width, height) != (TEMPLATE_WIDTH, TEMPLATE_HEIGHT):
        raise Invalid(
            f"is {width}x{height} pixels; a template is {TEMPLATE_WIDTH}x{TEMPLATE_HEIGHT}"
        )
    if (depth, colour) != (1, 0):
        kind = {0: "greyscale", 2: "RGB", 3: "palette", 4: "grey and alpha", 6: "RGBA"}
        raise Invalid(
            f"has {depth} bits a pixel ({kind.get(colour, f'colour type {colour}')}); a template "
            "has one bit, greyscale"
        )
    if (compression, filtering, interlace) != (0, 0, 0):
        raise Invalid("is an interlaced PNG; a template is not interlaced")


def _pixels(packed: bytes) -> bytes:
    expected = TEMPLATE_HEIGHT * (1 + _ROW)
    inflater = zlib.decompressobj()
    try:
        raw = inflater.decompress(packed, expected + 1)
    except zlib.error as error:
        raise Invalid("is a damaged PNG: its pixels cannot be unpacked") from error
    if len(raw) != expected or not inflater.eof:
        raise Invalid("is a damaged PNG: too few or too many pixels")
    rows = np.frombuffer(raw, np.uint8).reshape(TEMPLATE_HEIGHT, 1 + _ROW)
    above = np.zeros(_ROW, np.uint8)
    bits: list[NDArray[np.uint8]] = []
    for row in rows:
        above = _unfilter(int(row[0]), row[1:], above)
        bits.append(np.unpackbits(above)[:TEMPLATE_WIDTH])
    return np.packbits(np.concatenate(bits)).tobytes()


def _unfilter(kind: int, row: NDArray[np.uint8], above: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """One row without its filter (PNG section 9); neighbours are whole bytes at one bit a pixel."""
    if kind == 0:
        return row
    if kind > 4:
        raise Invalid(f"is a damaged PNG: unknown row filter {kind}")
    out = np.zeros_like(row)
    left = corner = 0
    for x in range(_ROW):
        up = int(above[x])
        out[x] = (
            int(row[x]) + (0, left, up, (left + up) // 2, _paeth(left, up, corner))[kind]
        ) % 256
        left, corner = int(out[x]), up
    return out


def _paeth(left: int, up: int, corner: int) -> int:
    guess = left + up - corner
    return min((left, up, corner), key=lambda value: abs(guess - value))
