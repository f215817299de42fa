"""REST: changing what a gesture does, and the actions that it had."""

from typing import Annotated, Any

from fastapi import APIRouter, Path, Request
from starlette.responses import Response

from app.errors import Invalid
from app.gateway.bodies import PATCH_BODY
from app.gateway.errors import BAD_BODY
from app.gateway.json_bodies import parse_action, read_object
from app.gateway.rest_gestures import confusions_of, gesture_json, hub_of
from app.gateway.undo_offer import UndoOffer
from app.gestures.records import ActionVersion
from app.link.actions import ACTION

router = APIRouter(prefix="/api", tags=["gestures"])

Version = Annotated[int, Path(ge=1, le=2**31 - 1)]


def version_json(version: ActionVersion) -> dict[str, Any]:
    """A version as the REST interface shows it."""
    return {
        "version": version.version,
        "action": ACTION.dump_python(version.action, mode="json", exclude_none=True),
        "created": version.created.isoformat(),
    }


@router.patch(
    "/gestures/{id}",
    summary="Change a gesture's name or action, or whether it is active",
    openapi_extra={"requestBody": PATCH_BODY},
    responses={
        **BAD_BODY,
        404: {"description": "unknown id"},
        409: {"description": "the name is taken, or 'version' is not the newest"},
        422: {"description": "a bad name or action"},
    },
)
async def update_gesture(request: Request, response: Response, id: str) -> dict[str, Any]:
    """Change what is named: ``{"name": ..., "action": {...}, "active": true}``.

    With ``version``, the newest version of the action that the caller knows, the change is refused
    when somebody else has changed the action since. The answer to ``active`` also says what the
    gesture may be confused with.
    """
    hub = hub_of(request)
    changes = await read_object(request, ("name", "action", "active", "version"))
    if changes.keys() == {"version"}:
        raise Invalid("say what to change: 'name', 'action' or 'active'", field="body")
    name = changes.get("name")
    if "name" in changes and not isinstance(name, str):
        raise Invalid("the name must be a string", field="name")
    active = changes.get("active")
    if "active" in changes and not isinstance(active, bool):
        raise Invalid("active must be true or false", field="active")
    version = changes.get("version")
    if "version" in changes and (not isinstance(version, int) or isinstance(version, bool)):
        raise Invalid("version must be a whole number", field="version")
    action = parse_action(changes["action"]) if "action" in changes else None
    offer = UndoOffer(hub.store)
    gesture = await hub.database(
        hub.store.update,
        id,
        name=name,
        action=action,
        active=active,
        version=version,
        undo_as=offer.id,
    )
    await hub.gallery_changed()
    offer.to(response)
    if active is None:
        return gesture_json(gesture)
    templates = [sample.template for sample in gesture.samples]
    confusions = await confusions_of(hub, gesture.gallery, gesture.name, templates, gesture.id)
    return {**gesture_json(gesture), "confusions": confusions}


@router.get(
    "/gestures/{id}/versions",
    summary="The actions that a gesture had",
    responses={404: {"description": "unknown id"}},
)
async def list_versions(request: Request, id: str) -> list[dict[str, Any]]:
    """All that are kept, oldest first; the last is in force."""
    hub = hub_of(request)
    versions = await hub.database(hub.store.versions, id)
    return [version_json(version) for version in versions]


@router.post(
    "/gestures/{id}/versions/{version}/restore",
    summary="Give a gesture an action that it had",
    responses={404: {"description": "unknown id or version"}},
)
async def restore_version(
    request: Request, response: Response, id: str, version: Version
) -> dict[str, Any]:
    """The action of that version becomes the newest version. The gesture."""
    hub = hub_of(request)
    offer = UndoOffer(hub.store)
    gesture = await hub.database(hub.store.restore, id, version, undo_as=offer.id)
    await hub.gallery_changed()
    offer.to(response)
    return gesture_json(gesture)
