"""One message of every type that the installed viser knows, by introspection."""

import dataclasses
from typing import Any, Union, get_args, get_origin, get_type_hints

import msgspec
from viser import _messages


def sample(annotation: Any) -> Any:
    """A value of a type, as msgpack has it."""
    if get_origin(annotation) is Union:
        return sample(get_args(annotation)[0])
    if get_origin(annotation) is tuple:
        parts = get_args(annotation)
        return [] if len(parts) > 1 and parts[1] is ... else [sample(part) for part in parts]
    plain = {float: 1.0, int: 1, str: "x", bool: True, bytes: b"x", dict: {}, list: []}
    if get_args(annotation) and isinstance(get_args(annotation)[0], str):  # a Literal
        return get_args(annotation)[0]
    return plain.get(get_origin(annotation) or annotation)


def every_message() -> dict[str, bytes]:
    """By its name, each message as a browser would send it."""
    messages = {}
    for kind in _messages.Message.get_subclasses():
        hints = get_type_hints(kind)
        values = {field.name: sample(hints[field.name]) for field in dataclasses.fields(kind)}
        messages[kind.__name__] = msgspec.msgpack.encode({"type": kind.__name__, **values})
    return messages
