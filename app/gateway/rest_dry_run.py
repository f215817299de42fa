"""REST: would a program break a limit, and where? And the path in the 3D view of who asks."""

from typing import Any

from fastapi import APIRouter, Request

from app.errors import Invalid, RobotUnavailable
from app.gateway.bodies import DRY_RUN_BODY
from app.gateway.busy import Busy
from app.gateway.errors import BAD_BODY
from app.gateway.json_bodies import parse_action, read_object
from app.gateway.rest_robots import robot_of
from app.gateway.viser_rehearsal import VIEW_ID
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
    """Do an action with a simulated robot: ``{"action": {...}, "from": "current"}``."""
    hub, robot = robot_of(request, id)
    body = await read_object(request, ("action", "from", "view", "still"))
    if "action" not in body:
        raise Invalid("the field 'action' is missing", field="action")
    start = body.get("from", "current")
    if not isinstance(start, str) or not 0 < len(start) <= START_MAX:
        raise Invalid("from is 'current', 'home' or the name of a pose", field="from")
    view, still = body.get("view"), body.get("still", False)
    if view is not None:
        check_view(view)
    if not isinstance(still, bool):
        raise Invalid("still is true or false", field="still")
    question = DryRunRequest(action=parse_action(body["action"]), start=start)
    if hub.checking.locked():
        raise Busy("another program is being checked; try again in a moment")
    async with hub.checking:  # one thread at a time waits for an answer
        report = await hub.dry_run(question)
    if report.code == "busy":
        raise Busy(report.reason)
    if report.code in ("robot_unavailable", "internal"):
        raise RobotUnavailable(report.reason, robot=robot.id)
    if report.code != "ok":
        raise Invalid(report.reason, code=report.code)
    if view is not None and hub.viser is not None:
        hub.viser.rehearsals.show(view, report, still=still)
    return report.model_dump(mode="json", exclude={"code", "reason"})


@router.delete(
    "/{id}/dry-run/{view}",
    status_code=204,
    summary="Take a dry run's path out of a 3D view",
    responses={404: {"description": "unknown id"}, 422: {"description": "not the id of a view"}},
)
async def hide_dry_run(request: Request, id: str, view: str) -> None:
    """Nothing is shown in that view any more; it does no harm when nothing was."""
    hub, _ = robot_of(request, id)
    check_view(view)
    if hub.viser is not None:
        hub.viser.rehearsals.hide(view)


def check_view(view: Any) -> None:
    """Refuse what is no id of a 3D view.

    Raises:
        Invalid: it is not.
    """
    if not isinstance(view, str) or VIEW_ID.fullmatch(view) is None:
        raise Invalid("view is 16 to 40 letters, digits, _ or -", field="view")
