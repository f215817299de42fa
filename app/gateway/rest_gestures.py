"""REST: the gesture database, and recognising one image."""

from typing import TYPE_CHECKING, Annotated, Any

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from app.errors import ImageRefused, Invalid, NotFound, Unreadable
from app.gateway.bodies import CHECK_BODY, ENROL_BODY, IMAGE_BODY, SAMPLES_BODY
from app.gateway.body_watch import still_allowed
from app.gateway.connected import while_connected
from app.gateway.enrolment import (
    Judged,
    found_json,
    judge,
    judge_for_enrolment,
    matrix_json,
    set_of,
    sets_of,
)
from app.gateway.errors import BAD_BODY
from app.gateway.gallery import Enrolled
from app.gateway.json_bodies import parse_action, parse_json
from app.gateway.undo_offer import UndoOffer
from app.gateway.uploads import read_enrolment, read_image
from app.gateway.work_pool import LONG_CPU_S
from app.gestures import Gesture, template_png
from app.gestures.records import SHARED, clean_name
from app.link.actions import ACTION
from app.pipeline import extract_template
from app.pipeline.confusion import compare

if TYPE_CHECKING:
    from app.gateway.hub import Hub

router = APIRouter(prefix="/api", tags=["gestures"])

GalleryId = Annotated[str, Query(max_length=64, description="id of a gallery")]


def gesture_json(gesture: Gesture) -> dict[str, Any]:
    """A gesture as the REST interface shows it."""
    return {
        "id": gesture.id,
        "name": gesture.name,
        "action": ACTION.dump_python(gesture.action, mode="json", exclude_none=True),
        "active": gesture.active,
        "version": gesture.version,
        "gallery": gesture.gallery,
        "taught": gesture.taught,
        "samples": len(gesture.samples),
        "sample_ids": [sample.id for sample in gesture.samples],
        "created": gesture.created.isoformat(),
        "updated": gesture.updated.isoformat(),
    }


def hub_of(request: Request) -> "Hub":
    """What the routes share."""
    hub: Hub = request.app.state.hub
    return hub


@router.get(
    "/gestures",
    summary="All enrolled gestures of a gallery",
    responses={404: {"description": "unknown gallery"}},
)
async def list_gestures(request: Request, gallery: GalleryId = SHARED) -> list[dict[str, Any]]:
    """All gestures, in the order in which they were enrolled."""
    hub = hub_of(request)
    gestures = await hub.database(hub.store.list, gallery)
    return [gesture_json(gesture) for gesture in gestures]


@router.post(
    "/gestures",
    status_code=201,
    summary="Enrol a gesture",
    openapi_extra={"requestBody": ENROL_BODY},
    responses={
        **BAD_BODY,
        404: {"description": "unknown gallery"},
        409: {"description": "the name is taken"},
        413: {"description": "too many bytes"},
        422: {"description": "a bad name or action, or an image without a hand"},
    },
)
async def create_gesture(request: Request, response: Response) -> dict[str, Any]:
    """Enrol a gesture from one or more images: whole, or not at all.

    With ``burst`` the images are the frames of a few seconds, of which the best are kept.
    """
    hub = hub_of(request)
    with hub.uploads.one():
        return await _create(hub, request, response)


async def _create(hub: "Hub", request: Request, response: Response) -> dict[str, Any]:
    known = {"name", "action", "active", "gallery"}
    upload = await read_enrolment(request, hub.settings.gateway, known)
    for field in ("name", "action"):
        if field not in upload.fields:
            raise Invalid(f"the field {field!r} is missing", field=field)
    active = upload.flag("active", True)
    name = clean_name(upload.fields["name"])
    action = parse_action(parse_json(upload.fields["action"], "action"))
    gallery = upload.gallery
    await hub.database(hub.store.galleries.get, gallery)

    async def look() -> tuple[Judged, list[dict[str, Any]]]:
        judged = await judge_for_enrolment(hub, upload.images, burst=upload.burst)
        return judged, await confusions_of(hub, gallery, name, judged.templates)

    judged, confusions = await while_connected(request, look())
    still_allowed(request)
    offer = UndoOffer(hub.store)
    gesture = await hub.database(
        hub.store.create,
        name,
        action,
        judged.templates,
        landmarks=judged.landmarks,
        active=active,
        gallery=gallery,
        undo_as=offer.id,
    )
    await hub.gallery_changed()
    offer.to(response)
    response.headers["Location"] = f"/api/gestures/{gesture.id}"
    return _enrolled_json(gesture, judged, upload.burst, confusions)


