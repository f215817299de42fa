"""REST: several people keep galleries of their own."""

import contextlib
from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import Response

from app.errors import FarhandError, Invalid
from app.gateway.bodies import GALLERY_BODY
from app.gateway.errors import BAD_BODY
from app.gateway.json_bodies import read_object
from app.gateway.rest_gestures import hub_of
from app.gestures.records import SHARED, Gallery

router = APIRouter(prefix="/api", tags=["galleries"])


def gallery_json(gallery: Gallery) -> dict[str, Any]:
    """A gallery as the REST interface shows it."""
    return {
        "id": gallery.id,
        "name": gallery.name,
        "shared": gallery.id == SHARED,
        "gestures": gallery.gestures,
        "taught": gallery.taught,
        "created": gallery.created.isoformat(),
    }


@router.get("/galleries", summary="All galleries")
async def list_galleries(request: Request) -> list[dict[str, Any]]:
    """The shared gallery, then the others in the order in which they were made."""
    hub = hub_of(request)
    galleries = await hub.database(hub.store.galleries.list)
    return [gallery_json(gallery) for gallery in galleries]


@router.post(
    "/galleries",
    status_code=201,
    summary="Make a gallery for somebody",
    openapi_extra={"requestBody": GALLERY_BODY},
    responses={
        **BAD_BODY,
        409: {"description": "the name is taken"},
        422: {"description": "a bad name, or too many galleries"},
    },
)
async def create_gallery(request: Request) -> dict[str, Any]:
    """It begins as a copy of the shared gallery: ``{"name": ...}``."""
    hub = hub_of(request)
    name = await _name(request)
    gallery = await hub.database(hub.store.galleries.create, name)
    await hub.gallery_changed()
    return gallery_json(gallery)


@router.patch(
    "/galleries/{id}",
    summary="Rename a gallery",
    openapi_extra={"requestBody": GALLERY_BODY},
    responses={
        **BAD_BODY,
        404: {"description": "unknown id"},
        409: {"description": "the name is taken"},
        422: {"description": "a bad name"},
    },
)
async def rename_gallery(request: Request, id: str) -> dict[str, Any]:
    """Give a gallery another name: ``{"name": ...}``."""
    hub = hub_of(request)
    name = await _name(request)
    gallery = await hub.database(hub.store.galleries.rename, id, name)
    await hub.gallery_changed()
    return gallery_json(gallery)


@router.delete(
    "/galleries/{id}",
    status_code=204,
    summary="Forget a gallery",
    responses={
        404: {"description": "unknown id"},
        409: {"description": "the shared gallery stays"},
    },
)
async def delete_gallery(request: Request, id: str) -> Response:
    """Forget a gallery with all its gestures; who uses it goes on with the shared one."""
    hub = hub_of(request)
    await hub.database(hub.store.galleries.delete, id)
    # The diary forgets those that it knew; one that came and went between two of its looks, here.
    with contextlib.suppress(FarhandError):
        await hub.database(lambda: hub.diary.settings.forget(id))
    await hub.gallery_changed()
    return Response(status_code=204)


async def _name(request: Request) -> str:
    name = (await read_object(request, ("name",)))["name"]
    if not isinstance(name, str):
        raise Invalid("the name must be a string", field="name")
    return name
