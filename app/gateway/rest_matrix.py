"""REST: how often the gestures of a gallery are taken for one another."""

from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, Request

from app.gateway.gallery import Enrolled
from app.gateway.jobs import Job
from app.gateway.rest_gestures import enrolled_in, hub_of
from app.pipeline.mix_ups import MixUps, try_all

if TYPE_CHECKING:
    from app.gateway.hub import Hub

router = APIRouter(prefix="/api", tags=["galleries"])


@router.post(
    "/galleries/{id}/matrix",
    status_code=202,
    summary="Try the gallery's own samples: which are taken for which?",
    responses={
        404: {"description": "unknown id"},
        429: {"description": "too much long work at once"},
    },
)
async def start_matrix(request: Request, id: str) -> dict[str, Any]:
    """A job: each sample of an active gesture is shown to the matcher, itself left out."""
    hub = hub_of(request)
    hub.jobs.check_free()
    enrolled = await enrolled_in(hub, id)
    return hub.jobs.start("matrix", lambda job: mix_ups(hub, enrolled, job)).as_json()


async def mix_ups(hub: "Hub", enrolled: Enrolled, job: Job) -> dict[str, Any]:
    """The matrix of what a gallery holds, sample after sample.

    Raises:
        Cancelled: somebody cancelled the job.
    """
    names = [gesture.name for gesture in enrolled.content]
    tried = await job.run(hub.long_work, try_all, enrolled.matcher.best, names)
    return matrix_json(enrolled, tried)


def matrix_json(enrolled: Enrolled, found: MixUps) -> dict[str, Any]:
    """A matrix as docs/protocol.md shows it."""
    ids = enrolled.ids
    worst = found.worst
    return {
        "gallery": enrolled.gallery,
        "gestures": [
            {
                "id": gesture.id,
                "name": gesture.name,
                "samples": len(gesture.samples),
                "asked": sum(counts) + rejected,
            }
            for gesture, counts, rejected in zip(
                enrolled.content, found.counts, found.rejected, strict=True
            )
        ],
        "counts": found.counts,
        "rejected": found.rejected,
        "untested": [ids[name] for name in found.untested],
        "worst": worst
        and {
            **worst._asdict(),
            "shown": ids[worst.shown],
            "other": ids[worst.other],
            "teach": ids[worst.teach],
        },
    }
