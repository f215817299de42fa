import io

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from app.config import DecodeSettings
from app.errors import FrameRefused
from app.pipeline.decode import Decode, read_header
from tests.pipeline.drawing import draw, encoded, jpeg

PICTURE = draw("two")
GOOD = jpeg(PICTURE)
SMALL = jpeg(cv2.resize(PICTURE, (64, 48)))


def refused(data: bytes) -> FrameRefused:
    with pytest.raises(FrameRefused) as caught:
        Decode(DecodeSettings())(data)
    return caught.value


def pillow(picture, **kw) -> bytes:
    out = io.BytesIO()
    Image.fromarray(picture).save(out, "JPEG", **kw)
    return out.getvalue()


@pytest.mark.parametrize(
    ("size", "working"),
    [
        ((640, 480), (240, 320)),
        ((1280, 720), (180, 320)),
        ((100, 100), (100, 100)),
        ((401, 361), (181, 201)),
    ],
)
def test_frame_is_decoded_at_working_size(size, working):
    frame = Decode(DecodeSettings())(jpeg(cv2.resize(PICTURE, size)))
    assert frame.pixels.shape == (*working, 3)
    assert (frame.width, frame.height) == size


def test_pixels_are_those_of_the_picture():
    frame = Decode(DecodeSettings())(GOOD)
    expected = cv2.resize(PICTURE, (320, 240), interpolation=cv2.INTER_AREA)
    assert np.abs(frame.pixels.astype(int) - expected).mean() < 3


def test_grey_jpeg_has_one_plane():
    frame = Decode(DecodeSettings())(encoded(cv2.cvtColor(PICTURE, cv2.COLOR_BGR2GRAY), ".jpg"))
    assert frame.pixels.shape == (240, 320, 1)


def test_same_shape_uses_the_same_buffer():
    decode = Decode(DecodeSettings())
    assert np.shares_memory(decode(GOOD).pixels, decode(GOOD).pixels)


@pytest.mark.parametrize(
    ("data", "code", "message"),
    [
        (b"", "frame_empty", "the frame is empty: a JPEG was expected"),
        (
            b"\x89PNG\r\n\x1a\n",
            "frame_not_jpeg",
            "not a JPEG: it starts with 8950 where ffd8 was expected",
        ),
        (
            pillow(PICTURE, progressive=True),
            "frame_not_baseline",
            "progressive JPEG: only baseline JPEG is accepted",
        ),
        (
            GOOD[:-2],
            "frame_cut_short",
            "the JPEG is cut short: its end marker (FFD9) is missing",
        ),
        (
            jpeg(np.zeros((730, 1280, 3), np.uint8)),
            "frame_too_large",
            "the frame is 1280x730: at most 1280x720 is accepted",
        ),
        (
            jpeg(np.zeros((8, 100, 3), np.uint8)),
            "frame_too_small",
            "the frame is 100x8: at least 16x16 is needed",
        ),
        (
            GOOD + bytes(256 * 1024),
            "frame_too_large",
            f"the frame has {len(GOOD) + 256 * 1024} bytes: at most 262144 are accepted",
        ),
    ],
)
def test_refusals_say_what_would_have_been_right(data, code, message):
    error = refused(data)
    assert (error.code, error.message) == (code, message)


@pytest.mark.parametrize("part", [0.01, 0.1, 0.5, 0.9, 0.999])
def test_cut_short_anywhere_is_refused(part):
    assert refused(GOOD[: int(len(GOOD) * part)]).code in ("frame_cut_short", "frame_not_jpeg")


def test_cut_short_with_an_end_marker_is_refused():
    assert refused(GOOD[: len(GOOD) // 2] + b"\xff\xd9").code == "frame_broken"


def test_repeated_scans_are_refused_before_decoding():
    start = GOOD.index(b"\xff\xda")
    bomb = GOOD[:start] + GOOD[start:-2] + GOOD[start:-2] + b"\xff\xd9"
    assert refused(bomb).message == "the JPEG is broken: marker FFDA inside the picture's data"


def test_bytes_after_the_end_do_not_matter():
    assert read_header(GOOD + b"rest").end == len(GOOD)


def test_restart_markers_are_allowed():
    data = pillow(PICTURE, restart_marker_rows=1)
    assert Decode(DecodeSettings())(data).pixels.shape == (240, 320, 3)


def test_exif_before_the_picture_is_skipped():
    exif = Image.Exif()
    exif[0x0112] = 6
    assert read_header(pillow(PICTURE, exif=exif))[:3] == (640, 480, 3)


def test_huge_header_is_refused_without_decoding():
    at = SMALL.index(b"\xff\xc0") + 5
    assert refused(SMALL[:at] + b"\xff\xff\xff\xff" + SMALL[at + 4 :]).code == "frame_too_large"


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(st.integers(0, len(SMALL) - 1), st.integers(0, 255)), max_size=8))
def test_changed_bytes_raise_nothing_else(changes):
    data = bytearray(SMALL)
    for at, value in changes:
        data[at] = value
    try:
        Decode(DecodeSettings())(bytes(data))
    except FrameRefused as error:
        assert error.code.startswith("frame_")


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=200))
def test_any_bytes_after_the_start_marker_raise_nothing_else(data):
    with pytest.raises(FrameRefused):
        Decode(DecodeSettings())(b"\xff\xd8" + data)
