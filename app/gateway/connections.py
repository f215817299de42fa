"""What is open now, and by whose right, so that it ends when that does."""

import asyncio
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from app.errors import NotSignedIn
from app.gateway.tokens import TokenStore

if TYPE_CHECKING:
    from app.gateway.auth import Identity

log = logging.getLogger(__name__)

REVOKED_CHECK_S = 0.5


class Connections:
    """What is open now, by token and browser. Used on the event loop."""

    def __init__(self, tokens: TokenStore) -> None:
        self._tokens = tokens
        self._open: dict[Callable[[], None], Identity] = {}

    def check(self, identity: "Identity | None") -> None:
        """Do nothing if this token still opens something.

        Raises:
            NotSignedIn: it was revoked, or ran out.
        """
        if identity is not None and not self._tokens.is_alive(identity.token):
            raise NotSignedIn("the token was revoked or ran out; nothing was changed")

    @contextmanager
    def kept(self, identity: "Identity", end: Callable[[], None]) -> Iterator[None]:
        """Meanwhile ``end`` is called when the token has run out or was revoked."""
        self._open[end] = identity
        try:
            yield
        finally:
            self._open.pop(end, None)

    def end_browser(self, identity: "Identity") -> None:
        """End what a browser has open that signs out; nothing of others with the same token."""
        for end, kept in tuple(self._open.items()):
            if kept.browser and (kept.token, kept.browser) == (identity.token, identity.browser):
                end()

    async def watch(self) -> None:
        """End what has lost its token, for ever."""
        while True:
            await asyncio.sleep(REVOKED_CHECK_S)
            alive = {id: self._tokens.is_alive(id) for id in {i.token for i in self._open.values()}}
            for end, identity in tuple(self._open.items()):
                if not alive[identity.token]:
                    log.info(
                        "a connection is closed: its token %s opens nothing any more",
                        identity.token,
                    )
                    end()
