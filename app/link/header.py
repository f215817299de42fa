"""The 24 bytes in front of every picture, on the WebSockets and on the link alike."""

import struct
from typing import NamedTuple

from app.errors import FrameRefused

_HEADER = struct.Struct("<2sBBIdQ")
HEADER_SIZE = _HEADER.size
MAGIC = b"FH"
VERSION = 1


class FrameHeader(NamedTuple):
    """Little-endian ``<2sBBIdQ``: magic, version, flags, sequence, capture time, newest tick.

    ``sequence`` counts the sender's pictures (wraps at 2**32). ``captured_ms`` is the capture time
    on the sender's own monotonic clock, in ms. ``tick`` is, from an operator, the newest server
    tick it has seen; from a camera, the tick of the robot state that the picture shows.
    """

    sequence: int
    captured_ms: float
    tick: int
    flags: int = 0

    def pack(self) -> bytes:
        """The 24 bytes."""
        return _HEADER.pack(
            MAGIC, VERSION, self.flags, self.sequence & 0xFFFFFFFF, self.captured_ms, self.tick
        )

    @classmethod
    def unpack(cls, message: bytes | memoryview) -> "FrameHeader":
        """Read the header of ``message``.

        Raises:
            FrameRefused: the message is shorter than the header, does not begin with ``FH``, is of
                another version, or its capture time is not a finite, non-negative number.
        """
        if len(message) < HEADER_SIZE:
            raise FrameRefused(
                f"the message has {len(message)} bytes; the header alone has {HEADER_SIZE}",
                code="header_short",
                size=len(message),
            )
        magic, version, flags, sequence, captured_ms, tick = _HEADER.unpack_from(message)
        if magic != MAGIC:
            raise FrameRefused(
                f"the message begins with {magic!r}, not with {MAGIC!r}", code="header_magic"
            )
        if version != VERSION:
            raise FrameRefused(
                f"header version {version} is not known; this server speaks version {VERSION}",
                code="header_version",
                version=version,
            )
        if not 0.0 <= captured_ms < 1e15:  # also refuses NaN
            raise FrameRefused(
                "the capture time is not a finite number of ms from 0 on", code="header_time"
            )
        return cls(sequence, captured_ms, tick, flags)
