"""REST: the timeline of what happened."""

import json
from collections.abc import Collection, Iterator
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Path, Query, Request
from starlette.responses import Response, StreamingResponse

from app.gateway.auth import identity_of
from app.gateway.rest_gestures import hub_of
from app.gestures import template_png
from app.memory import KINDS, OPERATORS_KINDS, Event, EventStore, Kind

router = APIRouter(prefix="/api", tags=["timeline"])

MOST = 200
"""Events of one page."""
UNCHANGING = {"Cache-Control": "private, max-age=86400, immutable"}
_GONE: dict[int | str, dict[str, Any]] = {503: {"description": "nothing is remembered"}}

Kinds = Annotated[
    list[Kind] | None, Query(description="only these, as kind=stop&kind=fault; all unless given")
]
Id = Annotated[int, Path(ge=1, le=2**63 - 1)]


def event_json(event: Event) -> dict[str, Any]:
    """An event as the REST interface shows it."""
    took = event.took_ms
    return {
        "id": event.id,
        "time": datetime.fromtimestamp(event.at_ms / 1000, UTC).isoformat(timespec="milliseconds"),
        "kind": event.kind,
        "data": event.data,
        "duration_s": None if took is None else round(took / 1000, 3),
        "picture": event.picture,
        "template": event.template,
    }


def seen_by(request: Request, wanted: Collection[Kind] | None = None) -> list[Kind]:
    """The kinds of events that whoever asks is shown; of these the ``wanted`` ones."""
    identity = identity_of(request.scope)
    hidden = frozenset() if identity and identity.role == "operator" else OPERATORS_KINDS
    return [kind for kind in KINDS if kind not in hidden and (not wanted or kind in wanted)]


@router.get("/timeline", summary="What happened, newest first", responses=_GONE)
async def list_events(
    request: Request,
    kind: Kinds = None,
    before: Annotated[
        int | None, Query(ge=1, le=2**63 - 1, description="only those older than this id")
    ] = None,
    limit: Annotated[int, Query(ge=1, le=MOST)] = 50,
) -> dict[str, Any]:
    """A page of events. ``before`` in the answer asks for the next one; null at the end."""
    hub = hub_of(request)
    diary = hub.diary
    kinds = seen_by(request, kind)
    page = await hub.database(diary.events.page, limit, before=before, kinds=kinds)
    return {
        "events": [event_json(event) for event in page],
        "before": page[-1].id if len(page) == limit else None,
        "lost": diary.lost,
    }


@router.get(
    "/timeline.jsonl",
    summary="Everything that happened, as JSON lines",
    response_class=StreamingResponse,
    responses={200: {"content": {"application/jsonl": {}}}, **_GONE},
)
async def export_events(request: Request, kind: Kinds = None) -> StreamingResponse:
    """One event a line, newest first, as a file to keep."""
    lines = _lines(hub_of(request).diary.events, seen_by(request, kind))
    return StreamingResponse(
        lines,
        media_type="application/jsonl",
        headers={"Content-Disposition": 'attachment; filename="farhand-timeline.jsonl"'},
    )


def _lines(events: EventStore, kinds: list[Kind]) -> Iterator[str]:
    for event in events.all(kinds):
        yield json.dumps(event_json(event), ensure_ascii=False, separators=(",", ":")) + "\n"


@router.get(
    "/timeline/{id}/picture.jpg",
    summary="The robot when an event began",
    response_class=Response,
    responses={
        200: {"content": {"image/jpeg": {}}, "description": "160 pixels at most"},
        404: {"description": "unknown id, or it has none"},
        **_GONE,
    },
)
async def picture(request: Request, id: Id) -> Response:
    """A small picture of the robot."""
    hub = hub_of(request)
    events = hub.diary.events
    jpeg = await hub.database(events.blob, id, "picture", seen_by(request))
    return Response(jpeg, media_type="image/jpeg", headers=UNCHANGING)


@router.get(
    "/timeline/{id}/template.png",
    summary="The hand that an event is about",
    response_class=Response,
    responses={
        200: {"content": {"image/png": {}}, "description": "60x80, one bit, hand white"},
        404: {"description": "unknown id, or it has none"},
        **_GONE,
    },
)
async def template(request: Request, id: Id) -> Response:
    """The template that was seen, or taught."""
    hub = hub_of(request)
    events = hub.diary.events
    bits = await hub.database(events.blob, id, "template", seen_by(request))
    return Response(template_png(bits), media_type="image/png", headers=UNCHANGING)
