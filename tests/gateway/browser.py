"""What a browser has once it is signed in, for tests without one."""

from typing import Any, NamedTuple

import httpx
from websockets.typing import Subprotocol

from app.gateway.page_secret import PAGE_HEADER, PAGE_PROTOCOL, PROTOCOL

NAME = "0123456789abcdef"
"""What the browser calls itself."""


class SignedIn(NamedTuple):
    """The cookie, which goes to every port of the host, and the halves, which stay in the page."""

    cookie: str
    """``name=value``."""
    half: str
    ticket: str

    @classmethod
    def by(cls, answer: httpx.Response) -> "SignedIn":
        """From the answer to a sign-in."""
        assert answer.status_code == 303, answer.text
        half, ticket = answer.headers["location"].partition("#page=")[2].split(".")
        return cls(answer.headers["set-cookie"].partition(";")[0], half, ticket)

    @property
    def stolen(self) -> dict[str, str]:
        """What a server on another port gets."""
        return {"Cookie": self.cookie}

    def headers(self, browser: str = NAME) -> dict[str, str]:
        """What the page sends."""
        return {"Cookie": self.cookie, PAGE_HEADER: f"{self.half}.{browser}"}

    def socket(self, browser: str = NAME) -> dict[str, Any]:
        """Options of a WebSocket that the page opens."""
        protocols = [
            Subprotocol(PROTOCOL),
            Subprotocol(f"{PAGE_PROTOCOL}{self.half}.{browser}"),
        ]
        return {"additional_headers": self.stolen, "subprotocols": protocols}

    def query(self, browser: str = NAME) -> dict[str, str]:
        """What the addresses of pictures carry."""
        return {"ticket": f"{self.ticket}.{browser}"}
