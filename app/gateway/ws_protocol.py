"""uvicorn's WebSocket protocol with limits for who has not been let in yet."""

import time
from typing import Any

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.http11 import Request

from app.gateway.connection_table import Connection
from app.gateway.http_limits import JUDGED, HttpLimits, Judged

MAX_EARLY = 64 * 1024
"""Bytes after a handshake and before its answer, when nothing may be sent."""


class LimitedWebSocket(WebSocketsSansIOProtocol):
    """A WebSocket on one connection.

    Args:
        connection: As the listener counted it.
        limits: Of the server.
        judge: What is told whether who opens it is signed in.
        **options: As uvicorn makes its own.
    """

    def __init__(
        self, *, connection: Connection, limits: HttpLimits, judge: Judged, **options: Any
    ) -> None:
        super().__init__(**options)
        self._connection = connection
        self._limits = limits
        self._judge = judge
        self._early = -1
        """Bytes that came before the answer to the handshake, and after its head."""

    def connection_lost(self, exc: Exception | None) -> None:
        """Count the connection no more."""
        self._limits.table.remove(self._connection)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take messages; before the handshake is answered none may come."""
        if not self.handshake_complete:
            self._early = 0 if self._early < 0 else self._early + len(data)
            if self._early > MAX_EARLY:
                self.transport.abort()
                return
        super().data_received(data)

    def handle_connect(self, event: Request) -> None:
        """Have the application asked, which tells whether who comes is signed in."""
        super().handle_connect(event)
        if hasattr(self, "scope"):
            self.scope[JUDGED] = self._judged  # type: ignore[literal-required]

    def _judged(self, signed_in: bool) -> bool:
        answered = self._judge(signed_in)
        self._connection.deadline = None
        if not signed_in:
            self._connection.deadline = time.monotonic() + self._limits.settings.idle_s
        return answered
