"""Who may do what: every route and every message of the server stands here, or it is refused.

Operators drive, reset, teach and look; observers look. Anyone signed in can stop the robot. An
application with a route that is missing here is not made (:func:`check_routes`), and a request that
no row fits never reaches a route (:mod:`app.gateway.guard`).
"""

import re
from collections.abc import Iterable, Iterator
from typing import Any, Literal, NamedTuple

from starlette.routing import Mount, compile_path

from app.errors import CannotStart

Role = Literal["operator", "observer"]
Access = Literal["anyone", "signed in", "operator"]
"""Who may: anyone; operators and observers; operators alone."""

Proof = Literal["cookie", "ticket", "page"]
"""What a browser has to show: its cookie alone; a ticket beside it; or the half its page holds."""

WEBSOCKET = "WEBSOCKET"
"""Stands for the method of a WebSocket's handshake."""

ROUTES: dict[str, Access] = {
    # The door
    "GET /": "anyone",  # shows the page to who is signed in, and asks others to sign in
    "GET /signin": "anyone",
    "POST /signin": "anyone",
    "GET /api/health": "anyone",  # one word; the details to who is signed in
    "GET /trust": "anyone",
    "GET /trust/ca.pem": "anyone",
    "GET /trust/ca.crt": "anyone",
    # Stopping
    "POST /api/robots/{id}/stop": "signed in",
    # Oneself
    "GET /api/session": "signed in",
    "POST /api/sign-out": "signed in",
    # Looking
    "GET /static/{path:path}": "signed in",
    "HEAD /static/{path:path}": "signed in",
    "GET /docs": "signed in",
    "GET /openapi.json": "signed in",
    "GET /metrics": "signed in",
    "GET /api/gestures": "signed in",
    "GET /api/gestures/confusions": "signed in",
    "GET /api/gestures/{id}": "signed in",
    "GET /api/gestures/{id}/template.png": "signed in",
    "GET /api/gestures/{id}/versions": "signed in",
    "GET /api/galleries": "signed in",
    "GET /api/galleries/{id}/export": "signed in",
    "GET /api/galleries/{id}/settings": "signed in",
    "GET /api/robots": "signed in",
    "GET /api/robots/{id}": "signed in",
    "GET /api/cameras": "signed in",
    "GET /api/cameras/{name}.jpg": "signed in",
    "GET /api/cameras/{name}.mjpeg": "signed in",
    "GET /api/timeline": "signed in",  # of sign-ins that failed, operators alone
    "GET /api/timeline.jsonl": "signed in",
    "GET /api/timeline/{id}/picture.jpg": "signed in",
    "GET /api/timeline/{id}/template.png": "signed in",
    "WEBSOCKET /ws/camera/{name}": "signed in",
    "WEBSOCKET /ws/operator": "signed in",  # what may be sent there: MESSAGES
    "GET /viser": "signed in",
    "GET /viser/": "signed in",
    "WEBSOCKET /viser": "signed in",
    "WEBSOCKET /viser/": "signed in",
    # Driving and teaching
    "POST /api/robots/{id}/reset": "operator",
    "POST /api/robots/{id}/scene/reset": "operator",
    "POST /api/recognise": "operator",
    "POST /api/gestures": "operator",
    "POST /api/gestures/check": "operator",
    "PATCH /api/gestures/{id}": "operator",
    "DELETE /api/gestures/{id}": "operator",
    "POST /api/gestures/{id}/samples": "operator",
    "DELETE /api/gestures/{id}/samples/{sample}": "operator",
    "POST /api/gestures/{id}/samples/{sample}/move": "operator",
    "POST /api/gestures/{id}/versions/{version}/restore": "operator",
    "POST /api/changes/{id}/undo": "operator",
    "POST /api/galleries": "operator",
    "PATCH /api/galleries/{id}": "operator",
    "DELETE /api/galleries/{id}": "operator",
    "POST /api/galleries/{id}/import": "operator",
    "POST /api/galleries/{id}/matrix": "operator",
    "GET /api/jobs/{id}": "operator",
    "DELETE /api/jobs/{id}": "operator",
    "PATCH /api/galleries/{id}/settings": "operator",
    "POST /api/robots/{id}/dry-run": "operator",
    "DELETE /api/robots/{id}/dry-run/{view}": "operator",
}

PROOFS: dict[str, Proof] = {
    # The page's own files, which everybody who has Farhand has.
    "GET /": "cookie",
    "GET /static/{path:path}": "cookie",
    "HEAD /static/{path:path}": "cookie",
    "GET /docs": "cookie",
    "GET /openapi.json": "cookie",
    "GET /viser": "cookie",
    "GET /viser/": "cookie",
    # What a page shows by its address alone.
    "GET /api/gestures/{id}/template.png": "ticket",
    "GET /api/timeline/{id}/picture.jpg": "ticket",
    "GET /api/timeline/{id}/template.png": "ticket",
    "WEBSOCKET /viser": "ticket",
    "WEBSOCKET /viser/": "ticket",
}
"""What opens less than the page's half does (:mod:`app.gateway.page_secret`); all else needs it."""

