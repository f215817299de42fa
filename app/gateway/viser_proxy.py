"""The 3D view's page and WebSocket, reached through the gateway's own port and its sign-in.

viser listens on loopback and asks nobody who they are; so nothing but this proxy knows its port.
"""

import asyncio
import contextlib
import logging
from typing import TYPE_CHECKING

import httpx
from fastapi import APIRouter, Request
from starlette.responses import RedirectResponse, Response
from starlette.websockets import WebSocket, WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.typing import Subprotocol

from app.errors import WorldError
from app.gateway.errors import error_response
from app.gateway.viser_rehearsal import VIEW_ID

if TYPE_CHECKING:
    from app.gateway.hub import Hub

log = logging.getLogger(__name__)

router = APIRouter(include_in_schema=False)

MAX_MESSAGE_BYTES = 50 << 20
"""viser's own limit."""
START_WAIT_S = 20.0
_FORWARDED = ("content-type", "content-encoding", "etag", "last-modified")


class ViewerUnavailable(WorldError):
    """The 3D view is off or does not answer."""

    default_code = "viewer_unavailable"


async def _port(hub: "Hub") -> int:
    """The port of viser, which may still be starting.

    Raises:
        ViewerUnavailable: it is switched off, or takes too long to start.
    """
    if hub.viser is None:
        raise ViewerUnavailable("the 3D view is switched off (setting gateway.viser)")
    port = await asyncio.to_thread(hub.viser.wait_port, START_WAIT_S)
    if port is None:
        raise ViewerUnavailable("the 3D view is still starting; try again")
    return port


@router.get("/viser")
async def to_page(request: Request) -> RedirectResponse:
    """The page's address ends in a slash; its WebSocket's does not."""
    return RedirectResponse(f"{request.app.state.settings.root_path}/viser/", 308)


@router.get("/viser/{path:path}")
async def viser_page(request: Request, path: str) -> Response:
    """Fetch viser's page, which is one file."""
    port = await _port(request.app.state.hub)
    wanted = {"Accept-Encoding": request.headers.get("accept-encoding", "identity")}
    url = httpx.URL(scheme="http", host="127.0.0.1", port=port, path=f"/{path}")
    try:
        async with (
            httpx.AsyncClient(timeout=10, trust_env=False, verify=False) as client,
            client.stream("GET", url, headers=wanted) as answer,
        ):
            # Raw: what viser compressed stays compressed. (verify: plain HTTP; loading the
            # certificates of the world takes 0.3 s.)
            body = b"".join([chunk async for chunk in answer.aiter_raw()])
    except httpx.HTTPError as error:
        raise ViewerUnavailable(f"the 3D view does not answer: {error}") from error
    headers = {name: answer.headers[name] for name in _FORWARDED if name in answer.headers}
    return Response(body, answer.status_code, headers)


@router.websocket("/viser")
@router.websocket("/viser/")
async def viser_socket(socket: WebSocket) -> None:
    """Carry messages both ways until either side closes; ``?view=`` says whose view it is."""
    try:
        port = await _port(socket.app.state.hub)
    except ViewerUnavailable as error:
        await socket.send_denial_response(error_response(error))
        return
    view = socket.query_params.get("view", "")
    query = f"?view={view}" if VIEW_ID.fullmatch(view) else ""
    offered = [Subprotocol(name) for name in socket.scope.get("subprotocols", [])]
    try:
        upstream = await connect(
            f"ws://127.0.0.1:{port}/{query}",
            subprotocols=offered or None,
            compression=None,
            max_size=MAX_MESSAGE_BYTES,
            open_timeout=5,
            close_timeout=1,
            ping_interval=None,
            proxy=None,
        )
    except (OSError, WebSocketException, TimeoutError) as error:
        log.warning("the 3D view does not answer: %s", error)
        away = ViewerUnavailable("the 3D view does not answer")
        await socket.send_denial_response(error_response(away))
        return
    async with upstream:
        await socket.accept(upstream.subprotocol)
        tasks = [
            asyncio.create_task(_to_viser(socket, upstream)),
            asyncio.create_task(_to_browser(upstream, socket)),
        ]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
    with contextlib.suppress(RuntimeError, WebSocketDisconnect, OSError):
        # websockets keeps close codes such as 1006 that may not be sent.
        code = upstream.close_code
        await socket.close(code if code in (1000, 1001, 1002, 1011, 1012, 1013) else 1000)


async def _to_viser(socket: WebSocket, upstream: ClientConnection) -> None:
    with contextlib.suppress(ConnectionClosed, WebSocketDisconnect):
        while True:
            message = await socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            data = message.get("bytes")
            await upstream.send(data if data is not None else message["text"])


async def _to_browser(upstream: ClientConnection, socket: WebSocket) -> None:
    with contextlib.suppress(ConnectionClosed, WebSocketDisconnect, OSError, RuntimeError):
        async for message in upstream:
            if isinstance(message, bytes):
                await socket.send_bytes(message)
            else:
                await socket.send_text(message)
