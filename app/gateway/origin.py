"""What requests say of hosts, origins and cookies."""

import ipaddress
from urllib.parse import urlsplit

from starlette.datastructures import Headers


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


def cookie_in(headers: Headers, name: str) -> str | None:
    """The value of the first cookie with this name, or None; of several the others are nothing.

    So a request is one guess at most, however many cookies it brings.
    """
    for header in headers.getlist("cookie"):
        for part in header.split(";"):
            key, equals, value = part.partition("=")
            if equals and key.strip() == name:
                return value.strip().strip('"')
    return None
