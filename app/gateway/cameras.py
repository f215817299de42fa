"""Camera pictures: the WebSocket, single pictures and MJPEG."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, Request
from starlette.responses import Response, StreamingResponse
from starlette.websockets import WebSocket, WebSocketDisconnect

from app.errors import NotFound
from app.gateway.errors import error_response
from app.gateway.picture_pace import PicturePace, acknowledged
from app.link.header import HEADER_SIZE, FrameHeader

if TYPE_CHECKING:
    from app.gateway.hub import Hub
    from app.gateway.relay import Viewer

router = APIRouter(prefix="/api/cameras", tags=["cameras"])
sockets = APIRouter()

BOUNDARY = "farhand-picture"


@router.get("", summary="All cameras")
async def list_cameras(request: Request) -> list[dict[str, Any]]:
    """The robot's cameras; width and height are 0 until the robot has described itself."""
    hub: Hub = request.app.state.hub
    return [
        {"robot": hub.robot.id, **camera.model_dump(mode="json")} for camera in hub.relay.describe()
    ]


@router.get(
    "/{name}.jpg",
    summary="A fresh picture",
    response_class=Response,
    responses={
        200: {"content": {"image/jpeg": {}}},
        404: {"description": "unknown camera"},
        503: {"description": "no picture came in time"},
    },
)
async def picture(request: Request, name: str) -> Response:
    """One picture, taken now."""
    hub: Hub = request.app.state.hub
    jpeg = await hub.relay.picture(name, hub.settings.gateway.picture_wait_s)
    return Response(jpeg, media_type="image/jpeg")


@router.get(
    "/{name}.mjpeg",
    summary="Pictures without end",
    response_class=StreamingResponse,
    responses={
        200: {"content": {"multipart/x-mixed-replace": {}}},
        404: {"description": "unknown camera"},
    },
)
async def pictures(request: Request, name: str) -> StreamingResponse:
    """Pictures as they come, for programs that read MJPEG."""
    hub: Hub = request.app.state.hub
    hub.relay.check(name)
    return StreamingResponse(
        _parts(hub, name), media_type=f"multipart/x-mixed-replace; boundary={BOUNDARY}"
    )


async def _parts(hub: "Hub", name: str) -> AsyncIterator[bytes]:
    async with hub.relay.view(name) as viewer:
        while (picture := await _next(hub, viewer)) is not None:
            jpeg = picture[HEADER_SIZE:]
            head = (
                f"--{BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
            )
            yield head.encode() + jpeg + b"\r\n"


async def _next(hub: "Hub", viewer: "Viewer") -> bytes | None:
    """The viewer's next picture, or None when the server ends."""
    waiting = asyncio.ensure_future(viewer.next())
    ending = asyncio.ensure_future(hub.closing.wait())
    try:
        await asyncio.wait((waiting, ending), return_when=asyncio.FIRST_COMPLETED)
        return waiting.result() if waiting.done() else None
    finally:
        waiting.cancel()
        ending.cancel()


@sockets.websocket("/ws/camera/{name}")
async def camera_socket(socket: WebSocket, name: str) -> None:
    """Every message: the 24-byte header, then a JPEG. With ``?acks=1`` the viewer sets the pace."""
    hub: Hub = socket.app.state.hub
    try:
        hub.relay.check(name)
    except NotFound as error:
        await socket.send_denial_response(error_response(error))
        return
    pace = PicturePace() if socket.query_params.get("acks") == "1" else None
    await socket.accept()
    async with hub.relay.view(name) as viewer:
        sending = _send(socket, viewer) if pace is None else _send_paced(socket, viewer, pace)
        tasks = [asyncio.create_task(sending), asyncio.create_task(_listen(socket, pace))]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)


async def _send(socket: WebSocket, viewer: "Viewer") -> None:
    with contextlib.suppress(WebSocketDisconnect, OSError):
        while True:
            await socket.send_bytes(await viewer.next())


async def _send_paced(socket: WebSocket, viewer: "Viewer", pace: PicturePace) -> None:
    loop = asyncio.get_running_loop()
    with contextlib.suppress(WebSocketDisconnect, OSError):
        while True:
            await pace.turn()
            picture = await viewer.next_at(pace.level)
            pace.sent(FrameHeader.unpack(picture).sequence, loop.time())
            await socket.send_bytes(picture)


async def _listen(socket: WebSocket, pace: PicturePace | None) -> None:
    """Hear acknowledgements until the viewer is gone; all else that it sends is ignored."""
    loop = asyncio.get_running_loop()
    while (message := await socket.receive())["type"] != "websocket.disconnect":
        shown = acknowledged(message.get("text"))
        if pace is not None and shown is not None:
            pace.acknowledge(shown, loop.time())