async def confusions_of(
    hub: "Hub", gallery: str, name: str, templates: list[bytes], besides: str | None = None
) -> list[dict[str, Any]]:
    """What a gesture with these templates may be confused with; ``besides`` is its own id.

    Raises:
        NotFound: no gallery has this id.
    """
    gestures = await hub.database(hub.store.list, gallery)
    others = [gesture for gesture in gestures if gesture.id != besides]
    if not templates or not others:
        return []
    sets, threshold = sets_of(name, templates, others), await _threshold(hub, gallery)
    match = hub.settings.pipeline.match
    found = await hub.pictures.run(compare, sets, match, threshold, [0], cpu_s=LONG_CPU_S)
    return found_json(found, others, threshold)


async def enrolled_in(hub: "Hub", gallery: str) -> Enrolled:
    """What a gallery holds; it is learned first, where nobody uses it.

    Raises:
        NotFound: no gallery has this id.
    """
    known = hub.gallery.known(gallery)
    return await hub.learners(hub.gallery.of, gallery) if known is None else known


async def _threshold(hub: "Hub", gallery: str) -> float:
    """Largest distance at which a match is accepted."""
    return (await enrolled_in(hub, gallery)).matcher.max_distance


def _enrolled_json(
    gesture: Gesture, judged: Judged, burst: bool, confusions: list[dict[str, Any]]
) -> dict[str, Any]:
    answer = {**gesture_json(gesture), "images": judged.images_json(), "confusions": confusions}
    return {**answer, "burst": judged.burst_json()} if burst else answer


@router.post(
    "/gestures/check",
    summary="Judge images as enrolment would; nothing is stored",
    openapi_extra={"requestBody": CHECK_BODY},
    responses={
        **BAD_BODY,
        404: {"description": "unknown id in 'gesture' or 'gallery'"},
        413: {"description": "too many bytes"},
        422: {"description": "a bad name or action, or no image"},
    },
)
async def check_gesture(request: Request) -> dict[str, Any]:
    """Judge images before they are enrolled: are they good, and what may be confused with them?"""
    hub = hub_of(request)
    with hub.uploads.one():
        return await _check(hub, request)


async def _check(hub: "Hub", request: Request) -> dict[str, Any]:
    known = {"name", "action", "active", "gesture", "gallery"}
    upload = await read_enrolment(request, hub.settings.gateway, known)
    upload.flag("active", True)
    name, besides, samples, gallery = "the new gesture", None, [], upload.gallery
    if "gesture" in upload.fields:
        gesture = await hub.database(hub.store.get, upload.fields["gesture"])
        if "gallery" in upload.fields and gallery != gesture.gallery:
            raise Invalid("'gesture' is not in 'gallery'; leave one of them out", field="gallery")
        name, besides, gallery = gesture.name, gesture.id, gesture.gallery
        samples = [sample.template for sample in gesture.samples]
    if "name" in upload.fields:
        name = clean_name(upload.fields["name"])
    if "action" in upload.fields:
        parse_action(parse_json(upload.fields["action"], "action"))

    async def look() -> tuple[Judged, list[dict[str, Any]]]:
        judged = await judge(hub, upload.images, burst=upload.burst)
        if not judged.kept:
            return judged, []
        templates = samples + judged.templates
        return judged, await confusions_of(hub, gallery, name, templates, besides)

    judged, confusions = await while_connected(request, look())
    return {
        "images": judged.images_json(),
        "accepted": len(judged.kept),
        "left_out": judged.left_out,
        "confusions": confusions,
        "threshold": await _threshold(hub, gallery),
    }


@router.get(
    "/gestures/confusions",
    summary="Which gestures of a gallery may be taken for one another",
    responses={404: {"description": "unknown gallery"}},
)
async def list_confusions(request: Request, gallery: GalleryId = SHARED) -> dict[str, Any]:
    """All gestures against all others, active or not, and what would help."""
    hub = hub_of(request)
    version = await hub.database(lambda: hub.store.version)
    cached: tuple[int, dict[str, Any]] = getattr(request.app.state, "confusions", (version, {}))
    answers = cached[1] if cached[0] == version else {}
    answer: dict[str, Any] | None = answers.get(gallery)
    if answer is None:
        gestures = await hub.database(hub.store.list, gallery)
        threshold = await _threshold(hub, gallery)
        sets = [set_of(gesture) for gesture in gestures]
        match = hub.settings.pipeline.match
        found = await while_connected(
            request, hub.pictures.run(compare, sets, match, threshold, cpu_s=LONG_CPU_S)
        )
        answer = matrix_json(found, gestures, threshold)
        request.app.state.confusions = version, {**answers, gallery: answer}
    return answer


