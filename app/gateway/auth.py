"""Who may come in: one secret, as a bearer token for programs and as a cookie for browsers."""

import hashlib
import hmac
import ipaddress
import logging
import os
import secrets
from collections.abc import Sequence
from http.cookies import CookieError, SimpleCookie
from typing import Literal
from urllib.parse import urlsplit

from starlette.datastructures import Headers

from app.config import Settings
from app.errors import CannotStart, NotAllowed, NotSignedIn, RequestError

log = logging.getLogger(__name__)

TOKEN_FILE = "token"
TOKEN_BYTES = 32
"""256 bits, written in 43 characters."""
SHORT_TOKEN = 22
"""Characters; 22 of base64url are 128 bits."""
SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})

Credential = Literal["bearer", "cookie"]


def load_token(settings: Settings) -> str:
    """The secret: the one given, or the one kept in the data folder, made there when missing.

    Raises:
        CannotStart: the given token is empty or not ASCII, or the file cannot be read or written.
    """
    if settings.token is not None:
        token = settings.token.get_secret_value()
        if not token or not token.isascii() or not token.isprintable() or " " in token:
            raise CannotStart("the token must be printable ASCII without spaces, and not empty")
        if len(token) < SHORT_TOKEN:
            log.warning("the token is short; %d characters or more resist guessing", SHORT_TOKEN)
        return token
    path = settings.data_dir / TOKEN_FILE
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            # O_EXCL: of two servers that start at once, one makes the token and both use it.
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        except FileExistsError:
            token = path.read_text(encoding="ascii").strip()
            if len(token) >= SHORT_TOKEN:
                path.chmod(0o600)
                return token
            handle = os.open(path, os.O_WRONLY | os.O_TRUNC, 0o600)
        token = secrets.token_urlsafe(TOKEN_BYTES)
        with os.fdopen(handle, "w") as file:
            file.write(token + "\n")
    except (OSError, UnicodeDecodeError) as error:
        raise CannotStart(
            f"the token file {path} cannot be used ({error}); "
            "choose another --data-dir or give --token",
            path=str(path),
        ) from error
    return token


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


def same_host(origin: str, host: str) -> bool:
    """Whether an ``Origin`` header names the host and port that the request was sent to.

    The schemes are not compared: behind a proxy ours is http and the browser's https.
    """
    try:
        parts = urlsplit(origin)
        default = {"http": 80, "https": 443}.get(parts.scheme)
        other = urlsplit(f"//{host}")
        if default is None or not parts.hostname:
            return False
        return (parts.hostname, parts.port or default) == (other.hostname, other.port or default)
    except ValueError:
        return False


class Gatekeeper:
    """Checks requests by their headers alone; knows the secret and nothing else.

    Args:
        token: The secret.
        secure: Whether browsers come over HTTPS, so that the cookie must never leave it.
        hosts: Host names that requests may be addressed to; empty: any.
    """

    def __init__(self, token: str, *, secure: bool, hosts: Sequence[str] = ()) -> None:
        self._token = token.encode()
        # The cookie is derived, so that a leaked cookie does not give the token away; its name is
        # too, because cookies do not tell ports apart and two servers may share a machine.
        self._cookie = hmac.new(self._token, b"farhand cookie 1", hashlib.sha256).hexdigest()
        name = hmac.new(self._token, b"farhand cookie name", hashlib.sha256).hexdigest()[:8]
        self.cookie_name = f"farhand_{name}"
        self._secure = secure
        self._hosts = frozenset(host.lower().strip("[]") for host in hosts)

    @classmethod
    def from_settings(cls, settings: Settings, token: str) -> "Gatekeeper":
        """The gatekeeper of a server with these settings."""
        hosts = list(settings.gateway.allowed_hosts)
        if is_loopback(settings.host):
            hosts += ["localhost", "127.0.0.1", "::1", settings.host]
        secure = settings.tls_cert is not None or settings.behind_proxy
        return cls(token, secure=secure, hosts=hosts)

    def token_fits(self, given: str) -> bool:
        """Whether ``given`` is the secret; takes as long for every wrong one."""
        return hmac.compare_digest(given.encode("utf-8", "surrogateescape"), self._token)

    def set_cookie_header(self) -> str:
        """The value of ``Set-Cookie`` that signs a browser in."""
        secure = "; Secure" if self._secure else ""
        return f"{self.cookie_name}={self._cookie}; Path=/; HttpOnly; SameSite=Strict{secure}"

    def check_host(self, headers: Headers) -> None:
        """Refuse requests addressed to a foreign name (DNS rebinding).

        Raises:
            RequestError: the Host header is missing or names another host.
        """
        host = headers.get("host", "")
        if self._hosts and host_name(host) not in self._hosts:
            raise RequestError(
                f"this server does not answer for the host {host[:100]!r}",
                code="host_refused",
                host=host[:100],
            )

    def credential(self, headers: Headers) -> Credential | None:
        """How the request proves that it knows the secret, if it does."""
        authorization = headers.get("authorization")
        if authorization is not None:
            scheme, _, given = authorization.partition(" ")
            # A wrong bearer token is an error even beside a good cookie.
            fits = scheme.lower() == "bearer" and self.token_fits(given.strip())
            return "bearer" if fits else None
        for header in headers.getlist("cookie"):
            try:
                morsel = SimpleCookie(header).get(self.cookie_name)
            except CookieError:
                continue
            if morsel is not None and hmac.compare_digest(
                morsel.value.encode(), self._cookie.encode()
            ):
                return "cookie"
        return None

    def admit(self, headers: Headers, method: str, *, websocket: bool) -> Credential:
        """Let a request in.

        Raises:
            NotSignedIn: no token or cookie, or a wrong one.
            NotAllowed: a cookie came from another site's page.
        """
        credential = self.credential(headers)
        if credential is None:
            raise NotSignedIn(
                "sign in first: send 'Authorization: Bearer TOKEN', "
                "or open the link that the server printed"
            )
        if credential == "cookie" and (websocket or method not in SAFE_METHODS):
            # Browsers add cookies by themselves, whoever's page asks; only Origin tells.
            origin = headers.get("origin", "")
            if not same_host(origin, headers.get("host", "")):
                raise NotAllowed(
                    f"a request from {origin[:100] or 'an unknown origin'} may not use the cookie "
                    "of this server",
                    code="foreign_origin",
                    origin=origin[:100],
                )
        return credential
