import struct
import zlib

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.errors import Invalid
from app.gestures.png import SIGNATURE, read_template, template_png
from tests.gestures.conftest import template


@given(st.binary(min_size=600, max_size=600))
def test_every_template_survives(data: bytes) -> None:
    assert read_template(template_png(data)) == data


def test_other_programs_see_the_same_pixels() -> None:
    data = template(3)
    pixels = cv2.imdecode(np.frombuffer(template_png(data), np.uint8), cv2.IMREAD_UNCHANGED)
    expected = np.unpackbits(np.frombuffer(data, np.uint8)).reshape(80, 60) * 255
    np.testing.assert_array_equal(pixels, expected)


@pytest.mark.parametrize("strategy", range(5))
def test_files_of_other_programs_are_read(strategy: int) -> None:
    """OpenCV writes one-bit PNGs with any of PNG's row filters, too."""
    pixels = np.unpackbits(np.frombuffer(template(4), np.uint8)).reshape(80, 60) * 255
    options = [cv2.IMWRITE_PNG_BILEVEL, 1, cv2.IMWRITE_PNG_STRATEGY, strategy]
    data = cv2.imencode(".png", pixels, options)[1].tobytes()
    assert read_template(data) == template(4)


@pytest.mark.parametrize("kind", range(5))
def test_every_row_filter_is_undone(kind: int) -> None:
    generator = np.random.default_rng(kind)
    rows = generator.integers(0, 256, (80, 8), dtype=np.uint8)
    rows[:, 7] &= 0xF0
    above = np.vstack([np.zeros((1, 8), np.uint8), rows[:-1]]).astype(int)
    left = np.hstack([np.zeros((80, 1), np.uint8), rows[:, :-1]]).astype(int)
    corner = np.hstack([np.zeros((80, 1), int), above[:, :-1]])
    guess = left + above - corner
    off = np.abs(np.stack([left, above, corner]) - guess)
    paeth = np.choose(np.argmin(off, axis=0), [left, above, corner])
    guesses = [np.zeros_like(left), left, above, (left + above) // 2, paeth]
    filtered = ((rows.astype(int) - guesses[kind]) % 256).astype(np.uint8)
    body = np.hstack([np.full((80, 1), kind, np.uint8), filtered]).tobytes()
    pixels = np.unpackbits(rows, axis=1)[:, :60]
    assert read_template(_png(body=body)) == np.packbits(pixels).tobytes()


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def _png(
    width: int = 60,
    height: int = 80,
    depth: int = 1,
    colour: int = 0,
    interlace: int = 0,
    body: bytes = bytes(80 * 9),
) -> bytes:
    header = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, interlace)
    parts = ((b"IHDR", header), (b"IDAT", zlib.compress(body)), (b"IEND", b""))
    return SIGNATURE + b"".join(_chunk(kind, part) for kind, part in parts)


GOOD = template_png(template())


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "is not a PNG file"),
        (b"GIF89a", "is not a PNG file"),
        (GOOD[:40], "is a PNG that was cut short"),
        (GOOD[:-1], "is a PNG that was cut short"),
        (GOOD + b"!", "has 1 bytes after the end of the PNG"),
        (GOOD[:45] + b"\0\0" + GOOD[47:], "is a damaged PNG: wrong checksum of b'IDAT'"),
        (_png(width=80, height=60), "is 80x60 pixels; a template is 60x80"),
        (_png(depth=8), "has 8 bits a pixel (greyscale); a template has one bit, greyscale"),
        (_png(depth=8, colour=6), "has 8 bits a pixel (RGBA); a template has one bit, greyscale"),
        (
            _png(depth=1, colour=3),
            "has 1 bits a pixel (palette); a template has one bit, greyscale",
        ),
        (_png(interlace=1), "is an interlaced PNG; a template is not interlaced"),
        (_png(body=bytes(9)), "is a damaged PNG: too few or too many pixels"),
        (_png(body=bytes(1 << 20)), "is a damaged PNG: too few or too many pixels"),
        (_png(body=b"\x09" * 720), "is a damaged PNG: unknown row filter 9"),
        (GOOD + bytes(1 << 15), "has 33001 bytes; a template has at most 16384"),
    ],
)
def test_anything_else_is_refused(data: bytes, message: str) -> None:
    with pytest.raises(Invalid) as caught:
        read_template(data)
    if message.endswith("at most 16384"):
        message = message.replace("33001", str(len(data)))
    assert caught.value.message == message


def test_a_wrong_length_is_not_written() -> None:
    with pytest.raises(Invalid, match="a template has 600 bytes, not 3"):
        template_png(b"abc")


@given(st.integers(0, len(GOOD) - 1), st.integers(1, 255))
def test_no_flipped_byte_goes_unnoticed(place: int, change: int) -> None:
    data = bytearray(GOOD)
    data[place] ^= change
    with pytest.raises(Invalid):
        read_template(bytes(data))
