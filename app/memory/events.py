"""What an event is. docs/protocol.md says what the data of each kind holds."""

from dataclasses import dataclass
from typing import Any, Literal, get_args

Kind = Literal[
    "started",
    "control",
    "armed",
    "disarmed",
    "gesture",
    "program",
    "keys",
    "hold",
    "stop",
    "unconfirmed",
    "reset",
    "fault",
    "robot_lost",
    "robot_back",
    "enrolled",
    "changed",
    "retired",
    "gallery",
    "sign_in",
]
KINDS: tuple[Kind, ...] = get_args(Kind)
OPERATORS_KINDS: frozenset[Kind] = frozenset({"sign_in"})
"""What observers are not shown: how the door is tried is for those who keep it."""


@dataclass(frozen=True)
class Event:
    """One thing that happened."""

    id: int
    """Rises with every event, also over restarts: the order in which they happened."""
    at_ms: int
    """When it began, ms since 1970, UTC."""
    kind: Kind
    data: dict[str, Any]
    """Words and numbers for programs, never sentences that would need translating."""
    took_ms: int | None
    """How long it lasted; None while it lasts, and of what has no length."""
    template: bool
    """Whether a template belongs to it."""
    picture: bool
    """Whether a picture belongs to it."""
