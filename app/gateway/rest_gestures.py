"""REST: the gesture database, and recognising one image."""

import asyncio
import json
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import APIRouter, Query, Request
from pydantic import ValidationError
from starlette.responses import Response

from app.config import PipelineSettings
from app.errors import ImageRefused, Invalid, NotFound
from app.gateway.errors import describe_validation
from app.gateway.gallery import Enrolled
from app.gateway.uploads import UnsupportedMedia, read_image, read_upload
from app.gestures import Gesture, template_png
from app.gestures.records import clean_name
from app.link.actions import ACTION, Action
from app.pipeline import extract_template, pack_template

if TYPE_CHECKING:
    from app.gateway.hub import Hub

router = APIRouter(prefix="/api", tags=["gestures"])

MAX_JSON = 64 * 1024

_IMAGES = {"type": "array", "items": {"type": "string", "format": "binary"}}
_ENROL_BODY = {
    "required": True,
    "content": {
        "multipart/form-data": {
            "schema": {
                "type": "object",
                "required": ["name", "action", "images"],
                "properties": {
                    "name": {"type": "string"},
                    "action": {"type": "string", "description": "an action as JSON"},
                    "images": _IMAGES,
                },
            }
        }
    },
}
_SAMPLES_BODY = {
    "required": True,
    "content": {
        "multipart/form-data": {
            "schema": {"type": "object", "required": ["images"], "properties": {"images": _IMAGES}}
        }
    },
}
_IMAGE_BODY = {
    "required": True,
    "content": {
        "multipart/form-data": {
            "schema": {
                "type": "object",
                "required": ["image"],
                "properties": {"image": {"type": "string", "format": "binary"}},
            }
        },
        "image/*": {"schema": {"type": "string", "format": "binary"}},
    },
}
_PATCH_BODY = {
    "required": True,
    "content": {
        "application/json": {
            "schema": {
                "type": "object",
                "properties": {"name": {"type": "string"}, "action": {"type": "object"}},
                "additionalProperties": False,
            }
        }
    },
}


def gesture_json(gesture: Gesture) -> dict[str, Any]:
    """A gesture as the REST interface shows it."""
    return {
        "id": gesture.id,
        "name": gesture.name,
        "action": ACTION.dump_python(gesture.action, mode="json", exclude_none=True),
        "samples": len(gesture.samples),
        "sample_ids": [sample.id for sample in gesture.samples],
        "created": gesture.created.isoformat(),
        "updated": gesture.updated.isoformat(),
    }


def parse_json(text: str | bytes, what: str) -> Any:
    """Parse JSON that somebody sent; NaN and infinity are not JSON.

    Raises:
        Invalid: it is not JSON.
    """

    def no_constant(name: str) -> float:
        raise ValueError(f"{name} is not a JSON number")

    try:
        return json.loads(text, parse_constant=no_constant)
    except (ValueError, RecursionError) as error:
        raise Invalid(f"{what} is not JSON: {error}"[:300], field=what) from None


def parse_action(value: Any) -> Action:
    """An action that somebody sent.

    Raises:
        Invalid: with the first thing that is wrong.
    """
    try:
        # Through JSON, so that lists become tuples as they do in the database.
        return ACTION.validate_json(json.dumps(value))
    except ValidationError as error:
        message, fields = describe_validation(error)
        raise Invalid(f"action: {message}", code="bad_action", fields=fields) from None
    except (RecursionError, ValueError) as error:
        raise Invalid(f"action: {error}"[:300], code="bad_action") from None


def _extract(images: list[bytes], settings: PipelineSettings) -> list[bytes]:
    """The packed template of every image; refuses all when one shows no hand."""
    templates = []
    for number, image in enumerate(images, start=1):
        try:
            templates.append(pack_template(extract_template(image, settings).template))
        except ImageRefused as error:
            error.detail["image"] = number
            if len(images) > 1:
                error.message = f"image {number}: {error.message}"
            raise
    return templates


async def _templates(hub: "Hub", images: list[bytes]) -> list[bytes]:
    if not images:
        raise Invalid("at least one image is needed in 'images'", field="images")
    loop = asyncio.get_running_loop()
    return await loop.run_in_executor(hub.images, _extract, images, hub.settings.pipeline)


def _hub(request: Request) -> "Hub":
    hub: Hub = request.app.state.hub
    return hub


@router.get("/gestures", summary="All enrolled gestures")
async def list_gestures(request: Request) -> list[dict[str, Any]]:
    """All gestures, in the order in which they were enrolled."""
    gestures = await asyncio.to_thread(_hub(request).store.list)
    return [gesture_json(gesture) for gesture in gestures]


@router.post(
    "/gestures",
    status_code=201,
    summary="Enrol a gesture",
    openapi_extra={"requestBody": _ENROL_BODY},
    responses={
        409: {"description": "the name is taken"},
        413: {"description": "too many bytes"},
        422: {"description": "a bad name or action, or an image without a hand"},
    },
)
async def create_gesture(request: Request, response: Response) -> dict[str, Any]:
    """Enrol a gesture from one or more images: whole, or not at all."""
    hub = _hub(request)
    upload = await read_upload(request, hub.settings.gateway.max_upload_bytes, "images")
    for field in ("name", "action"):
        if field not in upload.fields:
            raise Invalid(f"the field {field!r} is missing", field=field)
    if unknown := upload.fields.keys() - {"name", "action"}:
        raise Invalid(f"the field {min(unknown)!r} is not known", field=min(unknown))
    name = clean_name(upload.fields["name"])
    action = parse_action(parse_json(upload.fields["action"], "action"))
    templates = await _templates(hub, upload.images)
    gesture = await asyncio.to_thread(hub.store.create, name, action, templates)
    await hub.gallery_changed()
    response.headers["Location"] = f"/api/gestures/{gesture.id}"
    return gesture_json(gesture)


