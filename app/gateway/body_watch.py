"""A request's body: it has a time limit, and rights are judged again once it is there.

Whoever sends a body slowly decides when the request begins to do anything. Until then the token may
have been revoked, or have run out.
"""

import asyncio
from collections.abc import Callable

from fastapi import Request
from starlette.types import Message, Receive, Scope

from app.errors import RequestError

STRANGER_S = 10.0
"""Who is not signed in sends a token, and nothing else."""
_JUDGE = "farhand.judge"


class BodyTooSlow(RequestError):
    """A request's body did not arrive in time; nothing was changed."""

    default_code = "body_too_slow"
    status = 408


class WatchedBody:
    """An ASGI ``receive`` in place of the server's.

    Args:
        scope: Of the request; :func:`still_allowed` finds ``judge`` there.
        receive: The server's.
        limit_s: From now until the whole body is there.
        judge: Raises, when whoever sent the request may not do so any more.
    """

    def __init__(
        self, scope: Scope, receive: Receive, limit_s: float, judge: Callable[[], None]
    ) -> None:
        scope[_JUDGE] = judge
        self._receive = receive
        self._judge = judge
        self._limit_s = limit_s
        self._until = asyncio.get_running_loop().time() + limit_s
        self._complete = False

    async def __call__(self) -> Message:
        """The next part.

        Raises:
            BodyTooSlow: it did not come in time.
            NotSignedIn: the body is complete, and the token opens nothing any more.
        """
        if self._complete:
            return await self._receive()
        try:
            async with asyncio.timeout_at(self._until):
                message = await self._receive()
        except TimeoutError:
            raise BodyTooSlow(
                f"the body did not arrive within {self._limit_s:g} s", seconds=self._limit_s
            ) from None
        if message["type"] == "http.request" and not message.get("more_body", False):
            self._complete = True
            self._judge()
        return message


def still_allowed(request: Request) -> None:
    """Do nothing, if whoever sent the request may still do so: before what long work leads to.

    Raises:
        NotSignedIn: the token opens nothing any more; nothing must be changed.
    """
    judge: Callable[[], None] | None = request.scope.get(_JUDGE)
    if judge is not None:
        judge()
