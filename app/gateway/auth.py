"""Who may come in: tokens as bearers for programs, and as cookies for browsers."""

import asyncio
import ipaddress
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from typing import Any, Literal
from urllib.parse import urlsplit

from starlette.datastructures import Headers

from app.config import Settings
from app.errors import NotAllowed, NotSignedIn, RequestError
from app.gateway.machine import parse_address
from app.gateway.roles import OPERATORS_ONLY, Access, Role, allows
from app.gateway.throttle import Throttle
from app.gateway.tokens import TokenStore, cookie_of, sha256

log = logging.getLogger(__name__)

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
REVOKED_CHECK_S = 0.5
SIGN_IN_FIRST = (
    "sign in first: send 'Authorization: Bearer TOKEN', or open the link that the server printed"
)

Credential = Literal["bearer", "cookie"]


@dataclass(frozen=True)
class Identity:
    """Who sent a request."""

    token: str
    """Id of the token."""
    role: Role
    credential: Credential


def identity_of(scope: Mapping[str, Any]) -> Identity | None:
    """Who sent the request of this ASGI scope, as the guard found; None: not signed in."""
    found = scope.get("farhand.identity")
    return found if isinstance(found, Identity) else None


def is_loopback(host: str) -> bool:
    """Whether an address to listen on reaches this machine alone."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def host_name(authority: str) -> str:
    """The host of ``host:port``, lower case, without brackets; empty when there is none."""
    try:
        return urlsplit(f"//{authority}").hostname or ""
    except ValueError:
        return ""


def same_host(origin: str, host: str, *, secure: bool = False) -> bool:
    """Whether an ``Origin`` header names the host and port that the request was sent to.

    The scheme has to be https where ``secure`` is set; elsewhere it is not compared, since a tunnel
    that nobody told us of may end in front of us.
    """
    try:
        parts = urlsplit(origin)
        default = {"http": 80, "https": 443}.get(parts.scheme)
        other = urlsplit(f"//{host}")
        if default is None or not parts.hostname or (secure and parts.scheme != "https"):
            return False
        return (parts.hostname, parts.port or default) == (other.hostname, other.port or default)
    except ValueError:
        return False


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
        proxies: Sequence[ipaddress.IPv4Network | ipaddress.IPv6Network] | None = None,
    ) -> None:
        self._tokens = tokens
        # __Host-: browsers take it over HTTPS alone, for this very host and all of its paths, so
        # that no neighbour's page can plant one (RFC 6265bis section 4.1.3.2).
        self.cookie_name = f"{'__Host-' if secure else ''}farhand_{tokens.server}"
        self._secure = secure
        self._hosts = hosts
        self._proxies = proxies
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

    def set_cookie_header(self, secret: str) -> str:
        """The value of ``Set-Cookie`` that signs a browser in with this token."""
        secure = "; Secure" if self._secure else ""
        return f"{self.cookie_name}={cookie_of(secret)}; Path=/; HttpOnly; SameSite=Strict{secure}"

    def client(self, scope: Mapping[str, Any]) -> str:
        """Where a request comes from; behind a proxy, what the proxy says of it.

        Raises:
            NotAllowed: it did not come through the proxy.
        """
        peer = str((scope.get("client") or ("",))[0])
        if self._proxies is None:
            return peer
        if not self._is_proxy(peer):
            raise NotAllowed(
                "this server is reached through the proxy in front of it; if that is what you are, "
                "start the server with --proxy-address and your address",
                code="not_through_proxy",
            )
        forwarded = ",".join(Headers(scope=dict(scope)).getlist("x-forwarded-for")).split(",")
        # The last entry is the proxy's own word; those before it are whatever the client sent.
        for entry in reversed([part.strip() for part in forwarded if part.strip()]):
            if not self._is_proxy(entry):
                return entry[:64]
        return peer

    def _is_proxy(self, text: str) -> bool:
        address = parse_address(text)
        return address is not None and any(address in each for each in self._proxies or ())

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

    def sign_in(self, secret: str, client: str) -> str | None:
        """The ``Set-Cookie`` value for a token that a person gave, or None for a wrong one.

        Raises:
            TooManyGuesses: not looked at.
        """
        digest = sha256(secret)
        if not self.throttle.knows(client, digest):
            self.throttle.check(client, digest)
        if self._tokens.by_secret(secret) is None:
            self.throttle.failed(client, digest)
            return None
        self.throttle.succeeded(client, digest)
        return self.set_cookie_header(secret)

    def identify(self, headers: Headers, client: str = "") -> Identity | None:
        """Who sends a request, if that can be told.

        Raises:
            TooManyGuesses: the bearer token was not looked at.
        """
        authorization = headers.get("authorization")
        if authorization is not None:
            # A wrong bearer token is an error even beside a good cookie.
            scheme, _, given = authorization.partition(" ")
            return self._bearer(given.strip(), client) if scheme.lower() == "bearer" else None
        for header in headers.getlist("cookie"):
            try:
                morsel = SimpleCookie(header).get(self.cookie_name)
            except CookieError:
                continue
            token = None if morsel is None else self._tokens.by_cookie(morsel.value)
            if token is not None:
                return Identity(token.id, token.role, "cookie")
        return None

    def _bearer(self, secret: str, client: str) -> Identity | None:
        digest = sha256(secret)
        if not self.throttle.knows(client, digest):
            self.throttle.check(client, digest)
        token = self._tokens.by_secret(secret)
        if token is None:
            self.throttle.failed(client, digest)
            return None
        self.throttle.succeeded(client, digest)
        return Identity(token.id, token.role, "bearer")

    def admit(
        self,
        headers: Headers,
        method: str,
        *,
        websocket: bool,
        access: Access = "signed in",
        client: str = "",
    ) -> Identity:
        """Let a request in.

        Raises:
            NotSignedIn: no token or cookie, or a wrong one.
            NotAllowed: a cookie came from another site's page, or the role may not do this.
            TooManyGuesses: too many wrong tokens came from there.
        """
        identity = self.identify(headers, client)
        if identity is None:
            raise NotSignedIn(SIGN_IN_FIRST)
        if identity.credential == "cookie" and (websocket or method not in SAFE_METHODS):
            # Browsers add cookies by themselves, whoever's page asks; only Origin tells.
            origin = headers.get("origin", "")
            if not same_host(origin, headers.get("host", ""), secure=self._secure):
                raise NotAllowed(
                    f"a request from {origin[:100] or 'an unknown origin'} may not use the cookie "
                    "of this server",
                    code="foreign_origin",
                    origin=origin[:100],
                )
        if not allows(access, identity.role):
            raise NotAllowed(OPERATORS_ONLY)
        return identity


class Connections:
    """What is open now, by token, so that it ends when the token does."""

    def __init__(self, tokens: TokenStore) -> None:
        self._tokens = tokens
        self._open: dict[Callable[[], None], str] = {}

    def check(self, identity: Identity | None) -> None:
        """Do nothing if this token still opens something.

        Raises:
            NotSignedIn: it was revoked, or ran out.
        """
        if identity is not None and not self._tokens.is_alive(identity.token):
            raise NotSignedIn("the token was revoked or ran out; nothing was changed")

    @contextmanager
    def kept(self, identity: Identity, end: Callable[[], None]) -> Iterator[None]:
        """Meanwhile ``end`` is called when the token has run out or was revoked."""
        self._open[end] = identity.token
        try:
            yield
        finally:
            self._open.pop(end, None)

    async def watch(self) -> None:
        """End what has lost its token, for ever."""
        while True:
            await asyncio.sleep(REVOKED_CHECK_S)
            alive = {id: self._tokens.is_alive(id) for id in set(self._open.values())}
            for end, id in tuple(self._open.items()):
                if not alive[id]:
                    log.info("a connection is closed: its token %s opens nothing any more", id)
                    end()
