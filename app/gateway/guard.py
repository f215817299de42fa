"""The door: every request and WebSocket passes here before anything else sees it."""

import asyncio
import contextlib
import functools
import logging
import time
from http import HTTPStatus

from starlette.datastructures import Headers, MutableHeaders, QueryParams
from starlette.requests import ClientDisconnect
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.errors import NotAllowed, NotFound, NotSignedIn, RequestError
from app.gateway.auth import Gatekeeper, Identity
from app.gateway.body_watch import STRANGER_S, WatchedBody
from app.gateway.errors import error_body, error_response, unexpected_response
from app.gateway.fetch_metadata import is_foreign
from app.gateway.http_limits import is_answered, too_many_requests
from app.gateway.page_secret import hide_proof
from app.gateway.pages import again_page, sign_in_page
from app.gateway.roles import WEBSOCKET, find
from app.gateway.throttle import TooManyGuesses

log = logging.getLogger(__name__)
access_log = logging.getLogger("app.gateway.access")

CLOSE_REVOKED = 1008
REVOKED = "the token of this connection opens nothing any more"

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
    """ASGI middleware: prefix, host, sign-in, role, origin, security headers, access log.

    The access log has the path without its query, where a token may stand. What is open on a token
    ends when the token does.

    Args:
        app: What is behind the door.
        gatekeeper: Who may come in.
        prefix: The path below which a proxy shows this server; empty: none.
        body_s: How long a request's body may take to arrive.
    """

    def __init__(
        self, app: ASGIApp, gatekeeper: Gatekeeper, prefix: str = "", body_s: float = 120.0
    ) -> None:
        self._app = app
        self._gatekeeper = gatekeeper
        self._prefix = prefix
        self._body_s = body_s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Admit or refuse."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        started = time.monotonic()
        path, scope = self._below_prefix(scope)
        websocket = scope["type"] == "websocket"
        method: str = WEBSOCKET if websocket else scope["method"]
        status = 0
        protocol: str | None = None

        async def send_on(message: Message) -> None:
            nonlocal status
            if message["type"] in ("http.response.start", "websocket.http.response.start"):
                status = message["status"]
                _add_headers(message, path)
            elif message["type"] == "websocket.accept":
                status = 101
                if message.get("subprotocol") is None and protocol is not None:
                    message = {**message, "subprotocol": protocol}
            await send(message)

        try:
            refusal, identity = self._judge(scope, method, path)
            known = identity is not None or scope.get("farhand.known", False)
            if not is_answered(scope, known):
                busy = too_many_requests()
                refusal = error_response(busy, {"Retry-After": "1", "Connection": "close"})
            scope["farhand.identity"] = identity
            protocol = hide_proof(scope)
            if refusal is None:
                try:
                    await self._pass(scope, receive, send_on, identity)
                except ClientDisconnect:
                    log.debug("%s %s: the client is gone", method, path[:200])
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

    def _below_prefix(self, scope: Scope) -> tuple[str, Scope]:
        """The path below the prefix, and the scope in which the path has it.

        Some proxies pass the prefix on, and some cut it off; both are understood.
        """
        path: str = scope["path"]
        if not self._prefix:
            return path, dict(scope)
        if path.startswith(f"{self._prefix}/"):
            path = path.removeprefix(self._prefix)
        elif path == self._prefix:
            return "", dict(scope)
        return path, {**scope, "path": self._prefix + path, "root_path": self._prefix}

    def _judge(
        self, scope: Scope, method: str, path: str
    ) -> tuple[Response | None, Identity | None]:
        """Why a request is refused, or who sent it."""
        if not path:
            # What the page links to is relative: its own address has to end in a slash.
            return RedirectResponse(f"{self._prefix}/", 308), None
        headers = Headers(scope=scope)
        websocket = method == WEBSOCKET
        found = find(method, path)
        try:
            client = self._gatekeeper.client(scope)
            scope["farhand.client"] = client
            self._gatekeeper.check_host(headers)
            ticket = ""
            if found.proof == "ticket":
                ticket = QueryParams(scope.get("query_string", b"")).get("ticket", "")
            if found.access == "anyone":
                known = self._gatekeeper.identify(headers, client)
                half = known is not None and known.credential == "cookie"
                return None, None if half and found.proof != "cookie" else known
            identity = self._gatekeeper.admit(
                headers,
                method,
                websocket=websocket,
                access=found.access or "signed in",
                proof=found.proof,
                client=client,
                ticket=ticket,
            )
        except NotSignedIn as error:
            if not websocket and method == "GET" and "text/html" in headers.get("accept", ""):
                return signed_out_page(headers, self._prefix, path), None
            return error_response(error, {"WWW-Authenticate": 'Bearer realm="farhand"'}), None
        except TooManyGuesses as error:
            return too_many_response(error), None
        except (NotAllowed, RequestError) as error:
            # Who may not do this has shown who they are, unless nobody looked.
            scope["farhand.known"] = (
                isinstance(error, NotAllowed) and error.code != "not_through_proxy"
            )
            return error_response(error), None
        return (None if found.access else _not_there(method, path, found.methods)), identity

    async def _pass(
        self, scope: Scope, receive: Receive, send: Send, identity: Identity | None
    ) -> None:
        """Let the application answer, as long as the token lives."""
        if scope["type"] == "http":
            body_s = self._body_s if identity is not None else min(self._body_s, STRANGER_S)
            judge = functools.partial(self._gatekeeper.connections.check, identity)
            receive = WatchedBody(scope, receive, body_s, judge)
        if identity is None:
            await self._app(scope, receive, send)
            return
        websocket = scope["type"] == "websocket"
        begun = ended = False

        async def send_on(message: Message) -> None:
            nonlocal begun
            begun = begun or message["type"] in ("http.response.start", "websocket.accept")
            await send(message)

        async def answer() -> None:
            await self._app(scope, receive, send_on)

        answering = asyncio.create_task(answer())

        def end() -> None:
            # What has not begun to answer is short, and may be half way through a change.
            nonlocal ended
            if begun and not ended:
                ended = True
                answering.cancel()

        with self._gatekeeper.connections.kept(identity, end):
            try:
                await answering
            except asyncio.CancelledError:
                if not ended:
                    raise
        if not ended:
            return
        with contextlib.suppress(RuntimeError, OSError):
            if websocket:
                await send({"type": "websocket.close", "code": CLOSE_REVOKED, "reason": REVOKED})
            else:
                await send({"type": "http.response.body", "body": b"", "more_body": False})


def _not_there(method: str, path: str, methods: tuple[str, ...]) -> Response:
    """What the table of routes does not have."""
    if method == WEBSOCKET or not methods:
        return error_response(NotFound(f"there is nothing at {path[:200]}"))
    message = f"{method} is not possible at {path[:200]}"
    return JSONResponse(
        error_body("method_not_allowed", message), 405, {"Allow": ", ".join(methods)}
    )


def too_many_response(error: TooManyGuesses) -> Response:
    """429, and when to come again."""
    return error_response(error, {"Retry-After": str(error.detail.get("retry_after_s", 60))})


def signed_out_page(
    headers: Headers, prefix: str, path: str, problem: str | None = None, status: int = 401
) -> Response:
    """What a signed-out browser sees.

    A link on another site's page brings no SameSite=Strict cookie even when there is one, and that
    of a page on another port is not looked at; one reload of our own page is. After that, or
    without the link, there is the token to ask for.
    """
    if is_foreign(headers) and problem is None:
        return again_page(prefix + path)
    return sign_in_page(problem, prefix=prefix, status=status)


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