@router.get("/gestures/{id}", summary="One gesture", responses={404: {"description": "unknown id"}})
async def get_gesture(request: Request, id: str) -> dict[str, Any]:
    """One gesture."""
    hub = hub_of(request)
    return gesture_json(await hub.database(hub.store.get, id))


@router.delete(
    "/gestures/{id}",
    status_code=204,
    summary="Forget a gesture",
    responses={404: {"description": "unknown id"}},
)
async def delete_gesture(request: Request, id: str) -> Response:
    """Forget a gesture and its samples."""
    hub = hub_of(request)
    offer = UndoOffer(hub.store)
    await hub.database(hub.store.delete, id, undo_as=offer.id)
    await hub.gallery_changed()
    response = Response(status_code=204)
    offer.to(response)
    return response


@router.post(
    "/gestures/{id}/samples",
    status_code=201,
    summary="Enrol more images of a gesture",
    openapi_extra={"requestBody": SAMPLES_BODY},
    responses={
        **BAD_BODY,
        404: {"description": "unknown id"},
        413: {"description": "too many bytes"},
        422: {"description": "an image without a hand"},
    },
)
async def add_samples(
    request: Request,
    response: Response,
    id: str,
    replace: Annotated[bool, Query(description="in place of all samples so far")] = False,
) -> dict[str, Any]:
    """Enrol more images of a gesture: all of them, or none; of a burst the best."""
    hub = hub_of(request)
    with hub.uploads.one():
        return await _add(hub, request, response, id, replace)


async def _add(
    hub: "Hub", request: Request, response: Response, id: str, replace: bool
) -> dict[str, Any]:
    before = await hub.database(hub.store.get, id)
    upload = await read_enrolment(request, hub.settings.gateway, set())

    async def look() -> tuple[Judged, list[dict[str, Any]]]:
        judged = await judge_for_enrolment(hub, upload.images, burst=upload.burst)
        kept = [] if replace else [sample.template for sample in before.samples]
        templates = kept + judged.templates
        return judged, await confusions_of(hub, before.gallery, before.name, templates, id)

    judged, confusions = await while_connected(request, look())
    still_allowed(request)
    offer = UndoOffer(hub.store)
    gesture = await hub.database(
        hub.store.add_samples,
        id,
        judged.templates,
        landmarks=judged.landmarks,
        replace=replace,
        undo_as=offer.id,
    )
    await hub.gallery_changed()
    offer.to(response)
    return _enrolled_json(gesture, judged, upload.burst, confusions)


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
    hub = hub_of(request)
    gesture = await hub.database(hub.store.get, id)
    if sample >= len(gesture.samples):
        raise NotFound(
            f"{gesture.name} has {len(gesture.samples)} samples, counted from 0; "
            f"there is no number {sample}",
            sample=sample,
        )
    png = template_png(gesture.samples[sample].template)
    return Response(png, media_type="image/png", headers={"Cache-Control": "private, max-age=60"})


async def _recognise(hub: "Hub", image: bytes, enrolled: Enrolled) -> dict[str, Any]:
    try:
        extraction = await hub.pictures.run(extract_template, image, hub.settings.pipeline)
    except Unreadable:
        raise
    except ImageRefused as error:
        return {"match": None, "reason": error.message, "roi": None, "distances": {}}
    matched = await hub.learners(enrolled.matcher.match_photo, extraction)
    match = matched.match
    found = None
    if match is not None and match.accepted:
        found = {"gesture": match.gesture, "distance": match.distance, "margin": match.margin}
    return {
        "match": found,
        "reason": "no gesture is enrolled yet" if match is None else match.reason,
        "roi": list(extraction.roi),
        "distances": matched.distances,
        "threshold": enrolled.matcher.used_for(extraction.hand).max_distance,
    }


@router.post(
    "/recognise",
    summary="Which gesture does an image show?",
    openapi_extra={"requestBody": IMAGE_BODY},
    responses={
        **BAD_BODY,
        404: {"description": "unknown gallery"},
        413: {"description": "too many bytes"},
        422: {"description": "not an image"},
    },
)
async def recognise(request: Request) -> dict[str, Any]:
    """An image in (multipart field ``image``, or the body itself), the match out."""
    hub = hub_of(request)
    with hub.uploads.one():
        upload = await read_image(request, hub.settings.gateway.max_upload_bytes)
        (image,) = upload.images
        if not image:
            raise Invalid("the image is empty", field="image")
        enrolled = await enrolled_in(hub, upload.gallery)
        return await while_connected(request, _recognise(hub, image, enrolled))
