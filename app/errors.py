"""Every error that Farhand raises on purpose.

::

    FarhandError                  code, message, detail; never raised bare
    ├── RequestError              the caller did something wrong (HTTP 4xx)
    │   ├── FrameRefused          a webcam frame that is not what the protocol asks for
    │   ├── MessageRefused        a text message of unknown type or with bad values
    │   ├── ImageRefused          an enrolment image without a usable hand
    │   │   └── Unreadable        it is no picture, or none that is read here
    │   ├── NotFound              an id that does not exist
    │   ├── Duplicate             a name that is taken
    │   ├── ChangedMeanwhile      a change of something that somebody else has changed
    │   ├── Invalid               a value out of its bounds
    │   ├── TooLarge              more bytes than allowed
    │   ├── NotSignedIn           no token, or a wrong one
    │   ├── NotAllowed            signed in, but not allowed to do this now
    │   └── NoControl             the lease is held by somebody else, or by nobody
    └── WorldError                the world did something wrong (HTTP 5xx, or exit code 1)
        ├── RobotUnavailable      the robot node does not answer
        ├── DatabaseBroken        the gesture database cannot be read
        │   └── ForeignDatabase   it is sound, but of a newer Farhand or of something else
        ├── MemoryUnavailable     the timeline and people's settings cannot be read or written
        ├── StorageFull           no space left to write to
        ├── CannotStart           a port, folder or model that is needed is missing or taken
        └── LinkFailed            the link between gateway and node cannot be opened

A message says what was given and what would have been right; the values stay available in
``detail``. :mod:`app.gateway.errors` turns these into HTTP and WebSocket answers, and
:mod:`app.cli` into one line on standard error and a non-zero exit code.
"""

from typing import Any, ClassVar


class FarhandError(Exception):
    """Base of all errors of this project.

    Args:
        message: One plain sentence: what was given, and what would have been right.
        code: A stable, lower-case word for programs, such as ``frame_too_large``. Defaults to the
            class's own.
        **detail: The values the message speaks of, JSON-compatible.
    """

    default_code: ClassVar[str] = "error"
    status: ClassVar[int] = 500
    """HTTP status code of the answer."""

    def __init__(self, message: str, *, code: str | None = None, **detail: Any) -> None:
        super().__init__(message)
        self.message = message
        self.code = code or self.default_code
        self.detail = detail


class RequestError(FarhandError):
    """The caller did something wrong and can do it right."""

    default_code = "bad_request"
    status = 400


class FrameRefused(RequestError):
    """A webcam frame that is not what docs/protocol.md asks for."""

    default_code = "frame_refused"


class MessageRefused(RequestError):
    """A text message of unknown type, or with values that are not allowed."""

    default_code = "message_refused"


class ImageRefused(RequestError):
    """An image in which no usable hand was found."""

    default_code = "image_refused"
    status = 422


class Unreadable(ImageRefused):
    """A file that is no picture, is broken, or has too many pixels."""


class NotFound(RequestError):
    """An id that does not exist."""

    default_code = "not_found"
    status = 404


class Duplicate(RequestError):
    """A name that is taken already."""

    default_code = "duplicate"
    status = 409


class ChangedMeanwhile(RequestError):
    """A change of something that has been changed since the caller read it."""

    default_code = "changed_meanwhile"
    status = 409


class Invalid(RequestError):
    """A value out of its bounds."""

    default_code = "invalid"
    status = 422


class TooLarge(RequestError):
    """More bytes than allowed."""

    default_code = "too_large"
    status = 413


class NotSignedIn(RequestError):
    """No token, or a wrong one."""

    default_code = "not_signed_in"
    status = 401


class NotAllowed(RequestError):
    """Signed in, but not allowed to do this."""

    default_code = "not_allowed"
    status = 403


class NoControl(RequestError):
    """The lease is held by somebody else, or by nobody."""

    default_code = "no_control"
    status = 409


class WorldError(FarhandError):
    """Something outside the caller's reach went wrong."""

    default_code = "unavailable"
    status = 503


class RobotUnavailable(WorldError):
    """The robot node does not answer."""

    default_code = "robot_unavailable"


class DatabaseBroken(WorldError):
    """The gesture database cannot be read."""

    default_code = "database_broken"


class ForeignDatabase(DatabaseBroken):
    """A database of a newer Farhand or of something else: sound, and not ours to set aside."""


class MemoryUnavailable(WorldError):
    """The timeline and people's settings cannot be read or written; driving needs neither."""

    default_code = "memory_unavailable"


class StorageFull(WorldError):
    """No space is left to write to; what was asked for has not happened."""

    default_code = "disk_full"
    status = 507


class CannotStart(WorldError):
    """A port, a folder or a model that is needed is missing or taken."""

    default_code = "cannot_start"


class LinkFailed(WorldError):
    """The link between gateway and node cannot be opened."""

    default_code = "link_failed"
