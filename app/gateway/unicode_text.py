"""Text that is Unicode: JSON and some encodings of forms can bring what is none."""

from typing import Any


class NotUnicode(ValueError):
    """A text holds half of a surrogate pair, which is no character and cannot be stored or sent."""


def check_unicode(value: Any) -> None:
    """Refuse texts with half of a surrogate pair, wherever they stand in a JSON value.

    Raises:
        NotUnicode: with the place of the first.
    """
    waiting: list[Any] = [value]
    while waiting:
        each = waiting.pop()
        if isinstance(each, str):
            _check(each)
        elif isinstance(each, dict):
            waiting.extend(each)
            waiting.extend(each.values())
        elif isinstance(each, list):
            waiting.extend(each)


def _check(text: str) -> None:
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise NotUnicode(
            f"a text holds {text[error.start]!r} at character {error.start + 1}, half of a "
            "surrogate pair, which is no character"
        ) from None
