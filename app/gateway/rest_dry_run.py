"""REST: would a program break a limit, and where?"""

import asyncio
from typing import Any

from fastapi import APIRouter, Request

from app.errors import Invalid, RobotUnavailable
from app.gateway.bodies import DRY_RUN_BODY
from app.gateway.errors import BAD_BODY
from app.gateway.jobs import Busy
from app.gateway.json_bodies import parse_action, read_object
from app.gateway.rest_robots import robot_of
from app.link.messages import DryRunRequest

router = APIRouter(prefix="/api/robots", tags=["robots"])

START_MAX = 40
"""Characters of a pose's name."""


@router.post(
    "/{id}/dry-run",
    summary="Would an action break a limit? Nothing moves",
    openapi_extra={"requestBody": DRY_RUN_BODY},
    responses={
        **BAD_BODY,
        404: {"description": "unknown id"},
        422: {"description": "a bad action, or an unknown pose in 'from'"},
        429: {"description": "another program is being checked"},
        503: {"description": "the robot does not answer"},
    },
)
async def dry_run(request: Request, id: str) -> dict[str, Any]:
    """Do an action with a simulated arm: ``{"action": {...}, "from": "current"}``."""
    hub, robot = robot_of(request, id)
    body = await read_object(request, ("action", "from"))
    if "action" not in body:
        raise Invalid("the field 'action' is missing", field="action")
    start = body.get("from", "current")
    if not isinstance(start, str) or not 0 < len(start) <= START_MAX:
        raise Invalid("from is 'current', 'home' or the name of a pose", field="from")
    question = DryRunRequest(action=parse_action(body["action"]), start=start)
    if hub.checking.locked():
        raise Busy("another program is being checked; try again in a moment")
    async with hub.checking:  # one thread at a time waits for an answer
        report = await asyncio.to_thread(robot.dry_run, question)
    if report.code == "busy":
        raise Busy(report.reason)
    if report.code in ("robot_unavailable", "internal"):
        raise RobotUnavailable(report.reason, robot=robot.id)
    if report.code != "ok":
        raise Invalid(report.reason, code=report.code)
    return report.model_dump(mode="json", exclude={"code", "reason"})
