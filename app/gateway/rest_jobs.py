"""REST: how far long work is, and cancelling it."""

from typing import Any

from fastapi import APIRouter, Request

from app.gateway.rest_gestures import hub_of

router = APIRouter(prefix="/api/jobs", tags=["jobs"])

UNKNOWN: dict[int | str, dict[str, Any]] = {404: {"description": "unknown id, or not any more"}}


@router.get("/{id}", summary="How far is it, or how did it end?", responses=UNKNOWN)
async def get_job(request: Request, id: str) -> dict[str, Any]:
    """A job that runs, or ended in the last ten minutes."""
    return hub_of(request).jobs.get(id).as_json()


@router.delete("/{id}", summary="Cancel it", responses=UNKNOWN)
async def cancel_job(request: Request, id: str) -> dict[str, Any]:
    """Ask it to end. It does so within about a second; one that has ended stays as it is."""
    job = hub_of(request).jobs.get(id)
    job.cancel()
    return job.as_json()