@router.get("/gestures/{id}", summary="One gesture", responses={404: {"description": "unknown id"}})
async def get_gesture(request: Request, id: str) -> dict[str, Any]:
    """One gesture."""
    return gesture_json(await asyncio.to_thread(_hub(request).store.get, id))


@router.patch(
    "/gestures/{id}",
    summary="Change a gesture's name or action",
    openapi_extra={"requestBody": _PATCH_BODY},
    responses={
        404: {"description": "unknown id"},
        409: {"description": "the name is taken"},
        422: {"description": "a bad name or action"},
    },
)
async def update_gesture(request: Request, id: str) -> dict[str, Any]:
    """Change the name, the action or both: ``{"name": ..., "action": {...}}``."""
    hub = _hub(request)
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind != "application/json":
        raise UnsupportedMedia(f"send application/json, not {kind or 'nothing'}", given=kind)
    body = bytearray()
    async for part in request.stream():
        body += part
        if len(body) > MAX_JSON:
            raise Invalid(f"the JSON may have {MAX_JSON} bytes", field="body")
    changes = parse_json(bytes(body), "body")
    if not isinstance(changes, dict) or not changes or changes.keys() - {"name", "action"}:
        raise Invalid("send a JSON object with 'name', 'action' or both", field="body")
    name = changes.get("name")
    if "name" in changes and not isinstance(name, str):
        raise Invalid("the name must be a string", field="name")
    action = parse_action(changes["action"]) if "action" in changes else None
    gesture = await asyncio.to_thread(hub.store.update, id, name=name, action=action)
    await hub.gallery_changed()
    return gesture_json(gesture)


@router.delete(
    "/gestures/{id}",
    status_code=204,
    summary="Forget a gesture",
    responses={404: {"description": "unknown id"}},
)
async def delete_gesture(request: Request, id: str) -> Response:
    """Forget a gesture and its samples."""
    hub = _hub(request)
    await asyncio.to_thread(hub.store.delete, id)
    await hub.gallery_changed()
    return Response(status_code=204)


@router.post(
    "/gestures/{id}/samples",
    status_code=201,
    summary="Enrol more images of a gesture",
    openapi_extra={"requestBody": _SAMPLES_BODY},
    responses={
        404: {"description": "unknown id"},
        413: {"description": "too many bytes"},
        422: {"description": "an image without a hand"},
    },
)
async def add_samples(request: Request, id: str) -> dict[str, Any]:
    """Enrol more images of a gesture: all of them, or none."""
    hub = _hub(request)
    await asyncio.to_thread(hub.store.get, id)
    upload = await read_upload(request, hub.settings.gateway.max_upload_bytes, "images")
    if upload.fields:
        raise Invalid(f"the field {min(upload.fields)!r} is not known", field=min(upload.fields))
    templates = await _templates(hub, upload.images)
    gesture = await asyncio.to_thread(hub.store.add_samples, id, templates)
    await hub.gallery_changed()
    return gesture_json(gesture)


@router.get(
    "/gestures/{id}/template.png",
    summary="A sample's template as PNG",
    response_class=Response,
    responses={
        200: {"content": {"image/png": {}}, "description": "60x80, one bit a pixel, hand white"},
        404: {"description": "unknown id or sample"},
    },
)
async def template(
    request: Request, id: str, sample: Annotated[int, Query(ge=0, le=100_000)] = 0
) -> Response:
    """The template of sample number ``sample``, counted from 0."""
    gesture = await asyncio.to_thread(_hub(request).store.get, id)
    if sample >= len(gesture.samples):
        raise NotFound(
            f"{gesture.name} has {len(gesture.samples)} samples, counted from 0; "
            f"there is no number {sample}",
            sample=sample,
        )
    png = template_png(gesture.samples[sample].template)
    return Response(png, media_type="image/png", headers={"Cache-Control": "private, max-age=60"})


def _recognise(image: bytes, settings: PipelineSettings, enrolled: Enrolled) -> dict[str, Any]:
    try:
        extraction = extract_template(image, settings)
    except ImageRefused as error:
        return {"match": None, "reason": error.message, "roi": None, "distances": {}}
    matched = enrolled.matcher(extraction.views)
    match = matched.match
    found = None
    if match is not None and match.accepted:
        found = {"gesture": match.gesture, "distance": match.distance, "margin": match.margin}
    return {
        "match": found,
        "reason": "no gesture is enrolled yet" if match is None else match.reason,
        "roi": list(extraction.roi),
        "distances": matched.distances,
        "threshold": enrolled.matcher.max_distance,
    }


@router.post(
    "/recognise",
    summary="Which gesture does an image show?",
    openapi_extra={"requestBody": _IMAGE_BODY},
    responses={
        413: {"description": "too many bytes"},
        422: {"description": "not an image"},
    },
)
async def recognise(request: Request) -> dict[str, Any]:
    """An image in (multipart field ``image``, or the body itself), the match out."""
    hub = _hub(request)
    image = await read_image(request, hub.settings.gateway.max_upload_bytes)
    if not image:
        raise Invalid("the image is empty", field="image")
    loop = asyncio.get_running_loop()
    return await loop.run_in_executor(
        hub.images, _recognise, image, hub.settings.pipeline, hub.gallery.current
    )
