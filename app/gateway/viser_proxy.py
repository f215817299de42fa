"""The 3D view's page and WebSocket, reached through the gateway's own port and its sign-in.

viser asks nobody who they are: it listens on a unix socket that this proxy alone knows. What a
browser sends is read here, and one message of it goes on (:mod:`app.gateway.viser_messages`).
"""

import asyncio
import contextlib
import logging
import re
import time
from pathlib import Path
from typing import TYPE_CHECKING

from fastapi import APIRouter, Request
from starlette.responses import RedirectResponse, Response
from starlette.websockets import WebSocket, WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, unix_connect
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.typing import Subprotocol

from app.errors import WorldError
from app.gateway.closing import Closing
from app.gateway.errors import error_response
from app.gateway.pace import Pace
from app.gateway.viser_messages import BURST, MAX_HZ, read
from app.gateway.viser_rehearsal import VIEW_ID
from app.gateway.viser_scene import ViserScene

if TYPE_CHECKING:
    from app.gateway.hub import Hub

log = logging.getLogger(__name__)

router = APIRouter(include_in_schema=False)

MAX_MESSAGE_BYTES = 50 << 20
"""viser's own limit, for what it sends."""
START_WAIT_S = 20.0
PROTOCOL = re.compile(r"viser-v[0-9.]{1,20}")
"""How viser's page names its version."""


class ViewerUnavailable(WorldError):
    """The 3D view is off or does not answer."""

    default_code = "viewer_unavailable"


async def _scene(hub: "Hub") -> tuple[ViserScene, Path]:
    """The 3D view and its socket, once it has started.

    Raises:
        ViewerUnavailable: it is switched off, cannot start, or takes too long.
    """
    if hub.viser is None:
        raise ViewerUnavailable("the 3D view is switched off (setting gateway.viser)")
    socket = await asyncio.to_thread(hub.viser.wait_socket, START_WAIT_S)
    if hub.viser.failure is not None:
        raise ViewerUnavailable(f"there is no 3D view: {hub.viser.failure}")
    if socket is None:
        raise ViewerUnavailable("the 3D view is still starting, or ending; try again")
    return hub.viser, socket


@router.get("/viser")
async def to_page(request: Request) -> RedirectResponse:
    """The page's address ends in a slash; its WebSocket's does not."""
    return RedirectResponse(f"{request.app.state.settings.root_path}/viser/", 308)


@router.get("/viser/")
async def viser_page(request: Request) -> Response:
    """The page of viser, which is one file; its query is read by the page itself alone."""
    scene, _ = await _scene(request.app.state.hub)
    assert scene.page is not None  # it is read before the socket is made
    headers = {"Vary": "Accept-Encoding"}
    if "gzip" not in request.headers.get("accept-encoding", ""):
        return Response(scene.page.plain, headers=headers, media_type="text/html")
    headers["Content-Encoding"] = "gzip"
    return Response(scene.page.compressed, headers=headers, media_type="text/html")


@router.websocket("/viser")
@router.websocket("/viser/")
async def viser_socket(socket: WebSocket) -> None:
    """Carry messages until either side closes; ``?view=`` says whose view it is.

    All of viser's go to the browser, one kind of the browser's to viser; anything else that the
    browser sends ends the connection.
    """
    hub: Hub = socket.app.state.hub
    try:
        _, path = await _scene(hub)
    except ViewerUnavailable as error:
        await socket.send_denial_response(error_response(error))
        return
    view = socket.query_params.get("view", "")
    query = f"?view={view}" if VIEW_ID.fullmatch(view) else ""
    offered = [name for name in socket.scope.get("subprotocols", []) if PROTOCOL.fullmatch(name)]
    try:
        upstream = await unix_connect(
            str(path),
            f"ws://viser/{query}",
            subprotocols=[Subprotocol(name) for name in offered[:1]] or None,
            compression=None,
            max_size=MAX_MESSAGE_BYTES,
            open_timeout=5,
            close_timeout=1,
            ping_interval=None,
        )
    except (OSError, WebSocketException, TimeoutError) as error:
        log.warning("the 3D view does not answer: %s", error)
        away = ViewerUnavailable("the 3D view does not answer")
        await socket.send_denial_response(error_response(away))
        return
    async with upstream:
        await socket.accept(upstream.subprotocol)
        hearing = asyncio.create_task(_to_viser(socket, upstream))
        showing = asyncio.create_task(_to_browser(upstream, socket))
        try:
            await asyncio.wait((hearing, showing), return_when=asyncio.FIRST_COMPLETED)
        finally:
            hearing.cancel()
            showing.cancel()
            ends = await asyncio.gather(hearing, showing, return_exceptions=True)
    # websockets keeps close codes such as 1006 that may not be sent.
    code = upstream.close_code
    end = Closing(code if code in (1000, 1001, 1002, 1011, 1012, 1013) else 1000, "")
    if isinstance(ends[0], Closing):
        end = ends[0]
        hub.metrics.bad_messages.labels("viewer_message").inc()
        log.warning("a viewer of the 3D view is turned away: %s", end.reason)
    with contextlib.suppress(RuntimeError, WebSocketDisconnect, OSError):
        await socket.close(end.code, end.reason)


async def _to_viser(socket: WebSocket, upstream: ClientConnection) -> None:
    """Pass on what a browser may send.

    Raises:
        Closing: it sent something else.
    """
    pace = Pace(MAX_HZ, BURST)
    with contextlib.suppress(ConnectionClosed, WebSocketDisconnect):
        while True:
            message = await socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            if (wait := pace.wait_s(time.monotonic())) > 0:
                await asyncio.sleep(wait)
            data = message.get("bytes")
            await upstream.send(read(message["text"] if data is None else data))


async def _to_browser(upstream: ClientConnection, socket: WebSocket) -> None:
    with contextlib.suppress(ConnectionClosed, WebSocketDisconnect, OSError, RuntimeError):
        async for message in upstream:
            if isinstance(message, bytes):
                await socket.send_bytes(message)
            else:
                await socket.send_text(message)
