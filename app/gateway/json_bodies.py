"""Reading JSON that somebody sent."""

import json
from typing import Any

from fastapi import Request
from pydantic import ValidationError

from app.errors import Invalid
from app.gateway.errors import describe_validation
from app.gateway.unicode_text import NotUnicode, check_unicode
from app.gateway.uploads import UnsupportedMedia
from app.link.actions import ACTION, Action

MAX_JSON = 64 * 1024


async def read_object(request: Request, allowed: tuple[str, ...]) -> dict[str, Any]:
    """A request's body: a JSON object with one or more of the ``allowed`` fields.

    Raises:
        Invalid: it is something else, or too long.
        UnsupportedMedia: it is not said to be JSON.
    """
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind != "application/json":
        raise UnsupportedMedia(f"send application/json, not {kind or 'nothing'}", given=kind)
    body = bytearray()
    async for part in request.stream():
        body += part
        if len(body) > MAX_JSON:
            raise Invalid(f"the JSON may have {MAX_JSON} bytes", field="body")
    found = parse_json(bytes(body), "body")
    if not isinstance(found, dict) or not found or found.keys() - set(allowed):
        *most, last = (f"'{name}'" for name in allowed)
        which = f"one or more of {', '.join(most)} and {last}" if most else last
        raise Invalid(f"send a JSON object with {which}", field="body")
    return found


def parse_json(text: str | bytes, what: str) -> Any:
    """Parse JSON that somebody sent; NaN and infinity are not JSON.

    Raises:
        Invalid: it is not JSON.
    """

    def no_constant(name: str) -> float:
        raise ValueError(f"{name} is not a JSON number")

    try:
        found = json.loads(text, parse_constant=no_constant)
        check_unicode(found)
    except NotUnicode as error:
        raise Invalid(f"{what}: {error}", field=what) from None
    except (ValueError, RecursionError) as error:
        raise Invalid(f"{what} is not JSON: {error}"[:300], field=what) from None
    return found


def parse_action(value: Any) -> Action:
    """An action that somebody sent.

    Raises:
        Invalid: with the first thing that is wrong.
    """
    try:
        # Through JSON, so that lists become tuples as they do in the database.
        return ACTION.validate_json(json.dumps(value))
    except ValidationError as error:
        message, fields = describe_validation(error)
        raise Invalid(f"action: {message}", code="bad_action", fields=fields) from None
    except (RecursionError, ValueError) as error:
        raise Invalid(f"action: {error}"[:300], code="bad_action") from None
