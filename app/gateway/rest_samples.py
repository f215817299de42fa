"""REST: single samples, and taking changes of gestures back."""

from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import Response

from app.errors import Invalid
from app.gateway.bodies import MOVE_BODY
from app.gateway.errors import BAD_BODY
from app.gateway.json_bodies import read_object
from app.gateway.rest_gestures import gesture_json, hub_of
from app.gateway.undo_offer import UndoOffer

router = APIRouter(prefix="/api", tags=["gestures"])

LAST: dict[int | str, dict[str, Any]] = {
    404: {"description": "unknown id"},
    409: {"description": "it is the only sample of its gesture"},
}


@router.delete("/gestures/{id}/samples/{sample}", summary="Forget one sample", responses=LAST)
async def delete_sample(
    request: Request, response: Response, id: str, sample: str
) -> dict[str, Any]:
    """The gesture without it."""
    hub = hub_of(request)
    offer = UndoOffer(hub.store)
    gesture = await hub.database(hub.store.samples.remove, id, sample, undo_as=offer.id)
    await hub.gallery_changed()
    offer.to(response)
    return gesture_json(gesture)


@router.post(
    "/gestures/{id}/samples/{sample}/move",
    summary="Give a sample to another gesture",
    openapi_extra={"requestBody": MOVE_BODY},
    responses={**BAD_BODY, **LAST, 422: {"description": "not another gesture of that gallery"}},
)
async def move_sample(
    request: Request, response: Response, id: str, sample: str
) -> list[dict[str, Any]]:
    """Both gestures: ``{"to": id}``, which is of the same gallery."""
    hub = hub_of(request)
    to = (await read_object(request, ("to",)))["to"]
    if not isinstance(to, str):
        raise Invalid("to is the id of a gesture", field="to")
    offer = UndoOffer(hub.store)
    both = await hub.database(hub.store.samples.move, id, sample, to, undo_as=offer.id)
    await hub.gallery_changed()
    offer.to(response)
    return [gesture_json(gesture) for gesture in both]


@router.post(
    "/changes/{id}/undo",
    summary="Take a change of gestures back",
    responses={
        404: {"description": "it cannot be taken back any more"},
        409: {"description": "a gesture was changed since, or its name is taken now"},
    },
)
async def undo_change(request: Request, response: Response, id: str) -> list[dict[str, Any]]:
    """The gestures that are there again, or as they were. This can be taken back in its turn."""
    hub = hub_of(request)
    offer = UndoOffer(hub.store)
    gestures = await hub.database(hub.store.undo, id, undo_as=offer.id)
    await hub.gallery_changed()
    offer.to(response)
    return [gesture_json(gesture) for gesture in gestures]
