"""Pictures that are not what they should be, for the fuzz: any size and kind, broken in any way.

``mutated(seed, number)`` is always the same file. A kind of picture, a way to save it and a number
of mutations are drawn at random; about one file in four is left whole.
"""

import io
import struct
import zlib
from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

U8 = NDArray[np.uint8]
Rng = np.random.Generator
SIZES = (
    *((1, 1), (1, 300), (300, 1), (2, 2), (15, 15), (16, 16), (17, 16), (31, 40), (32, 32)),
    *((33, 32), (48, 64), (101, 99), (1281, 720), (2000, 32), (32, 2000), (4000, 40), (16, 1280)),
    *((16000, 33), (65500, 1), (1, 65500), (65000, 32)),
)
USUAL = ((100, 100), (160, 120), (320, 240), (640, 480), (480, 640), (1280, 720), (720, 1280))
LARGE = ((4000, 3000), (6000, 4000), (8000, 8000))


class Mutated(NamedTuple):
    """A file for the fuzz; ``story`` says how it was made."""

    data: bytes
    story: str


def mutated(seed: int, number: int, large: bool = True) -> Mutated:
    """File ``number`` of the series ``seed``; ``large`` allows some of many million pixels."""
    rng = np.random.default_rng((seed, number))
    if rng.random() < 0.03:
        return _nothing(rng)
    size = SIZES[rng.integers(len(SIZES))]
    kind = rng.random()
    if kind < 0.4:
        size = USUAL[rng.integers(len(USUAL))]
    elif kind < 0.6:
        size = (int(rng.integers(1, 900)), int(rng.integers(1, 900)))
    if large and rng.random() < 0.01:
        size = LARGE[rng.integers(len(LARGE))]
    draw = PICTURES[rng.integers(len(PICTURES))]
    save = SAVERS[rng.integers(len(SAVERS))]
    data = save(draw(*size, rng), rng)
    story = [f"{draw.__name__} {size[0]}x{size[1]}", save.__name__]
    for _ in range(int(rng.choice(4, p=(0.25, 0.45, 0.2, 0.1)))):
        mutate = MUTATIONS[rng.integers(len(MUTATIONS))]
        data = mutate(data, rng)
        story.append(mutate.__name__)
    return Mutated(data, ", ".join(name.strip("_") for name in story))


def _nothing(rng: Rng) -> Mutated:
    starts = (
        b"",
        b"\xff\xd8",
        b"\xff\xd8\xff",
        b"\x89PNG\r\n\x1a\n",
        b"RIFF\xff\0\0\0WEBP",
        b"GIF89a",
    )
    start = starts[rng.integers(len(starts))]
    count = int(rng.choice((0, 1, 20, 3000)))
    return Mutated(start + rng.bytes(count), f"{start!r} and {count} bytes of noise")


# Pictures: (width, height, rng) to (height, width, 3), BGR.


def hand(width: int, height: int, rng: Rng) -> U8:
    """A palm, fingers and an arm on one of several walls; light or dark."""
    wall = (flat, room, flat, gradient)[rng.integers(4)]
    picture = wall(width, height, rng)
    colour = tuple(int(c) for c in np.array((110, 140, 200)) * rng.uniform(0.3, 1.2))
    unit = min(width, height) * rng.uniform(0.3, 1.1)
    x, y = width * rng.uniform(0.3, 0.7), height * rng.uniform(0.4, 0.7)
    cv2.circle(picture, (round(x), round(y)), max(1, round(unit * 0.16)), colour, -1)
    ends = ((x, height), (0, y), (width, y), (x, 0))
    end = ends[rng.integers(4)]
    cv2.line(picture, _at(x, y), _at(*end), colour, max(1, round(unit * 0.2)))
    for angle in rng.uniform(-3, 0, int(rng.integers(6))):
        tip = x + unit * 0.4 * np.cos(angle), y + unit * 0.4 * np.sin(angle)
        cv2.line(picture, _at(x, y), _at(*tip), colour, max(1, round(unit * 0.06)))
    return picture


def _at(x: float, y: float) -> tuple[int, int]:
    return round(x), round(y)


def room(width: int, height: int, rng: Rng) -> U8:
    """Boxes of any colour: an empty room."""
    picture = flat(width, height, rng)
    for _ in range(12):
        (x0, x1), (y0, y1) = rng.integers(0, width + 1, 2), rng.integers(0, height + 1, 2)
        colour = tuple(int(c) for c in rng.integers(0, 256, 3))
        cv2.rectangle(picture, (int(x0), int(y0)), (int(x1), int(y1)), colour, -1)
    return picture


def flat(width: int, height: int, rng: Rng) -> U8:
    """One colour."""
    picture = np.empty((height, width, 3), np.uint8)
    picture[:] = rng.choice((0, 255, 128, int(rng.integers(256))), 3 if rng.random() < 0.5 else 1)
    return picture


