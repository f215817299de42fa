"""Errors become answers here, in one place and one shape: ``{"error": {...}}``."""

import logging
from collections.abc import Mapping
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse

from app.errors import FarhandError

log = logging.getLogger(__name__)

_HTTP_CODES = {
    400: "bad_request",
    401: "not_signed_in",
    403: "not_allowed",
    404: "not_found",
    405: "method_not_allowed",
    413: "too_large",
    415: "unsupported_media_type",
    422: "invalid",
}
EVERYWHERE: dict[int | str, dict[str, Any]] = {
    401: {"description": "not signed in"},
    403: {"description": "not allowed to whoever asks, or from where"},
}
"""For the API's document: what every route may answer."""
BAD_BODY: dict[int | str, dict[str, Any]] = {
    400: {"description": "a body that breaks the rules of its media type"},
    415: {"description": "a body of another media type"},
}
"""The same for routes that take a body."""
INTERNAL_MESSAGE = "something went wrong inside the server; its log says what"


def error_body(code: str, message: str, detail: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """The one shape of every error over HTTP."""
    return {"error": {"code": code, "message": message, "detail": dict(detail or {})}}


def error_response(error: FarhandError, headers: Mapping[str, str] | None = None) -> JSONResponse:
    """The answer that ``error`` becomes."""
    more = dict(headers or {})
    if "retry_after_s" in error.detail:
        more.setdefault("Retry-After", str(error.detail["retry_after_s"]))
    if error.status == 408:  # the rest of the body would still be waited for
        more.setdefault("Connection", "close")
    return JSONResponse(
        error_body(error.code, error.message, error.detail),
        status_code=error.status,
        headers=more or None,
    )


def describe_validation(error: ValidationError | RequestValidationError) -> tuple[str, list[Any]]:
    """A validation error as one sentence, and as a JSON-compatible list of fields.

    Input values are left out of the list: they may hold NaN, bytes or secrets.
    """
    fields = [
        {"field": ".".join(str(part) for part in entry["loc"]), "message": str(entry["msg"])}
        for entry in error.errors()
    ]
    first = fields[0]
    where = f"{first['field']}: " if first["field"] else ""
    return f"{where}{first['message']}", fields


def unexpected_response() -> JSONResponse:
    """The answer to what nobody foresaw; the caller learns nothing of it."""
    return JSONResponse(error_body("internal", INTERNAL_MESSAGE), status_code=500)


def install_error_handlers(app: FastAPI) -> None:
    """Make every error of ``app`` an answer in the one shape."""

    async def on_farhand_error(request: Request, error: Exception) -> JSONResponse:
        assert isinstance(error, FarhandError)
        if error.status >= 500:
            log.warning("%s %s: %s", request.method, request.url.path, error.message)
        return error_response(error)

    async def on_validation_error(_request: Request, error: Exception) -> JSONResponse:
        assert isinstance(error, RequestValidationError | ValidationError)
        message, fields = describe_validation(error)
        return JSONResponse(error_body("invalid", message, {"fields": fields}), status_code=422)

    async def on_http_error(request: Request, error: Exception) -> JSONResponse:
        assert isinstance(error, HTTPException)
        code = _HTTP_CODES.get(error.status_code, "error")
        message = str(error.detail)
        if error.status_code == 404:
            message = f"there is nothing at {request.url.path}"
        elif error.status_code == 405:
            message = f"{request.method} is not possible at {request.url.path}"
        return JSONResponse(
            error_body(code, message), status_code=error.status_code, headers=error.headers
        )

    app.add_exception_handler(FarhandError, on_farhand_error)
    app.add_exception_handler(RequestValidationError, on_validation_error)
    app.add_exception_handler(ValidationError, on_validation_error)
    app.add_exception_handler(HTTPException, on_http_error)
