"""Who may come in: tokens as bearers for programs, and as cookies for browsers."""

import hmac
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from starlette.datastructures import Headers

from app.config import Settings
from app.errors import NotAllowed, NotSignedIn, RequestError
from app.gateway.connections import Connections
from app.gateway.fetch_metadata import is_foreign
from app.gateway.forwarded import Network, Proxies
from app.gateway.origin import cookie_in, host_name, is_loopback, same_host
from app.gateway.page_secret import (
    PageProof,
    fragment,
    page_secret,
    parse_proof,
    proof_of,
    view_ticket,
)
from app.gateway.roles import OPERATORS_ONLY, Access, Proof, Role, allows
from app.gateway.throttle import Throttle, TooManyGuesses
from app.gateway.tokens import GIVEN, Token, TokenStore, cookie_of, sha256

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
SIGN_IN_FIRST = (
    "sign in first: send 'Authorization: Bearer TOKEN', or open the link that the server printed"
)

SHOW_THE_PAGE = (
    "the cookie alone does not open this: only the page that was signed in has the other half "
    "(header Farhand-Page); sign in anew, or send 'Authorization: Bearer TOKEN'"
)

Credential = Literal["bearer", "page", "ticket", "cookie"]
"""A program's token; a cookie with the page's half; with a ticket for pictures; and by itself."""


@dataclass(frozen=True)
class Identity:
    """Who sent a request."""

    token: str
    """Id of the token."""
    role: Role
    credential: Credential
    browser: str = ""
    """What tells a browser from others with the same token; empty for programs."""


def identity_of(scope: Mapping[str, Any]) -> Identity | None:
    """Who sent the request of this ASGI scope, as the guard found; None: not signed in."""
    found = scope.get("farhand.identity")
    return found if isinstance(found, Identity) else None


class SignedIn(NamedTuple):
    """What a browser is given."""

    cookie: str
    """The value of ``Set-Cookie``."""
    fragment: str
    """For the end of the page's address: the half that the page keeps."""


