"""Numbers as people send them in JSON: a number, and nothing that Python would take for one.

``true`` is no joint and ``"1"`` no velocity. 2.0 is a whole number, as in JSON Schema.
"""

from typing import Annotated, Any

from pydantic import BeforeValidator, Strict


def _number(value: Any) -> Any:
    if isinstance(value, bool | str | bytes):
        what = "true or false" if isinstance(value, bool) else "a text"
        raise ValueError(f"must be a number, not {what}")
    return value


Whole = Annotated[int, BeforeValidator(_number)]
Real = Annotated[float, BeforeValidator(_number)]
Flag = Annotated[bool, Strict()]
"""``true`` or ``false``, and neither 1 nor "yes"."""
