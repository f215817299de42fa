"""REST: a gallery as one file, out and in."""

import re
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING, Annotated, Any, Literal

from fastapi import APIRouter, Query, Request
from starlette.concurrency import iterate_in_threadpool
from starlette.responses import StreamingResponse

from app.gateway.bodies import ZIP_BODY
from app.gateway.body_watch import still_allowed
from app.gateway.errors import BAD_BODY
from app.gateway.gallery import with_starter
from app.gateway.jobs import Job
from app.gateway.learning import fit
from app.gateway.rest_gestures import hub_of
from app.gateway.undo_offer import UndoOffer
from app.gateway.uploads import read_file
from app.gateway.work_pool import CPU_S
from app.gestures.exchange import entries_of
from app.gestures.importing import Existing, Plan, import_entries, plan_of
from app.gestures.setfile import read_zip
from app.gestures.setwriter import zip_stream

if TYPE_CHECKING:
    from app.gateway.hub import Hub

router = APIRouter(prefix="/api", tags=["galleries"])

READ_BYTES = 512 << 20
"""Memory that reading a file may take: it unpacks to 64 MiB at most."""
ZIP_TYPES = ("application/zip", "application/x-zip-compressed", "application/octet-stream")


@router.get(
    "/galleries/{id}/export",
    summary="A gallery as a zip file in the exchange format",
    response_class=StreamingResponse,
    responses={
        200: {"content": {"application/zip": {}}, "description": "the file, as it is made"},
        404: {"description": "unknown id"},
    },
)
async def export_gallery(request: Request, id: str) -> StreamingResponse:
    """All its gestures, streamed gesture by gesture. Who hangs up ends it."""
    hub = hub_of(request)
    hub.exports.check()
    gallery = await hub.database(hub.store.galleries.get, id)
    entries = entries_of(await hub.database(hub.store.list, id))
    plain = re.sub(r"[^a-z0-9]+", "-", gallery.name.lower()).strip("-") or "gestures"

    async def stream() -> AsyncIterator[bytes]:
        with hub.exports.one():
            async for part in iterate_in_threadpool(zip_stream(entries)):
                yield part

    return StreamingResponse(
        stream(),
        media_type="application/zip",
        headers={"Content-Disposition": f'attachment; filename="farhand-{plain}.zip"'},
    )


@router.post(
    "/galleries/{id}/import",
    status_code=202,
    summary="Take a zip file in the exchange format into a gallery",
    openapi_extra={"requestBody": ZIP_BODY},
    responses={
        **BAD_BODY,
        404: {"description": "unknown id"},
        413: {"description": "too many bytes"},
        429: {"description": "too much long work at once"},
    },
)
async def start_import(
    request: Request,
    id: str,
    existing: Annotated[
        Existing, Query(description="what becomes of gestures whose names are taken")
    ] = "replace",
    check: Annotated[bool, Query(description="only say what would happen")] = False,
    plan: Annotated[
        str | None, Query(max_length=64, description="of the answer to check: do only that")
    ] = None,
) -> dict[str, Any]:
    """A job: reads the whole file, learns it, then takes in all of it or nothing."""
    hub = hub_of(request)
    hub.jobs.check_free()
    await hub.database(hub.store.galleries.get, id)
    with hub.uploads.one():
        data = await read_file(request, hub.settings.gateway.max_import_bytes, ZIP_TYPES)
    kind: Literal["import", "import_check"] = "import_check" if check else "import"

    async def work(job: Job) -> dict[str, Any]:
        if check:
            entries = await job.run(hub.long_work, read_zip, data, cpu_s=CPU_S, memory=READ_BYTES)
            there = await hub.database(hub.store.list, id)
            planned = await hub.database(plan_of, there, entries, existing)
            return {**plan_json(planned, existing), "change": None}
        offer = UndoOffer(hub.store)
        done = await _import(hub, data, id, existing, plan, job, offer, request)
        await hub.gallery_changed()
        return {**plan_json(done, existing), "change": offer.made}

    return hub.jobs.start(kind, work).as_json()


async def _import(
    hub: "Hub",
    data: bytes,
    id: str,
    existing: Existing,
    expected: str | None,
    job: Job,
    offer: UndoOffer,
    request: Request,
) -> Plan:
    # A third of the way each: to read it, to learn what the gallery will hold, to write it.
    # Learning takes longest, and comes before anything is changed, so that it can be cancelled.
    entries = await job.run(
        hub.long_work,
        read_zip,
        data,
        progress=lambda done, total: job.progress(done, 3 * total),
        cpu_s=CPU_S,
        memory=READ_BYTES,
    )
    read = len(entries)
    there = await hub.database(hub.store.list, id)
    planned = await hub.database(plan_of, there, entries, existing)
    if planned.entries and expected in (None, planned.digest):  # else it is refused below
        samples = with_starter(planned.after(there))
        matcher = await job.run(
            hub.long_work,
            fit,
            samples,
            hub.settings.pipeline,
            progress=lambda done, total: job.progress(read + read * done // total, 3 * read),
        )
        hub.gallery.prepared(samples, matcher)
    still_allowed(request)
    return await hub.database(
        import_entries,
        hub.store,
        entries,
        existing,
        gallery=id,
        expected=expected,
        progress=lambda done, total: job.progress(2 * read + read * done // total, 3 * read),
        undo_as=offer.id,
    )


def plan_json(found: Plan, existing: Existing) -> dict[str, Any]:
    """What importing does, as docs/protocol.md shows it."""
    return {
        "plan": found.digest,
        "existing": existing,
        "gestures": [
            {
                "name": entry.name,
                "fate": fate,
                "samples": len(entry.templates),
                "samples_now": samples_now,
            }
            for entry, fate, samples_now in found.steps
        ],
    }
