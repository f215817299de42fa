import io
import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from app.errors import ImageRefused, TooLarge
from app.pipeline import extract_template
from app.pipeline.reading import read_image
from tests.pipeline.drawing import PHOTOS, SETTINGS, draw, encoded, jpeg

DATA = Path(__file__).parent / "data"
"""HEIC of the drawn hand, written by libheif with x265: upright, and turned with the orientation
that undoes it. What reads them here cannot write them."""
PICTURE = draw("two", noise=0)
RGB = Image.fromarray(PICTURE[:, :, ::-1])
REFERENCE = extract_template(encoded(PICTURE), SETTINGS)


def saved(image: Image.Image, kind: str, **kw) -> bytes:
    out = io.BytesIO()
    image.save(out, kind, **kw)
    return out.getvalue()


def exif(orientation: int) -> bytes:
    tags = Image.Exif()
    tags[0x0112] = orientation
    return tags.tobytes()


def like_reference(data: bytes) -> bool:
    template = extract_template(data, SETTINGS).template
    return float(np.mean(template != REFERENCE.template)) < 0.03


def test_extraction_of_a_photograph():
    assert REFERENCE.template.shape == (80, 60)
    assert REFERENCE.mask.shape == (240, 320)
    assert (REFERENCE.width, REFERENCE.height) == (640, 480)
    x, y, width, height = REFERENCE.roi
    assert 200 < x < 300
    assert 70 < y < 130
    assert width > 100
    assert REFERENCE.wrist is not None
    assert abs(REFERENCE.wrist.at - (y + height)) <= 4


@pytest.mark.parametrize(
    "data",
    [
        saved(RGB, "JPEG"),
        saved(RGB, "JPEG", progressive=True),
        saved(RGB.convert("L"), "JPEG"),
        saved(RGB.convert("L"), "PNG"),
        saved(RGB.convert("P"), "PNG"),
        saved(RGB.convert("RGBA"), "PNG"),
        saved(RGB.convert("LA"), "PNG"),
        saved(RGB, "WEBP"),
        saved(RGB, "WEBP", lossless=True),
        saved(RGB.convert("RGBA"), "WEBP"),
        saved(RGB, "AVIF"),
        saved(RGB.convert("RGBA"), "AVIF"),
        (DATA / "two.heic").read_bytes(),
        (DATA / "two_turned.heic").read_bytes(),
        encoded(PICTURE.astype(np.uint16) * 257),
        saved(RGB.resize((3200, 2400)), "JPEG"),
        saved(RGB.resize((320, 240)), "PNG"),
    ],
    ids=[
        "jpeg",
        "progressive",
        "grey jpeg",
        "grey png",
        "palette",
        "rgba",
        "grey alpha",
        "webp",
        "webp lossless",
        "webp alpha",
        "avif",
        "avif alpha",
        "heic",
        "heic turned",
        "16 bit",
        "large",
        "small",
    ],
)
def test_any_format_gives_the_same_template(data):
    assert like_reference(data)


def test_silhouette_of_one_bit():
    mask = (REFERENCE.mask * 255).astype(np.uint8)
    assert like_reference(saved(Image.fromarray(mask).convert("1"), "PNG"))


