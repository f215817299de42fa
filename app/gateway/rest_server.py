"""REST: health, metrics, the synthetic operator, and the description of all of it."""

import logging
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, Request
from starlette.responses import HTMLResponse, JSONResponse, Response

from app.errors import FarhandError
from app.gateway.auth import identity_of
from app.gateway.pages import routes_page
from app.pipeline.hand_landmarks.live import wanted

if TYPE_CHECKING:
    from app.gateway.hub import Hub

log = logging.getLogger(__name__)

router = APIRouter()


@router.get("/api/health", tags=["server"], summary="Is the server alive?")
async def health(request: Request) -> dict[str, Any]:
    """``{"status": "ok"}`` for everybody; the details for who is signed in."""
    answer: dict[str, Any] = {"status": "ok"}
    if (identity := identity_of(request.scope)) is None:
        return answer
    hub: Hub = request.app.state.hub
    try:
        database = "ok"
        await hub.database(lambda: hub.store.version)
    except FarhandError as error:
        database = error.message
    database = hub.keeper.problem_for(identity.role) or database
    robot = hub.robot
    return answer | {
        "version": hub.version,
        "database": database,
        "gestures": len(hub.gallery.current.actions),
        "sessions": len(hub.people.sessions),
        "camera_viewers": hub.relay.viewers,
        "viser": hub.viser is not None,
        # The networks may be missing: see farhand models.
        "hands_by": "landmarks" if wanted(hub.settings.pipeline) else "mask",
        "robots": [
            {
                "id": robot.id,
                "online": robot.online,
                "fault": robot.fault,
                "age_ms": None if robot.age_s is None else round(robot.age_s * 1000),
                "restarts": robot.restarts,
                "pid": robot.node_pid,
                "latch": None if robot.state is None else robot.state.latch.model_dump(),
                "remembered": robot.stop_memory.kept.model_dump(),
            }
        ],
    }


@router.get(
    "/metrics",
    tags=["server"],
    summary="Counters for Prometheus",
    response_class=Response,
    responses={200: {"content": {"text/plain": {}}}},
)
async def metrics(request: Request) -> Response:
    """Prometheus' text format."""
    hub: Hub = request.app.state.hub
    return Response(hub.metrics.text(), media_type="text/plain; version=0.0.4; charset=utf-8")


@router.get("/openapi.json", include_in_schema=False)
async def openapi(request: Request) -> JSONResponse:
    """The REST interface, described for programs."""
    return JSONResponse(request.app.openapi())


@router.get("/docs", include_in_schema=False)
async def docs(request: Request) -> HTMLResponse:
    """The REST interface, described for people."""
    return routes_page(request.app.openapi())