def gradient(width: int, height: int, rng: Rng) -> U8:
    """From one colour to another, downwards."""
    ends = rng.integers(0, 256, (2, 3))
    line = ends[0] + (ends[1] - ends[0]) * np.linspace(0, 1, height)[:, None]
    return np.repeat(line[:, None].astype(np.uint8), width, axis=1)


def noise(width: int, height: int, rng: Rng) -> U8:
    """Every pixel at random, in a tile that repeats."""
    tile = rng.integers(0, 256, (min(height, 300), min(width, 300), 3), np.uint8)
    times = (-(-height // tile.shape[0]), -(-width // tile.shape[1]), 1)
    return np.ascontiguousarray(np.tile(tile, times)[:height, :width])


def checkers(width: int, height: int, rng: Rng) -> U8:
    """Fields of 1 to 40 pixels, black and white."""
    field = int(rng.integers(1, 41))
    odd = (np.arange(height)[:, None] // field + np.arange(width) // field) % 2
    return np.repeat((odd * 255).astype(np.uint8)[..., None], 3, axis=2)


PICTURES: tuple[Callable[[int, int, Rng], U8], ...] = (
    *(hand, hand, hand, hand, room, room, flat, gradient, noise, checkers),
)


# Ways to save: (picture, rng) to bytes.


def _saved(image: Image.Image, kind: str, **options: object) -> bytes:
    out = io.BytesIO()
    try:
        image.save(out, kind, **options)
    except (OSError, ValueError, RuntimeError):
        # Too wide for the format; noise without end in a buffer that Pillow sizes by guess.
        out = io.BytesIO()
        image.resize((64, 48)).save(out, kind)
    return out.getvalue()


def _rgb(picture: U8) -> Image.Image:
    return Image.fromarray(picture[:, :, ::-1])


def _exif(rng: Rng) -> bytes:
    tags = Image.Exif()
    tags[0x0112] = int(rng.choice((*range(1, 9), *range(1, 9), 0, 9, 65535)))
    tags[0x010F] = "camera"
    return tags.tobytes()


def jpeg(picture: U8, rng: Rng) -> bytes:
    """Baseline, any quality and sampling."""
    return _saved(
        _rgb(picture),
        "JPEG",
        quality=int(rng.integers(1, 100)),
        subsampling=int(rng.integers(3)),
        restart_marker_rows=int(rng.integers(2)),
    )


def jpeg_turned(picture: U8, rng: Rng) -> bytes:
    """With an EXIF orientation."""
    return _saved(_rgb(picture), "JPEG", exif=_exif(rng), progressive=bool(rng.integers(2)))


def jpeg_progressive(picture: U8, rng: Rng) -> bytes:
    """Progressive."""
    return _saved(_rgb(picture), "JPEG", progressive=True, quality=int(rng.integers(5, 96)))


def jpeg_grey(picture: U8, rng: Rng) -> bytes:
    """One component."""
    return _saved(_rgb(picture).convert("L"), "JPEG", progressive=bool(rng.integers(2)))


def jpeg_cmyk(picture: U8, rng: Rng) -> bytes:
    """Four components."""
    return _saved(_rgb(picture).convert("CMYK"), "JPEG")


def png(picture: U8, rng: Rng) -> bytes:
    """Any of Pillow's 8-bit modes."""
    mode = ("RGB", "RGBA", "L", "LA", "P", "1")[rng.integers(6)]
    image = _rgb(picture).convert(mode)
    if mode in ("RGBA", "LA"):
        image.putalpha(int(rng.integers(256)))
    options = {"exif": _exif(rng)} if rng.random() < 0.4 else {}
    return _saved(image, "PNG", compress_level=1, **options)


def png_16(picture: U8, rng: Rng) -> bytes:
    """16 bits a channel; grey, colour, or colour with alpha."""
    deep = picture.astype(np.uint16) * 257
    kind = int(rng.integers(3))
    if kind == 0:
        deep = np.ascontiguousarray(deep[:, :, 0])
    elif kind == 1:
        deep = np.dstack([deep, deep[:, :, 0]])
    return cv2.imencode(".png", deep, (cv2.IMWRITE_PNG_COMPRESSION, 1))[1].tobytes()


def png_animated(picture: U8, rng: Rng) -> bytes:
    """Two pictures in one file (APNG)."""
    image = _rgb(picture)
    return _saved(image, "PNG", save_all=True, append_images=[image.rotate(180)], compress_level=1)


def webp(picture: U8, rng: Rng) -> bytes:
    """Lossy or not, with or without alpha and EXIF."""
    image = _rgb(picture)
    if rng.random() < 0.3:
        image.putalpha(int(rng.integers(256)))
    options = {"exif": _exif(rng)} if rng.random() < 0.4 else {}
    return _saved(image, "WEBP", lossless=bool(rng.integers(2)), method=0, **options)


def webp_animated(picture: U8, rng: Rng) -> bytes:
    """Two pictures in one file."""
    image = _rgb(picture)
    return _saved(image, "WEBP", save_all=True, append_images=[image.rotate(180)], method=0)


def another_format(picture: U8, rng: Rng) -> bytes:
    """What other programs write."""
    return _saved(_rgb(picture), ("GIF", "BMP", "TIFF", "PPM", "ICO")[rng.integers(5)])


SAVERS: tuple[Callable[[U8, Rng], bytes], ...] = (
    *(jpeg, jpeg, jpeg, jpeg, jpeg_turned, jpeg_turned, jpeg_progressive, jpeg_grey, jpeg_cmyk),
    *(png, png, png_16, png_animated, webp, webp, webp_animated, another_format),
)


# Mutations: (data, rng) to bytes.


def cut(data: bytes, rng: Rng) -> bytes:
    """Truncated anywhere."""
    return data[: int(rng.integers(len(data) + 1))]


def cut_and_closed(data: bytes, rng: Rng) -> bytes:
    """Truncated, with a JPEG's end marker behind it."""
    return cut(data, rng) + b"\xff\xd9"


def flip_bits(data: bytes, rng: Rng) -> bytes:
    """1 to 30 bits anywhere."""
    out = bytearray(data)
    for at in rng.integers(0, max(len(out), 1), int(rng.integers(1, 31))) if out else ():
        out[at] ^= 1 << int(rng.integers(8))
    return bytes(out)


def flip_header(data: bytes, rng: Rng) -> bytes:
    """1 to 5 bytes of the first 700."""
    out = bytearray(data)
    for at in rng.integers(0, max(min(len(out), 700), 1), int(rng.integers(1, 6))) if out else ():
        out[at] = int(rng.choice((0, 255, 127, 128, int(rng.integers(256)))))
    return bytes(out)


def lie(data: bytes, rng: Rng) -> bytes:
    """Another width and height in the header, check sum and all."""
    sides = (0, 1, 16, 31, 32, 100, 5000, 16383, 65535)
    width, height = int(rng.choice(sides)), int(rng.choice(sides))
    if data[:8] == b"\x89PNG\r\n\x1a\n" and len(data) > 33:
        factor = int(rng.choice((1, 1, 1 << 14)))
        head = b"IHDR" + struct.pack(">II", width * factor, height * factor) + data[24:29]
        return data[:12] + head + struct.pack(">I", zlib.crc32(head)) + data[33:]
    if data[8:16] == b"WEBPVP8X":
        canvas = [(max(side, 1) - 1).to_bytes(3, "little") for side in (width, height)]
        return data[:24] + b"".join(canvas) + data[30:]
    if data[8:16] == b"WEBPVP8 ":
        return data[:26] + struct.pack("<HH", width & 0x3FFF, height & 0x3FFF) + data[30:]
    for marker in (b"\xff\xc0", b"\xff\xc2"):
        at = data.find(marker)
        if data[:2] == b"\xff\xd8" and at > 0:
            return data[: at + 5] + struct.pack(">HH", height, width) + data[at + 9 :]
    return flip_header(data, rng)


def drop(data: bytes, rng: Rng) -> bytes:
    """A piece is missing."""
    at = int(rng.integers(len(data) + 1))
    return data[:at] + data[at + int(rng.integers(1, 400)) :]


def repeat(data: bytes, rng: Rng) -> bytes:
    """A piece comes again and again."""
    a, b = sorted(int(i) for i in rng.integers(0, len(data) + 1, 2))
    return data[:b] + data[a:b][:20000] * int(rng.integers(1, 10)) + data[b:]


def insert_noise(data: bytes, rng: Rng) -> bytes:
    """Bytes in between."""
    at = int(rng.integers(len(data) + 1))
    return data[:at] + rng.bytes(int(rng.integers(1, 300))) + data[at:]


def zeros(data: bytes, rng: Rng) -> bytes:
    """A piece is zero, as where a disk failed."""
    at = int(rng.integers(len(data) + 1))
    count = min(int(rng.integers(1, 3000)), len(data) - at)
    return data[:at] + bytes(count) + data[at + count :]


def append(data: bytes, rng: Rng) -> bytes:
    """Bytes behind the end."""
    return data + (rng.bytes(int(rng.integers(1, 3000))) if rng.random() < 0.5 else data[:100000])


def many_scans(data: bytes, rng: Rng) -> bytes:
    """A JPEG's scans once more, up to 200 times and 2 MB."""
    at = data.find(b"\xff\xda")
    if data[:2] != b"\xff\xd8" or at < 0:
        return repeat(data, rng)
    scans = data[at:-2]
    times = min(int(rng.integers(1, 201)), 2_000_000 // max(len(scans), 1))
    return data[:at] + scans * (1 + times) + b"\xff\xd9"


MUTATIONS: tuple[Callable[[bytes, Rng], bytes], ...] = (
    *(cut, cut_and_closed, flip_bits, flip_bits, flip_header, flip_header, lie, lie, drop),
    *(repeat, insert_noise, zeros, append, many_scans),
)
