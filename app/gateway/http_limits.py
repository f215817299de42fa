"""What the HTTP and WebSocket protocols of the server ask about a connection's limits."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any, NamedTuple

from app.config import ConnectionSettings
from app.errors import NotAllowed, RequestError
from app.gateway.auth import Gatekeeper
from app.gateway.connection_table import ConnectionTable
from app.gateway.errors import error_body
from app.gateway.machine import address_group
from app.gateway.token_bucket import RequestBuckets

Judged = Callable[[bool], bool]
"""Told whether a request comes from somebody signed in; whether it is answered at all."""
JUDGED = "farhand.judged"
"""Key of an ASGI scope under which a :data:`Judged` stands."""


class TooManyRequests(RequestError):
    """Too many requests by somebody who is not signed in."""

    default_code = "too_many_requests"
    status = 429


def too_many_requests() -> TooManyRequests:
    """The error for a request over the rate."""
    return TooManyRequests(
        "too many requests came from there without being signed in; wait a second, or sign in",
        retry_after_s=1,
    )


def is_answered(scope: Mapping[str, Any], signed_in: bool) -> bool:
    """Tell the connection of a request whether its sender is signed in.

    Returns:
        Whether the request is answered; otherwise too many came from there.
    """
    judged: Judged | None = scope.get(JUDGED)
    return judged is None or judged(signed_in)


@dataclass(frozen=True)
class HttpLimits:
    """What all connections of a server share."""

    settings: ConnectionSettings
    table: ConnectionTable
    requests: RequestBuckets
    gatekeeper: Gatekeeper | None = None

    @classmethod
    def make(
        cls,
        settings: ConnectionSettings,
        table: ConnectionTable,
        gatekeeper: Gatekeeper | None = None,
    ) -> "HttpLimits":
        """The limits of these settings."""
        requests = RequestBuckets(
            settings.requests_per_s, settings.all_requests_per_s, settings.burst_s
        )
        return cls(settings, table, requests, gatekeeper)

    def sender(self, scope: Mapping[str, Any]) -> str:
        """Where a request comes from, as limits count it."""
        try:
            if self.gatekeeper is not None:
                return address_group(self.gatekeeper.client(scope))
        except NotAllowed:  # past the proxy; the guard says so
            pass
        return address_group(str((scope.get("client") or ("",))[0]))


class Refusal(NamedTuple):
    """Why what cannot even be read as a request is refused."""

    status: HTTPStatus
    code: str
    message: str

    def answer(self) -> bytes:
        """The whole HTTP answer, in the one shape of errors."""
        body = json.dumps(error_body(self.code, self.message)).encode()
        retry = b"Retry-After: 1\r\n" if self.status == HTTPStatus.TOO_MANY_REQUESTS else b""
        return (
            b"HTTP/1.1 %d %s\r\nContent-Type: application/json\r\nContent-Length: %d\r\n"
            b"Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n%s"
            b"Connection: close\r\n\r\n"
            % (self.status, self.status.phrase.encode(), len(body), retry)
        ) + body


def head_too_large(what: str, most: int, unit: str = "bytes") -> Refusal:
    """For a head, or a part of one, over a limit."""
    status = HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE
    return Refusal(status, "head_too_large", f"{what} may have {most} {unit}")
