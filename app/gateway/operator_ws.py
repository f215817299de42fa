"""The operator WebSocket's endpoint, and what is sent to all sessions alike."""

import asyncio
import contextlib
import logging
from typing import TYPE_CHECKING

from starlette.websockets import WebSocket, WebSocketDisconnect

from app.gateway.auth import identity_of
from app.gateway.messages import encode
from app.gateway.robot_view import robot_message
from app.gateway.session import OperatorSession

if TYPE_CHECKING:
    from app.gateway.hub import Hub

log = logging.getLogger(__name__)

GALLERY_CHECK_S = 1.0
"""How soon a change by another process, such as ``farhand enroll``, is seen."""
CLOSE_FULL = 1013


async def operator_socket(socket: WebSocket) -> None:
    """``/ws/operator``."""
    hub: Hub = socket.app.state.hub
    await socket.accept()
    identity = identity_of(socket.scope)
    role = identity.role if identity else "observer"
    if (full := hub.people.why_full(role)) is not None:
        await socket.close(CLOSE_FULL, full)
        return
    session = OperatorSession(hub, socket, role)
    # OSError: the connection broke while we were sending.
    with contextlib.suppress(WebSocketDisconnect, OSError):
        await session.run()


async def tell_robot(hub: "Hub") -> None:
    """Send the ``robot`` message to every session, for ever."""
    period = 1 / hub.settings.gateway.robot_rate_hz
    loop = asyncio.get_running_loop()
    due = loop.time()
    while True:
        if hub.people.sessions:
            hub.people.saw_driver()
            try:
                text = encode(robot_message(hub.robot))
            except ValueError:
                log.exception("the robot's state cannot be told")
            else:
                for session in tuple(hub.people.sessions):
                    session.outbox.put_text("robot", text)
        due = max(due + period, loop.time())
        await asyncio.sleep(due - loop.time())


async def watch_gallery(hub: "Hub") -> None:
    """Notice changes of the gesture database by other processes, for ever."""
    while True:
        await asyncio.sleep(GALLERY_CHECK_S)
        try:
            await hub.tend_database()
        except Exception:
            log.exception("the gesture database cannot be read")
