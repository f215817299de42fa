"""REST: robots, the stop and its reset, and the things around the robot."""

from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, Request

from app.errors import NotFound
from app.gateway.robot_port import RobotPort
from app.gateway.robot_view import robot_detail, robot_summary

if TYPE_CHECKING:
    from app.gateway.hub import Hub

router = APIRouter(prefix="/api/robots", tags=["robots"])

_UNKNOWN: dict[int | str, dict[str, Any]] = {404: {"description": "unknown id"}}
_AWAY: dict[int | str, dict[str, Any]] = {
    **_UNKNOWN,
    503: {"description": "the robot does not answer"},
}


def _robot(request: Request, id: str) -> tuple["Hub", RobotPort]:
    hub: Hub = request.app.state.hub
    if id != hub.robot.id:
        raise NotFound(f"there is no robot {id[:40]!r}; there is {hub.robot.id!r}", id=id[:40])
    return hub, hub.robot


@router.get("", summary="All robots")
async def list_robots(request: Request) -> list[dict[str, Any]]:
    """All robots, each with what matters most."""
    hub: Hub = request.app.state.hub
    return [robot_summary(hub.robot)]


@router.get("/{id}", summary="One robot", responses=_UNKNOWN)
async def get_robot(request: Request, id: str) -> dict[str, Any]:
    """What the robot is, and its newest state in full."""
    return robot_detail(_robot(request, id)[1])


@router.post("/{id}/stop", summary="Stop (category S1, latched)", responses=_AWAY)
async def stop_robot(request: Request, id: str) -> dict[str, Any]:
    """Stop the robot; whoever drives. Answers once the robot has confirmed it."""
    hub, robot = _robot(request, id)
    hub.metrics.stops.labels("rest").inc()
    await hub.stop("rest", "a stop was asked for over REST")
    return robot_summary(robot)


@router.post(
    "/{id}/reset",
    summary="Leave the latched stop; moves nothing",
    responses={**_AWAY, 409: {"description": "the robot refuses"}},
)
async def reset_robot(request: Request, id: str) -> dict[str, Any]:
    """Leave the latched stop. The robot is disarmed afterwards."""
    hub, robot = _robot(request, id)
    await hub.reset("rest")
    return robot_summary(robot)


@router.post(
    "/{id}/scene/reset",
    summary="Put every movable thing back",
    responses={**_AWAY, 409: {"description": "the robot is armed, or still moves"}},
)
async def reset_scene(request: Request, id: str) -> dict[str, Any]:
    """Put every thing that can move back where it was at first.

    Needs no control, but a robot that is disarmed or stopped, and stands.
    """
    hub, robot = _robot(request, id)
    await hub.reset_scene("rest")
    return robot_summary(robot)
