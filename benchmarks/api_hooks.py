"""What schemathesis has to be told about this API; loaded by it, in its own environment."""

# mypy: disable-error-code="untyped-decorator"

from typing import Any

import schemathesis  # type: ignore[import-not-found]


@schemathesis.serializer("application/zip")
def whole_file(_context: Any, value: Any) -> bytes:
    """A body that is one file goes out as it was made up."""
    data = getattr(value, "data", value)
    return data if isinstance(data, bytes) else str(data).encode()


@schemathesis.hook
def filter_body(_context: Any, body: Any) -> bool:
    """Leave out forms in which a field is an empty list.

    Nothing of it goes out in a multipart body, so that the server rightly takes it for left out.
    """
    return not (isinstance(body, dict) and any(value == [] for value in body.values()))
