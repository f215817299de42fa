"""Template: the hand at 60x80, one bit a pixel, 600 bytes (paper)."""

import cv2
import numpy as np

from app.errors import Invalid
from app.pipeline.types import U8, Box

WIDTH, HEIGHT = 60, 80
"""Pixels (paper)."""
PACKED_BYTES = WIDTH * HEIGHT // 8


def resize_mask(mask: U8, width: int, height: int) -> U8:
    """A mask of 0 and 1 at another size; a pixel is 1 when more than half of its area was."""
    grown = cv2.resize(mask * np.uint8(255), (width, height), interpolation=cv2.INTER_AREA)
    return cv2.threshold(grown, 127, 1, cv2.THRESH_BINARY)[1].astype(np.uint8, copy=False)


class MakeTemplate:
    """The hand's box, stretched to 60 wide and 80 high."""

    def __call__(self, hand: U8, box: Box) -> U8:
        """Returns (80, 60) of 0 and 1, a new array."""
        x, y, width, height = box
        return resize_mask(hand[y : y + height, x : x + width], WIDTH, HEIGHT)


def pack_template(template: U8) -> bytes:
    """(80, 60) of 0 and 1 to 600 bytes: row by row, the leftmost pixel in the highest bit.

    Raises:
        Invalid: another shape.
    """
    if template.shape != (HEIGHT, WIDTH):
        raise Invalid(f"a template is {HEIGHT} rows of {WIDTH} pixels, not {template.shape}")
    return np.packbits(template != 0).tobytes()


def unpack_template(packed: bytes) -> U8:
    """600 bytes to (80, 60) of 0 and 1.

    Raises:
        Invalid: another number of bytes.
    """
    if len(packed) != PACKED_BYTES:
        raise Invalid(f"a packed template has {PACKED_BYTES} bytes, not {len(packed)}")
    return np.unpackbits(np.frombuffer(packed, np.uint8)).reshape(HEIGHT, WIDTH)