@pytest.mark.parametrize("kind", ["JPEG", "PNG", "WEBP", "AVIF"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_exif_orientation_is_applied(kind, orientation):
    # What a viewer undoes: the inverse of each orientation.
    undo = {
        2: Image.Transpose.FLIP_LEFT_RIGHT,
        3: Image.Transpose.ROTATE_180,
        4: Image.Transpose.FLIP_TOP_BOTTOM,
        5: Image.Transpose.TRANSPOSE,
        6: Image.Transpose.ROTATE_90,
        7: Image.Transpose.TRANSVERSE,
        8: Image.Transpose.ROTATE_270,
    }
    stored = RGB.transpose(undo[orientation]) if orientation in undo else RGB
    data = saved(stored, kind, exif=exif(orientation))
    pixels, width, height = read_image(data, SETTINGS)
    assert (width, height) == (640, 480)
    assert pixels.shape[:2] == (240, 320)
    expected = cv2.resize(PICTURE, (320, 240), interpolation=cv2.INTER_AREA)
    assert np.abs(pixels.astype(int) - expected).mean() < 6


def large(kind: str) -> bytes:
    """A small file that says it is 9000x9000: in ``ispe``, ISO/IEC 23008-12 section 6.5.3."""
    data = (DATA / "two.heic").read_bytes() if kind == "HEIC" else saved(RGB, "AVIF")
    size = struct.pack(">4sIII", b"ispe", 0, 640, 480)
    assert size in data
    return data.replace(size, struct.pack(">4sIII", b"ispe", 0, 9000, 9000))


def png_header(width: int, height: int) -> bytes:
    def chunk(kind: bytes, body: bytes) -> bytes:
        return (
            struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        )

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", b"") + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "the file is empty: a JPEG, PNG, WebP, HEIC or AVIF picture is needed"),
        (
            b"GIF89a" + bytes(99),
            "not a picture that can be read: JPEG, PNG, WebP, HEIC or AVIF is needed",
        ),
        (jpeg(PICTURE)[:-400], "the picture is cut short or broken: please save it again"),
        (encoded(PICTURE)[:-400], "the picture is cut short or broken: please save it again"),
        (
            saved(RGB, "WEBP")[:-400],
            "the picture is cut short or broken: please save it again",
        ),
        (
            saved(RGB, "AVIF")[:-400],
            "the picture is cut short or broken: please save it again",
        ),
        (
            (DATA / "two.heic").read_bytes()[:-400],
            "the picture is cut short or broken: please save it again",
        ),
        (
            (DATA / "two.heic").read_bytes()[:60],
            "the picture is cut short or broken: please save it again",
        ),
        (
            saved(RGB, "AVIF", save_all=True, append_images=[RGB.rotate(9)]),
            "an animated AVIF: a single picture is needed",
        ),
        (
            large("HEIC"),
            "the picture is 9000x9000: at most 25 million pixels are accepted (HEIC)",
        ),
        (
            large("AVIF"),
            "the picture is 9000x9000: at most 25 million pixels are accepted (AVIF)",
        ),
        (
            png_header(100_000, 100_000),
            "the picture is 100000x100000: at most 25 million pixels are accepted (PNG)",
        ),
        (png_header(20, 20), "the picture is 20x20: at least 32x32 is needed"),
        (
            saved(RGB.convert("CMYK"), "JPEG"),
            "a JPEG with 4 colour components: 1 (grey) or 3 (colour) are needed",
        ),
    ],
)
def test_refusals_are_plain(data, message):
    with pytest.raises(ImageRefused) as caught:
        extract_template(data, SETTINGS)
    assert caught.value.message == message


def test_no_hand_is_refused_with_the_reason():
    with pytest.raises(ImageRefused, match=r"^no hand found: hardly any contrast \("):
        extract_template(jpeg(draw("fist", hand=(190, 190, 190))), SETTINGS)


def test_hand_that_runs_out_of_the_picture():
    data = encoded(draw("five", shift=(250, 0), scale=1.4))
    with pytest.raises(ImageRefused, match=r"^the hand is cut off at the bottom of the"):
        extract_template(data, SETTINGS)
    assert extract_template(data, SETTINGS, whole=False).template.any()


def test_too_many_bytes():
    with pytest.raises(TooLarge, match=r"at most 4194304 are accepted"):
        extract_template(bytes((4 << 20) + 1), SETTINGS)


def test_scan_bomb_is_refused_before_decoding():
    data = saved(RGB.resize((6000, 5000)), "JPEG", progressive=True)
    at = data.rindex(b"\xff\xda")
    bomb = data[:-2] + data[at:-2] * 10 + b"\xff\xd9"
    with pytest.raises(ImageRefused, match=r"in \d+ scans takes too long to decode"):
        extract_template(bomb, SETTINGS)


def test_of_several_pictures_in_a_webp_the_largest_counts():
    small = saved(RGB.resize((48, 40)), "WEBP", lossless=True)
    header = b"\x2f" + struct.pack("<I", 16383 | 16383 << 14)
    huge = b"VP8L" + struct.pack("<I", len(header) + 1) + header + b"\0"
    body = b"WEBP" + huge + small[12:]
    data = b"RIFF" + struct.pack("<I", len(body)) + body
    with pytest.raises(ImageRefused, match=r"16384x16384: at most 25 million pixels"):
        extract_template(data, SETTINGS)


TINY = [saved(RGB.resize((48, 40)), kind) for kind in ("JPEG", "PNG", "WEBP")]


@settings(max_examples=150, deadline=None)
@given(
    st.sampled_from(TINY),
    st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)), max_size=6),
    st.floats(0, 1),
)
def test_changed_bytes_raise_nothing_but_refusals(data, changes, keep):
    changed = bytearray(data)
    for at, value in changes:
        changed[int(at * len(changed))] = value
    if keep < 0.3:
        changed = changed[: int(len(changed) * keep * 3)]
    try:
        extract_template(bytes(changed), SETTINGS)
    except ImageRefused as error:
        assert error.message


@pytest.mark.skipif(not PHOTOS.is_dir(), reason="no photographs beside the repository")
@pytest.mark.parametrize("label", "0123456789")
def test_hands_are_found_on_real_photographs(label):
    for path in sorted((PHOTOS / "digits" / label).glob("*.jpg"))[::20]:
        assert 0.1 < extract_template(path.read_bytes(), SETTINGS).template.mean() < 0.9