class Gatekeeper:
    """Checks requests by their headers and where they come from.

    Args:
        tokens: Known tokens.
        secure: Whether browsers come over HTTPS, so that the cookie must never leave it.
        hosts: Host names that requests may be addressed to; empty: any.
        proxies: Networks of the proxy in front; None: there is none.
    """

    def __init__(
        self,
        tokens: TokenStore,
        *,
        secure: bool,
        hosts: Callable[[], Sequence[str]] = tuple,
        proxies: Sequence[Network | Literal["gateway"]] | None = None,
    ) -> None:
        self._tokens = tokens
        # __Host-: browsers take it over HTTPS alone, for this very host and all of its paths, so
        # that no neighbour's page can plant one (RFC 6265bis section 4.1.3.2).
        self.cookie_name = f"{'__Host-' if secure else ''}farhand_{tokens.server}"
        self._secure = secure
        self._hosts = hosts
        self._proxies = None if proxies is None else Proxies(proxies)
        self.throttle = Throttle()
        self.connections = Connections(tokens)

    @classmethod
    def from_settings(
        cls,
        settings: Settings,
        tokens: TokenStore,
        certified: Callable[[], Sequence[str]] | None = None,
    ) -> "Gatekeeper":
        """The gatekeeper of a server with these settings.

        ``certified`` asks for the names that the certificate made here holds, if one was made.
        """
        given = [host.lower().strip("[]") for host in settings.gateway.allowed_hosts]
        if is_loopback(settings.host):
            given += ["localhost", "127.0.0.1", "::1", settings.host]
        own = certified or tuple
        secure = certified is not None or settings.tls_cert is not None or settings.behind_proxy
        return cls(
            tokens,
            secure=secure,
            hosts=lambda: (*given, *own()),
            proxies=settings.proxy_addresses if settings.behind_proxy else None,
        )

    def set_cookie_header(self, secret: str | None) -> str:
        """The value of ``Set-Cookie`` that signs a browser in with this token; None: out."""
        value, age = (cookie_of(secret), "") if secret is not None else ("", "; Max-Age=0")
        secure = "; Secure" if self._secure else ""
        return f"{self.cookie_name}={value}; Path=/; HttpOnly; SameSite=Strict{age}{secure}"

    def client(self, scope: Mapping[str, Any]) -> str:
        """Where a request comes from; behind a proxy, what the proxy says of it.

        Raises:
            NotAllowed: it did not come through the proxy.
        """
        if self._proxies is not None:
            return self._proxies.client(scope)
        return str((scope.get("client") or ("",))[0])

    def check_host(self, headers: Headers) -> None:
        """Refuse requests addressed to a foreign name (DNS rebinding).

        Raises:
            RequestError: the Host header is missing, twice there, or names another host.
        """
        given = headers.getlist("host")
        host = given[0] if len(given) == 1 else ""
        hosts = self._hosts()
        if len(given) > 1 or (hosts and host_name(host) not in hosts):
            raise RequestError(
                f"this server does not answer for the host {host[:100]!r}; "
                "--allowed-host names it more hosts",
                code="host_refused",
                host=host[:100],
            )

    def check_origin(self, headers: Headers) -> None:
        """Refuse what a page that is not this server's sends.

        Browsers add cookies by themselves, whoever's page asks; only ``Origin`` tells.

        Raises:
            NotAllowed: the page is another's, or there is no telling.
        """
        origin = headers.get("origin", "")
        if not same_host(origin, headers.get("host", ""), secure=self._secure):
            raise NotAllowed(
                f"a request from {origin[:100] or 'an unknown origin'} may not use the cookie "
                "of this server",
                code="foreign_origin",
                origin=origin[:100],
            )

    def sign_in(self, secret: str, client: str) -> SignedIn | None:
        """What a browser is given for a token that a person gave, or None for a wrong one.

        Raises:
            TooManyGuesses: not looked at.
        """
        token = self._by_secret(secret, client)
        if token is None:
            return None
        return SignedIn(self.set_cookie_header(secret), fragment(token.sha256))

    def identify(self, headers: Headers, client: str = "", ticket: str = "") -> Identity | None:
        """Who sends a request, if that can be told.

        ``ticket`` is what its address has of that kind.

        Raises:
            TooManyGuesses: the bearer token was not looked at.
        """
        authorization = headers.get("authorization")
        if authorization is not None:
            # A wrong bearer token is an error even beside a good cookie.
            scheme, _, given = authorization.partition(" ")
            if scheme.lower() != "bearer":
                return None
            token = self._by_secret(given.strip(), client)
            return None if token is None else Identity(token.id, token.role, "bearer")
        value = cookie_in(headers, self.cookie_name)
        if value is None or is_foreign(headers):
            return None
        token = self._by_cookie(value, client)
        if token is None:
            return None
        proof = proof_of(headers)
        if proof is not None and self._fits(proof, page_secret(token.sha256), client):
            return Identity(token.id, token.role, "page", proof.browser)
        shown = parse_proof(ticket)
        if shown is not None and self._fits(shown, view_ticket(token.sha256), client):
            return Identity(token.id, token.role, "ticket", shown.browser)
        return Identity(token.id, token.role, "cookie")

    def token_of(self, identity: Identity) -> Token | None:
        """The token by which somebody came in, if it is still good."""
        return self._tokens.by_id(identity.token)

    def _by_secret(self, secret: str, client: str) -> Token | None:
        """The token itself, if it is right.

        Raises:
            TooManyGuesses: it was not looked at.
        """
        token = self._tokens.by_secret(secret)
        return self._judged(token, sha256(secret), client)

    def _by_cookie(self, value: str, client: str) -> Token | None:
        """The token of a cookie. Where one too many was wrong, an unknown one is none."""
        try:
            return self._judged(self._tokens.by_cookie(value), sha256(value), client)
        except TooManyGuesses:
            return None

    def _judged(self, token: Token | None, digest: str, client: str) -> Token | None:
        """Count what was wrong, and look at nothing more of an address that was wrong too often.

        A token made here is 256 random bits, which nobody finds by guessing: a right one is let in
        whatever others at the same address sent. One that a person chose is not looked at then.

        Raises:
            TooManyGuesses: with the seconds to wait.
        """
        if token is not None and token.id != GIVEN:
            return token
        if not self.throttle.knows(client, digest):
            self.throttle.check(client, digest)
        if token is None:
            self.throttle.failed(client, digest)
            return None
        self.throttle.succeeded(client, digest)
        return token

    def _fits(self, proof: PageProof, wanted: str, client: str) -> bool:
        if hmac.compare_digest(proof.secret, wanted):
            return True
        self.throttle.failed(client, sha256(proof.secret))
        return False

    def admit(
        self,
        headers: Headers,
        method: str,
        *,
        websocket: bool,
        access: Access = "signed in",
        proof: Proof = "page",
        client: str = "",
        ticket: str = "",
    ) -> Identity:
        """Let a request in.

        Args:
            headers: Its headers.
            method: Its method.
            websocket: Whether it is a WebSocket's handshake.
            access: Who may.
            proof: What a browser has to show beside its cookie.
            client: Where it comes from.
            ticket: What its address has of that kind.

        Raises:
            NotSignedIn: no token or cookie, or a wrong one, or only half of what is needed.
            NotAllowed: a cookie came from another site's page, or the role may not do this.
            TooManyGuesses: too many wrong tokens came from there.
        """
        by_cookie = "authorization" not in headers and cookie_in(headers, self.cookie_name)
        if by_cookie and (websocket or method not in SAFE_METHODS):
            self.check_origin(headers)
        identity = self.identify(headers, client, ticket if proof == "ticket" else "")
        if identity is None:
            raise NotSignedIn(SIGN_IN_FIRST)
        if identity.credential == "cookie" and proof != "cookie":
            raise NotSignedIn(SHOW_THE_PAGE)
        if not allows(access, identity.role):
            raise NotAllowed(OPERATORS_ONLY)
        return identity
