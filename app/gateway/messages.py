"""The operator WebSocket's text messages, both ways. docs/protocol.md describes every field.

``frame`` and ``robot`` messages are replaced by newer ones while they wait to be sent
(:data:`NEWEST_WINS`); the others are kept.
"""

import json
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from app.errors import FarhandError, MessageRefused
from app.gateway.errors import describe_validation
from app.gateway.unicode_text import check_unicode
from app.link.actions import HeldAction
from app.link.numbers import Flag, Real, Whole

MAX_TEXT = 4096
"""Characters of a client's text message."""

CLIENT_MESSAGES = (
    "take_control",
    "release_control",
    "arm",
    "disarm",
    "stop",
    "reset",
    "view",
    "speed",
    "picture",
    "ping",
    "ask_control",
    "keep_control",
    "hand_over",
    "jog",
    "use_gallery",
)
SERVER_MESSAGES = (
    "hello",
    "frame",
    "gesture",
    "robot",
    "gallery",
    "people",
    "pong",
    "jog",
    "timeline",
    "error",
)
NEWEST_WINS = frozenset({"frame", "robot", "gallery", "people", "pong", "jog", "timeline"})


class _ClientMessage(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class TakeControl(_ClientMessage):
    """Become the one who drives; with ``takeover`` also when somebody else does."""

    type: Literal["take_control"]
    takeover: Flag = False


class Plain(_ClientMessage):
    """A request without values."""

    type: Literal[
        "release_control", "ask_control", "keep_control", "arm", "disarm", "stop", "reset"
    ]


class HandOver(_ClientMessage):
    """Give control to a session that asked for it."""

    type: Literal["hand_over"]
    to: str = Field(min_length=1, max_length=40, description="its name")


class UseGallery(_ClientMessage):
    """Recognise this session against another gallery; answered with ``gallery``."""

    type: Literal["use_gallery"]
    gallery: str = Field(min_length=1, max_length=64, description="its id")


class View(_ClientMessage):
    """Ask for masks and templates in the ``frame`` messages, or for none."""

    type: Literal["view"]
    detail: Flag
    glass: Flag = Field(default=False, description="with detail: every step between, too")


class Speed(_ClientMessage):
    """The part of the ordinary speed at which this session wants to drive."""

    type: Literal["speed"]
    scale: Real = Field(ge=0.05, le=1.0)


class Picture(_ClientMessage):
    """The newest picture of a robot camera that this client has shown."""

    type: Literal["picture"]
    camera: Literal["wrist", "scene"]
    tick: Whole = Field(ge=0, description="of the state that the picture shows, ms")


class Jog(_ClientMessage):
    """What a key, a button or a gamepad asks for while it is held; sent over and over."""

    type: Literal["jog"]
    hold: Whole = Field(ge=0, lt=2**53, description="number of this press: rises with each")
    action: HeldAction | None = Field(description="null: nothing is held, and the way is alive")
    scale: Real = Field(default=1.0, ge=0.05, le=1.0, description="part of the session's speed")
    tick: Whole = Field(ge=1, description="newest server tick that the client has seen, ms")
    at: Real | None = Field(
        default=None, ge=0, lt=1e15, description="when it is sent, ms on the client's own clock"
    )


class Ping(_ClientMessage):
    """Answered with ``pong``."""

    type: Literal["ping"]
    t: Real


ClientMessage = Annotated[
    TakeControl | Plain | HandOver | UseGallery | View | Speed | Picture | Jog | Ping,
    Field(discriminator="type"),
]
_CLIENT_MESSAGE: TypeAdapter[ClientMessage] = TypeAdapter(ClientMessage)


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is not a JSON number")


def parse_client_message(text: str) -> ClientMessage:
    """Read one text message.

    Raises:
        MessageRefused: too long, not JSON (NaN and infinity are not), not an object, of unknown
            type, or with values that are not allowed.
    """
    if len(text) > MAX_TEXT:
        raise MessageRefused(
            f"the text message has {len(text)} characters; at most {MAX_TEXT} are allowed",
            code="message_too_long",
            length=len(text),
        )
    try:
        value = json.loads(text, parse_constant=_no_constant)
        check_unicode(value)
    except (ValueError, RecursionError) as error:
        raise MessageRefused(
            f"the text message is not JSON: {error}"[:300], code="message_not_json"
        ) from None
    if not isinstance(value, dict):
        raise MessageRefused(
            "the text message is not a JSON object with a type", code="message_not_object"
        )
    kind = value.get("type")
    if kind not in CLIENT_MESSAGES:
        raise MessageRefused(
            f"the message type {str(kind)[:40]!r} is not known; "
            f"known are {', '.join(CLIENT_MESSAGES)}",
            code="message_type",
        )
    try:
        return _CLIENT_MESSAGE.validate_python(value)
    except ValidationError as error:
        message, _ = describe_validation(error)
        raise MessageRefused(message[:300], code="message_values", type=kind) from None


def encode(message: dict[str, Any]) -> str:
    """One message as JSON text.

    Raises:
        ValueError: a number is not finite.
    """
    return json.dumps(message, allow_nan=False, separators=(",", ":"))


def error_message(error: FarhandError, seq: int | None = None) -> dict[str, Any]:
    """The ``error`` message that an error becomes."""
    return {
        "type": "error",
        "code": error.code,
        "message": error.message,
        "detail": error.detail,
        "seq": seq,
    }
