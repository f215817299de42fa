"""What the server says once it runs: the links that sign people in."""

import contextlib
import os
import socket
import sys
from typing import TextIO

import segno

from app.config import Settings
from app.gateway.machine import Names
from app.gateway.tls import LocalAuthority
from app.gateway.tokens import START_KEPT, START_LIFETIME, START_NAME, TokenStore

ADDRESS_FILE = "address"
"""In the data folder: where this server was last reached, for ``farhand token make``."""


def address(
    settings: Settings, port: int, authority: LocalAuthority | None, host: str | None = None
) -> str:
    """The server's address, with a slash at its end; by its name unless ``host`` is given."""
    secure = settings.tls_cert is not None or authority is not None
    if host is None:
        host = settings.host
        if host in ("0.0.0.0", "::", ""):
            host = socket.gethostname().lower() or "localhost"
            if authority is not None and host not in authority.names.dns:
                host = next(iter(reachable(authority.names)), "localhost")
    if ":" in host:
        host = f"[{host}]"
    return f"{'https' if secure else 'http'}://{host}:{port}{settings.root_path}/"


def reachable(names: Names) -> list[str]:
    """The addresses by which other machines reach this one, those of IPv4 first."""
    return [str(each) for each in names.addresses if not each.is_loopback]


def link(address: str, secret: str) -> str:
    """The address that signs a browser in."""
    return f"{address}?token={secret}"


def greet(
    settings: Settings,
    port: int,
    tokens: TokenStore,
    authority: LocalAuthority | None,
    out: TextIO | None = None,
) -> None:
    """Print the operator's link; on a terminal also what helps a person to use it.

    Raises:
        CannotStart: no token can be kept.
    """
    out = out or sys.stdout
    base = address(settings, port, authority)
    _remember(settings, base)
    if settings.token is not None:
        operator = settings.token.get_secret_value()
    else:
        operator = tokens.make("operator", START_NAME, START_LIFETIME, keep=START_KEPT).secret
    out.write(f"{link(base, operator)}\n")
    if out.isatty():
        observer = tokens.make("observer", START_NAME, START_LIFETIME, keep=START_KEPT).secret
        # A phone rarely knows the name of a machine, and always an address of its own network.
        others = reachable(authority.names) if authority is not None else []
        near = address(settings, port, authority, others[0]) if others else base
        for who, secret in (("to drive (operator)", operator), ("to watch (observer)", observer)):
            out.write(f"\n{who}: {link(near, secret)}\n\n")
            print_code(link(near, secret), out)
        for other in others[1:]:
            out.write(f"also at {address(settings, port, authority, other)}\n")
        if authority is not None:
            out.write(
                f"\nThe browser will warn until it trusts this server: {near}trust says how.\n"
                f"Fingerprint of the authority (SHA-256): {authority.public.fingerprint}\n"
            )
        out.write("More links, and taking them back: farhand token\n")
    out.flush()


def print_code(text: str, out: TextIO) -> None:
    """Draw ``text`` as a QR code."""
    segno.make(text, error="l", micro=False).terminal(out=out, compact=True, border=2)


def last_address(settings: Settings) -> str | None:
    """Where the server of this data folder was last reached; None before its first start."""
    try:
        return (settings.data_dir / ADDRESS_FILE).read_text().strip()
    except (OSError, UnicodeDecodeError):
        return None


def _remember(settings: Settings, base: str) -> None:
    with contextlib.suppress(OSError):
        path = settings.data_dir / ADDRESS_FILE
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(handle, "w") as file:
            file.write(f"{base}\n")
