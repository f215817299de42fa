"""The door: every request and WebSocket passes here before anything else sees it."""

import logging
import time
from http import HTTPStatus

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.errors import NotAllowed, NotSignedIn, RequestError
from app.gateway.auth import Gatekeeper
from app.gateway.errors import error_response, unexpected_response
from app.gateway.pages import again_page, sign_in_page

log = logging.getLogger(__name__)
access_log = logging.getLogger("app.gateway.access")

OPEN_PATHS = frozenset({"/", "/signin", "/api/health"})
"""Reached without the secret; each of them decides itself what it shows."""

PAGE_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "media-src 'self' blob:; font-src 'self'; connect-src 'self'; worker-src 'self' blob:; "
    "manifest-src 'self'; frame-src 'self'; form-action 'self'; base-uri 'none'; "
    "frame-ancestors 'self'"
)
# viser's page is one file with everything inline, runs blob workers, and WebAssembly whose glue
# is made by eval.
VISER_POLICY = (
    "default-src 'self' data: blob:; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; "
    "style-src 'self' 'unsafe-inline'; worker-src 'self' blob:; connect-src 'self' data: blob:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)
SECURITY_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(self), microphone=(), geolocation=(), payment=(), usb=()",
}


class Guard:
    """ASGI middleware: host, sign-in, origin, security headers, access log.

    The access log has the path without its query, where a token may stand.
    """

    def __init__(self, app: ASGIApp, gatekeeper: Gatekeeper) -> None:
        self._app = app
        self._gatekeeper = gatekeeper

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Admit or refuse."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        started = time.monotonic()
        path: str = scope["path"]
        websocket = scope["type"] == "websocket"
        method: str = "WEBSOCKET" if websocket else scope["method"]
        status = 0

        async def send_on(message: Message) -> None:
            nonlocal status
            if message["type"] in ("http.response.start", "websocket.http.response.start"):
                status = message["status"]
                _add_headers(message, path)
            elif message["type"] == "websocket.accept":
                status = 101
            await send(message)

        try:
            headers = Headers(scope=scope)
            refusal = self._refusal(headers, method, path, websocket=websocket)
            if refusal is None:
                try:
                    await self._app(scope, receive, send_on)
                except Exception:
                    log.exception("%s %s failed", method, path[:200])
                    if status == 0 and not websocket:
                        await unexpected_response()(scope, receive, send_on)
                    elif status == 0:
                        await _reject(unexpected_response(), scope, send_on)
            elif websocket:
                await _reject(refusal, scope, send_on)
            else:
                await refusal(scope, receive, send_on)
        finally:
            access_log.info(
                "%s %s %s %d ms",
                method,
                path[:200],
                status or "-",
                (time.monotonic() - started) * 1e3,
            )

    def _refusal(
        self, headers: Headers, method: str, path: str, *, websocket: bool
    ) -> Response | None:
        try:
            self._gatekeeper.check_host(headers)
            if path in OPEN_PATHS and not websocket:
                return None
            self._gatekeeper.admit(headers, method, websocket=websocket)
        except NotSignedIn as error:
            if not websocket and method == "GET" and "text/html" in headers.get("accept", ""):
                return signed_out_page(headers, path)
            return error_response(error, {"WWW-Authenticate": 'Bearer realm="farhand"'})
        except (NotAllowed, RequestError) as error:
            return error_response(error)
        return None


def signed_out_page(headers: Headers, path: str, problem: str | None = None) -> Response:
    """What a signed-out browser sees.

    A link on another site's page brings no SameSite=Strict cookie even when there is one; one
    reload of our own page does. After that, or without the link, there is the token to ask for.
    """
    if headers.get("sec-fetch-site") == "cross-site" and problem is None:
        return again_page(path)
    return sign_in_page(problem)


def _add_headers(message: Message, path: str) -> None:
    headers = MutableHeaders(scope=message)
    for name, value in SECURITY_HEADERS.items():
        headers.setdefault(name, value)
    viser = path == "/viser" or path.startswith("/viser/")
    headers.setdefault("Content-Security-Policy", VISER_POLICY if viser else PAGE_POLICY)
    static = path.startswith("/static/") or viser
    # no-cache: kept, but asked about each time, so that a new version is seen at once.
    headers.setdefault("Cache-Control", "no-cache" if static else "no-store")


async def _reject(refusal: Response, scope: Scope, send: Send) -> None:
    """Refuse a WebSocket's handshake with an HTTP answer."""
    if "websocket.http.response" not in scope.get("extensions", {}):
        await send({"type": "websocket.close", "code": 1008, "reason": HTTPStatus(403).phrase})
        return
    await send(
        {
            "type": "websocket.http.response.start",
            "status": refusal.status_code,
            "headers": refusal.raw_headers,
        }
    )
    await send({"type": "websocket.http.response.body", "body": refusal.body})
