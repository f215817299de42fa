"""Opening a Zenoh session the one way Farhand does: known endpoints, no discovery."""

import json
from pathlib import Path

import zenoh

from app.errors import LinkFailed

SOCKET_PATH_MAX = 100
"""A unix socket's path may have 107 bytes on Linux; Zenoh adds a lock file's ending to it."""


def socket_endpoint(path: Path) -> str:
    """The Zenoh endpoint of a unix socket.

    Raises:
        LinkFailed: the path is longer than the operating system allows.
    """
    if len(str(path).encode()) > SOCKET_PATH_MAX:
        raise LinkFailed(
            f"the socket path {path} is longer than {SOCKET_PATH_MAX} bytes; "
            "choose a shorter folder for the link",
            path=str(path),
        )
    return f"unixsock-stream/{path}"


def open_session(endpoint: str, *, listen: bool) -> zenoh.Session:
    """Open a session that listens on, or connects to, exactly one endpoint.

    The robot node listens (as a Zenoh router, so that its camera process and gateways reach one
    another through it); everybody else connects as a client, which reconnects by itself when the
    node comes back. Multicast and gossip scouting are off: nothing is found that was not named.

    Raises:
        LinkFailed: the endpoint cannot be opened.
    """
    config = zenoh.Config()
    settings: dict[str, object] = {
        "mode": "router" if listen else "client",
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "scouting/delay": 0,  # nothing is scouted, so there is nothing to wait for
        "listen/endpoints": [endpoint] if listen else [],
        "connect/endpoints": [] if listen else [endpoint],
        # How soon a client is back when the node is: Zenoh's own is after 1, 3 and 7 s.
        "connect/retry": {
            "period_init_ms": 200,
            "period_max_ms": 500,
            "period_increase_factor": 1.5,
        },
    }
    for name, value in settings.items():
        config.insert_json5(name, json.dumps(value))
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise LinkFailed(f"the link {endpoint} cannot be opened: {error}") from error
