"""Reading a message of the link without ever raising into the thread that received it."""

from typing import TypeVar

from pydantic import ValidationError

from app.link.messages import Message

MAX_MESSAGE_BYTES = 64 * 1024
"""Longest message that is read; a sequence of 32 steps has about 6 KB, a state about 3 KB."""

M = TypeVar("M", bound=Message)


def decode(kind: type[M], payload: bytes) -> M | None:
    """The message in ``payload`` (UTF-8 JSON), or None when it is not one of this kind."""
    if len(payload) > MAX_MESSAGE_BYTES:
        return None
    try:
        return kind.model_validate_json(payload)
    except (ValidationError, ValueError, RecursionError):
        return None
