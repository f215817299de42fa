"""uvicorn's HTTP protocol with limits: how much a request may be, and how long it may take.

uvicorn and its parser take a head of any size and wait for the rest of a request for ever. Here
bytes are counted before they are parsed, and each phase of a connection has its time.
"""

import asyncio
import functools
import time
from http import HTTPStatus
from typing import Any

import httptools
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from app.gateway.connection_table import Connection
from app.gateway.http_limits import (
    JUDGED,
    HttpLimits,
    Judged,
    Refusal,
    head_too_large,
    too_many_requests,
)
from app.gateway.ws_protocol import LimitedWebSocket

SLICE = 16 * 1024
"""Bytes parsed at once: after each what came of them is looked at."""
MAX_PIPELINED = 16
"""Requests that wait on one connection for the answers before theirs."""
WRAPPING = 8
"""Bytes of chunk sizes and the like for a byte of body; no client needs more than six."""
LINGER_S = 1.0
MAX_LINGER = 1 << 20
"""So long, and so many bytes more, who was refused is read on: closing at once would reset the
connection, and the answer that says why would be lost."""
CREDENTIALS = (b"authorization", b"cookie")


class _RefusedError(Exception):
    """Ends the parser's work."""


class LimitedHttp(HttpToolsProtocol):
    """HTTP/1.1 on one connection.

    Args:
        connection: As the listener counted it.
        limits: Of the server.
        **options: As uvicorn makes its own.
    """

    def __init__(self, *, connection: Connection, limits: HttpLimits, **options: Any) -> None:
        super().__init__(**options)
        self._connection = connection
        self._limits = limits
        self._settings = limits.settings
        self.timeout_keep_alive = self._settings.keep_alive_s
        self._refusal: Refusal | None = None
        self._head_bytes = 0
        self._header_count = 0
        self._in_head = False
        self._in_body = False
        self._body_bytes = 0
        self._body_fed = 0
        self._body_since = 0.0
        self._discarded: int | None = None
        """Bytes thrown away since the connection was refused; None while it is not."""
        self._judge: Judged = self._unjudged
        plain = self.ws_protocol_class
        if plain is not None:
            self.ws_protocol_class = functools.partial(  # type: ignore[assignment]
                LimitedWebSocket,
                connection=connection,
                limits=limits,
                judge=lambda signed_in: self._judge(signed_in),
            )

    # The connection

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin; from now on the table ends the connection through its transport."""
        super().connection_made(transport)
        self._connection.end = transport.abort
        self._connection.expire = self._expired
        self._connection.is_closing = transport.is_closing
        if self._connection not in self._limits.table:
            transport.abort()  # it had to make room meanwhile

    def connection_lost(self, exc: Exception | None) -> None:
        """Count the connection no more."""
        self._limits.table.remove(self._connection)
        super().connection_lost(exc)

    def pause_writing(self) -> None:
        """What was sent is not read: for how long may that be?"""
        super().pause_writing()
        signed_in = self._connection.signed_in
        most = self._settings.transfer_s if signed_in else self._settings.unread_s
        self._connection.write_deadline = time.monotonic() + most

    def resume_writing(self) -> None:
        """It has been read."""
        super().resume_writing()
        self._connection.write_deadline = None

    def data_received(self, data: bytes) -> None:
        """Parse, with a look at the limits after every few bytes."""
        if self._discarded is not None:
            self._discarded += len(data)
            if self._discarded > MAX_LINGER:
                self.transport.abort()
            return
        self._unset_keepalive_if_required()
        self._limits.table.heard(self._connection)
        at = 0
        while at < len(data):
            size = SLICE
            if not self._in_body:
                self._begin_head()
                size = min(SLICE, self._settings.max_head_bytes - self._head_bytes)
            part = data[at : at + size]
            at += size
            if self._in_body:
                self._body_fed += len(part)
            else:
                self._head_bytes += len(part)
            if not self._parsed(part) or not self._is_within_limits():
                return

    def _is_within_limits(self) -> bool:
        """Whether what has been parsed of a request may go on."""
        if self._in_body:
            wrapping = self._body_fed - self._body_bytes
            if wrapping > self._settings.max_head_bytes + WRAPPING * self._body_bytes:
                message = "there is far more round the body of this request than in it"
                self._refuse(Refusal(HTTPStatus.BAD_REQUEST, "bad_request", message))
                return False
        elif self._head_bytes >= self._settings.max_head_bytes:
            self._refuse(head_too_large("the head of a request", self._settings.max_head_bytes))
            return False
        return True

    def _parsed(self, data: bytes) -> bool:
        """Whether there is more to parse on this connection."""
        try:
            self.parser.feed_data(data)
        except httptools.HttpParserUpgrade:
            if self._should_upgrade():
                self._connection.deadline = time.monotonic() + self._settings.head_s
                self.handle_websocket_upgrade()
            else:
                # Answered as if nothing had been said of another protocol, and then closed.
                self.cycle.keep_alive = False
                self._discarded = 0
            return False
        except httptools.HttpParserError:
            bad = Refusal(HTTPStatus.BAD_REQUEST, "bad_request", "this is not a request in HTTP")
            self._refuse(self._refusal or bad)
            return False
        return not self.transport.is_closing()

    def _begin_head(self) -> None:
        if not self._in_head:
            self._in_head = True
            self._connection.deadline = time.monotonic() + self._settings.head_s

    # What the parser tells

    def on_message_begin(self) -> None:
        """A request begins."""
        super().on_message_begin()
        self._begin_head()
        self._header_count = 0
        if len(self.pipeline) >= MAX_PIPELINED:
            message = f"at most {MAX_PIPELINED} requests may wait on one connection"
            self._stop(Refusal(HTTPStatus.TOO_MANY_REQUESTS, "too_many_requests", message))

    def on_url(self, url: bytes) -> None:
        """A part of the target."""
        super().on_url(url)
        if len(self.url) > self._settings.max_line_bytes:
            message = f"the target of a request may have {self._settings.max_line_bytes} bytes"
            self._stop(Refusal(HTTPStatus.REQUEST_URI_TOO_LONG, "target_too_long", message))

    def on_header(self, name: bytes, value: bytes) -> None:
        """A header; what comes after a body is none."""
        if self._in_body:
            return
        self._header_count += 1
        if self._header_count > self._settings.max_headers:
            self._stop(head_too_large("a request", self._settings.max_headers, "headers"))
        if len(name) + len(value) > self._settings.max_line_bytes:
            self._stop(head_too_large("one header", self._settings.max_line_bytes))
        super().on_header(name, value)

    def on_headers_complete(self) -> None:
        """The head is whole: the application gets it, unless too many came before."""
        self._in_head = False
        self._in_body = True
        self._head_bytes = self._body_bytes = self._body_fed = 0
        self._body_since = time.monotonic()
        sender = self._limits.sender(self.scope)
        paid = self._limits.requests.take(sender, self._body_since)
        if not paid and not any(name in CREDENTIALS for name, _ in self.headers):
            error = too_many_requests()
            self._stop(Refusal(HTTPStatus(error.status), error.code, error.message))
        self._judge = functools.partial(self._judged, sender, paid)
        self.scope[JUDGED] = self._judge  # type: ignore[literal-required]
        waits = self.cycle is not None and not self.cycle.response_complete
        self._connection.deadline = None if waits else self._body_since + self._settings.body_s
        super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        """A part of the body."""
        super().on_body(body)
        self._body_bytes += len(body)

    def on_message_complete(self) -> None:
        """The request is whole."""
        super().on_message_complete()
        self._in_body = False
        self._connection.deadline = None
        if self.cycle is not None and self.cycle.response_complete:
            self._idle()

    # What the application tells

    def _unjudged(self, _signed_in: bool) -> bool:
        return True

    def _judged(self, sender: str, paid: bool, signed_in: bool) -> bool:
        self._limits.table.judged(self._connection, signed_in)
        if signed_in and paid:
            self._limits.requests.put_back(sender)
        if signed_in and self._in_body and self._connection.deadline is not None:
            self._connection.deadline = self._body_since + self._settings.transfer_s
        return signed_in or paid

    def on_response_complete(self) -> None:
        """The answer is on its way."""
        unread = self._in_body and not self.pipeline and not self._connection.signed_in
        # A short rest is read: the client does not know of an end, and would ask on this connection
        # again.
        unread = unread and not self._is_short_body()
        super().on_response_complete()
        if self.transport.is_closing():
            return
        if unread:
            # Nothing of that body is wanted, and nobody has to be read on for politeness.
            self._linger()
        elif self._in_body:
            signed_in = self._connection.signed_in
            most = self._settings.transfer_s if signed_in else self._settings.body_s
            self._connection.deadline = time.monotonic() + most
        elif not self._in_head:
            self._idle()

    def _is_short_body(self) -> bool:
        """Whether the body that is under way has at most as many bytes as a head may have."""
        declared = dict(self.headers).get(b"content-length", b"")
        return declared.isdigit() and int(declared) <= self._settings.max_head_bytes

    def _idle(self) -> None:
        # uvicorn itself ends who is signed in after keep_alive_s.
        idle = None if self._connection.signed_in else time.monotonic() + self._settings.idle_s
        self._connection.deadline = idle

    # Refusing

    def _stop(self, why: Refusal) -> None:
        self._refusal = why
        raise _RefusedError

    def _expired(self) -> None:
        if self._discarded is not None:
            self.transport.close()
        elif self._in_head or self._in_body:
            message = "the request did not come in time"
            self._refuse(Refusal(HTTPStatus.REQUEST_TIMEOUT, "request_timeout", message))
        else:
            self.transport.close()

    def _refuse(self, why: Refusal) -> None:
        """Say why, if an answer can be told from those before, and close."""
        cycle = self.cycle
        busy = cycle is not None and not cycle.response_complete
        if busy and self._in_body and not cycle.response_started and not self.pipeline:
            cycle.disconnected = True
            cycle.message_event.set()
            busy = False
        if busy:
            self.transport.close()
            return
        self.transport.write(why.answer())
        self._linger()

    def _linger(self) -> None:
        self._unset_keepalive_if_required()
        self._discarded = 0
        self._connection.deadline = time.monotonic() + LINGER_S
        self.flow.resume_reading()
        if self.transport.can_write_eof():
            self.transport.write_eof()
