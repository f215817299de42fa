"""Pictures made smaller for slow links."""

import asyncio
import threading

import numpy as np
import pytest
import simplejpeg

from app.gateway import small_pictures as module
from app.gateway.picture_pace import LEVELS
from app.gateway.small_pictures import SmallPictures, smaller
from app.link.header import HEADER_SIZE, FrameHeader

SMALL = [number for number, level in enumerate(LEVELS) if level.quality is not None]


@pytest.fixture(scope="module")
def picture() -> bytes:
    """Header and JPEG, 320x240, of a smooth scene."""
    rows, columns = np.mgrid[0:240, 0:320]
    pixels = np.stack([rows, columns // 2, (rows + columns) // 3], axis=-1).astype(np.uint8)
    pixels[60:180, 100:200] = np.random.default_rng(1).integers(0, 255, (120, 100, 3), np.uint8)
    return FrameHeader(7, 1.5, 99).pack() + simplejpeg.encode_jpeg(
        pixels, quality=82, colorspace="RGB"
    )


def test_each_level_is_smaller_than_the_one_before_and_keeps_header_and_shape(
    picture: bytes,
) -> None:
    sizes = [len(picture)]
    for number in SMALL:
        made = smaller(picture, LEVELS[number])
        sizes.append(len(made))
        assert made[:HEADER_SIZE] == picture[:HEADER_SIZE]
        height, width, *_ = simplejpeg.decode_jpeg_header(made[HEADER_SIZE:])
        scale = LEVELS[number].scale
        assert (width, height) == (round(320 * scale), round(240 * scale))
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[-1] < sizes[0] / 5


def test_colours_stay(picture: bytes) -> None:
    before = simplejpeg.decode_jpeg(picture[HEADER_SIZE:])
    after = simplejpeg.decode_jpeg(smaller(picture, LEVELS[-1])[HEADER_SIZE:])
    assert after.mean((0, 1)) == pytest.approx(before.mean((0, 1)), abs=4)


@pytest.mark.parametrize("jpeg", [b"", b"jpeg", b"\xff\xd8" + bytes(100) + b"\xff\xd9"])
def test_what_cannot_be_read_stays_as_it_is(jpeg: bytes) -> None:
    broken = FrameHeader(7, 1.5, 99).pack() + jpeg
    assert smaller(broken, LEVELS[-1]) == broken


async def test_a_level_is_made_once_for_all_who_ask(
    picture: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = []
    may_go_on = threading.Event()

    def count(*arguments: object) -> bytes:
        made.append(arguments)
        may_go_on.wait(10)
        return b"small"

    monkeypatch.setattr(module, "smaller", count)
    small = SmallPictures()
    asking = [asyncio.create_task(small(picture, SMALL[0])) for _ in range(5)]
    gone = asyncio.create_task(small(picture, SMALL[0]))
    await asyncio.sleep(0)
    gone.cancel()  # one who leaves meanwhile takes nothing from the others
    may_go_on.set()
    assert await asyncio.gather(*asking) == [b"small"] * 5
    assert await small(picture, SMALL[0]) == b"small"
    assert len(made) == 1
    await small(picture, SMALL[1])
    await small(bytes(bytearray(picture)), SMALL[0])
    assert len(made) == 3
    assert await small(picture, 0) is picture
