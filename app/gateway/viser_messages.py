"""What a browser may send to viser: where its camera is, and nothing else.

viser knows more than a hundred messages; among those that it acts on are some that upload files,
change what others see, or ask for a public link. Its page, as Farhand shows it, sends one. So that
one is read in full and written anew: no byte of a viewer's own reaches viser, and two parsers never
see the same bytes differently.
"""

import math
from typing import Literal, NoReturn

import msgspec

from app.gateway.closing import CLOSE_NOT_ALLOWED, CLOSE_TOO_BIG, Closing

MAX_BYTES = 1024
"""Four times the longest message that viser's page sends."""
MAX_HZ = 100.0
"""Messages a second in the long run; viser's page sends at most fifty."""
BURST = 200
"""Messages that may come at once: what a link that stood still for some seconds has kept."""
TOLD_CHARACTERS = 60
"""So many of the words that say what is wrong are told: a close reason has 123 bytes."""

_Three = tuple[float, float, float]
_Four = tuple[float, float, float, float]


class ViewerCamera(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Where a viewer's camera is: viser's message of this name, in viser's words and units."""

    type: Literal["ViewerCameraMessage"]
    wxyz: _Four
    position: _Three
    fov: float
    near: float
    far: float
    image_height: float
    image_width: float
    look_at: _Three
    up_direction: _Three

    def numbers(self) -> tuple[float, ...]:
        """All its numbers."""
        return (
            *self.wxyz, *self.position, *self.look_at, *self.up_direction,
            self.fov, self.near, self.far, self.image_height, self.image_width,
        )  # fmt: skip


_decoder = msgspec.msgpack.Decoder(ViewerCamera)
_encoder = msgspec.msgpack.Encoder()


def read(data: bytes | str) -> bytes:
    """What goes on to viser of one WebSocket message of a browser.

    Raises:
        Closing: it is not the one message that is passed on.
    """
    if isinstance(data, str):
        _refuse("a text message")
    if len(data) > MAX_BYTES:
        raise Closing(
            CLOSE_TOO_BIG,
            f"a message to the 3D view has at most {MAX_BYTES} bytes, not {len(data)}",
        )
    try:
        camera = _decoder.decode(data)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        _refuse(str(error))
    if not all(math.isfinite(number) for number in camera.numbers()):
        _refuse("a number that is not finite")
    return _encoder.encode(camera)


def _refuse(why: str) -> NoReturn:
    # What msgspec says quotes the sender: no line break or control code of theirs is written.
    shown = why.encode("unicode_escape").decode()[:TOLD_CHARACTERS]
    raise Closing(CLOSE_NOT_ALLOWED, f"the 3D view takes the place of a camera alone ({shown})")