FRAME = "frame"
"""Stands for a webcam frame, which has no type."""
OPERATORS_ONLY = "an observer looks and can stop the robot; this needs an operator"
MESSAGES: dict[str, Access] = {
    "stop": "signed in",
    "view": "signed in",
    "ping": "signed in",
    "speed": "signed in",  # of this session's own driving: moves nothing by itself
    "picture": "signed in",
    FRAME: "operator",
    "take_control": "operator",
    "release_control": "operator",
    "ask_control": "operator",
    "keep_control": "operator",
    "hand_over": "operator",
    "jog": "operator",
    "use_gallery": "operator",
    "arm": "operator",
    "disarm": "operator",
    "reset": "operator",
}
"""What may be sent on ``/ws/operator``."""


def allows(access: Access, role: Role | None) -> bool:
    """Whether somebody may; ``role`` is None for who is not signed in."""
    if access == "operator":
        return role == "operator"
    return access == "anyone" or role is not None


def may_send(kind: str, role: Role) -> bool:
    """Whether a session may send a message of this type; one that is not known, nobody may."""
    access = MESSAGES.get(kind)
    return access is not None and allows(access, role)


class _Row(NamedTuple):
    method: str
    path: str
    access: Access
    proof: Proof
    regex: re.Pattern[str]


def _rows() -> tuple[_Row, ...]:
    rows = []
    for key, access in ROUTES.items():
        method, path = key.split(" ", 1)
        # The router's own way of reading a path, so that both find the same row.
        rows.append(_Row(method, path, access, PROOFS.get(key, "page"), compile_path(path)[0]))
    # /api/gestures/check is not a gesture: rows without names in braces go first.
    return tuple(sorted(rows, key=lambda row: "{" in row.path))


_ROWS = _rows()


class Found(NamedTuple):
    """What the table says of a request."""

    access: Access | None
    """None: no such route, or not by this method."""
    methods: tuple[str, ...]
    """Methods that the path has."""
    proof: Proof
    """What a browser has to show."""


def find(method: str, path: str) -> Found:
    """Look a request up. ``path`` is that below the prefix that a proxy adds."""
    fitting = [row for row in _ROWS if row.regex.match(path)]
    row = next((row for row in fitting if row.method == method), None)
    methods = tuple(sorted({row.method for row in fitting} - {WEBSOCKET}))
    if row is None:
        return Found(None, methods, "page")
    return Found(row.access, methods, row.proof)


def routes_of(routes: Iterable[Any], prefix: str = "") -> Iterator[str]:
    """``METHOD /path`` of all routes, as they stand in :data:`ROUTES`.

    Raises:
        CannotStart: a route is of a kind that the table cannot hold.
    """
    for route in routes:
        path = prefix + str(getattr(route, "path", ""))
        if isinstance(route, Mount):
            yield from (f"{method} {path}/{{path:path}}" for method in ("GET", "HEAD"))
        elif hasattr(route, "original_router"):
            # FastAPI keeps what include_router() was given as one entry.
            inner = route.original_router
            yield from routes_of(inner.routes, prefix + route.include_context.prefix)
        elif hasattr(route, "path"):
            methods = getattr(route, "methods", None) or {WEBSOCKET}
            yield from (f"{method} {path}" for method in sorted(methods))
        else:
            raise CannotStart(f"app/gateway/roles.py cannot hold a route of kind {type(route)}")


def check_routes(routes: Iterable[Any]) -> None:
    """Refuse an application that has a route of which the table does not say who may use it.

    Raises:
        CannotStart: with the routes that are missing.
    """
    missing = [key for key in routes_of(routes) if key not in ROUTES and not _is_below_another(key)]
    if missing:
        raise CannotStart(f"app/gateway/roles.py does not say who may use {', '.join(missing)}")
    if stray := PROOFS.keys() - ROUTES.keys():
        raise CannotStart(f"app/gateway/roles.py has no row for {', '.join(sorted(stray))}")


def check_messages(kinds: Iterable[str]) -> None:
    """The same for the messages of ``/ws/operator``.

    Raises:
        CannotStart: with the types that are missing.
    """
    missing = [kind for kind in kinds if kind not in MESSAGES]
    if missing:
        raise CannotStart(f"app/gateway/roles.py does not say who may send {', '.join(missing)}")


def _is_below_another(key: str) -> bool:
    """Whether a folder of files lies in one that stands in the table."""
    method, _, path = key.partition(" ")
    folder = path.removesuffix("/{path:path}")
    return folder != path and any(
        row.method == method
        and row.path.endswith("/{path:path}")
        and folder.startswith(row.path.removesuffix("{path:path}"))
        for row in _ROWS
    )
