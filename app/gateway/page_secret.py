"""The second half of a browser's sign-in: a secret that the page holds and that no cookie carries.

Cookies do not tell the ports of a host apart (RFC 6265 section 8.5): whatever listens on another
port is sent this server's cookie as soon as the browser opens it, and can use it from anywhere.
What a page keeps in ``localStorage`` belongs to one origin, port included. So the cookie alone
opens the page's own files, which are no secret, and everything else needs both halves.

Both are derived from the token. The page's half comes from the hash that the server keeps, so that
tokens made before there was one have it, too; the cookie cannot be made from that hash.
"""

import hashlib
import hmac
import re
from collections.abc import Iterable, MutableMapping
from typing import Any, NamedTuple

from starlette.datastructures import Headers

PAGE_HEADER = "Farhand-Page"
PROTOCOL = "farhand.v1"
"""The WebSocket subprotocol that the server chooses; a browser fails a handshake without one."""
PAGE_PROTOCOL = "farhand.page."
"""The subprotocol that carries the page's half: browsers let a page set no header there."""

_PROOF = re.compile(r"([0-9a-f]{64})\.([0-9a-f]{16})")


class PageProof(NamedTuple):
    """What a page shows of itself."""

    secret: str
    """64 hexadecimal digits: the page's half, or a ticket."""
    browser: str
    """16 hexadecimal digits that the browser chose: its sign-out ends its own work alone."""


def page_secret(token_sha256: str) -> str:
    """The page's half for the token with this hash: opens everything, beside the cookie."""
    return _derived(token_sha256, b"farhand page 1")


def view_ticket(token_sha256: str) -> str:
    """Stands in the addresses of pictures and of the 3D view, which cannot have a header.

    Opens these alone, and only beside the cookie: a proxy may log it.
    """
    return _derived(token_sha256, b"farhand view 1")


def _derived(token_sha256: str, purpose: bytes) -> str:
    return hmac.new(bytes.fromhex(token_sha256), purpose, hashlib.sha256).hexdigest()


def fragment(token_sha256: str) -> str:
    """What the page is told when somebody signs in, for the end of its address.

    Browsers keep a fragment to themselves; the page takes it out of the address at once.
    """
    return f"#page={page_secret(token_sha256)}.{view_ticket(token_sha256)}"


def parse_proof(text: str) -> PageProof | None:
    """``SECRET.BROWSER``, or None for anything else."""
    found = _PROOF.fullmatch(text)
    return None if found is None else PageProof(found[1], found[2])


def proof_of(headers: Headers) -> PageProof | None:
    """What a request shows: in its header, or in the subprotocols of a WebSocket's handshake."""
    for name in _protocols(headers.getlist("sec-websocket-protocol")):
        if name.startswith(PAGE_PROTOCOL):
            return parse_proof(name.removeprefix(PAGE_PROTOCOL))
    return parse_proof(headers.get(PAGE_HEADER, ""))


def hide_proof(scope: MutableMapping[str, Any]) -> str | None:
    """Take our subprotocols out of a handshake, so that nothing behind the door sees them.

    Returns:
        The subprotocol to choose if the application chooses none; None when ours is not offered.
    """
    offered = [name for name in scope.get("subprotocols", ()) if not name.startswith(PAGE_PROTOCOL)]
    scope["subprotocols"] = [name for name in offered if name != PROTOCOL]
    hidden = (PAGE_HEADER.lower().encode(), b"sec-websocket-protocol")
    kept = [field for field in scope["headers"] if field[0] not in hidden]
    if scope["subprotocols"]:
        kept.append((b"sec-websocket-protocol", ", ".join(scope["subprotocols"]).encode("latin-1")))
    scope["headers"] = kept
    return PROTOCOL if PROTOCOL in offered else None


def _protocols(fields: Iterable[str]) -> Iterable[str]:
    return (name.strip() for field in fields for name in field.split(","))
