"""REST: what a person has chosen on the page."""

from typing import Any

from fastapi import APIRouter, Request
from pydantic import ValidationError

from app.errors import Invalid, NotFound
from app.gateway.bodies import SETTINGS_BODY
from app.gateway.diary.writer import wall_ms
from app.gateway.errors import BAD_BODY, describe_validation
from app.gateway.json_bodies import read_object
from app.gateway.rest_gestures import hub_of
from app.gestures.galleries import SharedGallery
from app.gestures.records import SHARED
from app.memory import PersonSettings

router = APIRouter(prefix="/api", tags=["galleries"])

_UNKNOWN: dict[int | str, dict[str, Any]] = {
    404: {"description": "unknown id"},
    503: {"description": "nothing is remembered"},
}


@router.get("/galleries/{id}/settings", summary="What a person has chosen", responses=_UNKNOWN)
async def get_settings(request: Request, id: str) -> PersonSettings:
    """Each choice, or null where none was made; the shared gallery is nobody's and has none."""
    hub = hub_of(request)
    await hub.database(hub.store.galleries.get, id)
    return await hub.database(hub.diary.settings.get, id)


@router.patch(
    "/galleries/{id}/settings",
    summary="Choose for a person",
    openapi_extra={"requestBody": SETTINGS_BODY},
    responses={
        **BAD_BODY,
        **_UNKNOWN,
        409: {"description": "the shared gallery is nobody's"},
        422: {"description": "not a choice"},
        507: {"description": "no space left"},
    },
)
async def change_settings(request: Request, id: str) -> PersonSettings:
    """Change what is named; null forgets a choice. All choices. The last who changes one wins."""
    hub = hub_of(request)
    changes = await read_object(request, tuple(PersonSettings.model_fields))
    if id == SHARED:
        raise SharedGallery("the shared gallery is nobody's: choices are kept for one person")
    await hub.database(hub.store.galleries.get, id)
    settings = hub.diary.settings
    try:
        changed = await hub.database(settings.change, id, changes, wall_ms())
    except ValidationError as error:
        message, fields = describe_validation(error)
        raise Invalid(message[:300], fields=fields) from None
    try:
        await hub.database(hub.store.galleries.get, id)
    except NotFound:
        # It was deleted meanwhile: nobody would ever forget these.
        await hub.database(settings.forget, id)
        raise
    return changed
