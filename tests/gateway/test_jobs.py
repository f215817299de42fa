"""Long work: how far it is, how it ends, and that it ends."""

import asyncio
from typing import Any

import pytest

from app.errors import Invalid, NotFound
from app.gateway import jobs as module
from app.gateway.jobs import Busy, Job, Jobs


async def ended(jobs: Jobs, job: Job) -> dict[str, Any]:
    while job.state == "running":
        await asyncio.sleep(0)
    return jobs.get(job.id).as_json()


class Steps:
    """Work that goes on a step whenever it is told to."""

    def __init__(self) -> None:
        self.go = asyncio.Event()
        self.undone = False

    async def __call__(self, job: Job) -> dict[str, Any]:
        try:
            for done in range(3):
                job.progress(done, 3)
                await self.go.wait()
        except BaseException:
            self.undone = True
            raise
        return {"answer": 42}


async def test_a_job_tells_how_far_it_is_and_what_came_of_it() -> None:
    jobs, work = Jobs(), Steps()
    job = jobs.start("count", work)
    assert job.as_json() == {
        "id": job.id, "kind": "count", "state": "running", "done": 0, "total": 0,
        "result": None, "error": None,
    }  # fmt: skip
    await asyncio.sleep(0)
    assert (job.done, job.total) == (0, 3)
    work.go.set()
    told = await ended(jobs, job)
    assert (told["state"], told["result"], told["error"]) == ("done", {"answer": 42}, None)
    job.cancel()
    assert jobs.get(job.id).state == "done"


async def test_a_cancelled_job_ends_at_its_next_step() -> None:
    jobs, work = Jobs(), Steps()
    job = jobs.start("count", work)
    await asyncio.sleep(0)
    job.cancel()
    assert job.state == "running"
    work.go.set()
    told = await ended(jobs, job)
    assert (told["state"], told["result"], told["error"]) == ("cancelled", None, None)
    assert work.undone


async def test_a_job_that_fails_says_why_and_no_more_than_that(
    caplog: pytest.LogCaptureFixture,
) -> None:
    jobs = Jobs()

    async def refused(job: Job) -> dict[str, Any]:
        raise Invalid("not a zip file", field="file")

    async def broken(job: Job) -> dict[str, Any]:
        raise KeyError("secret")

    told = await ended(jobs, jobs.start("read", refused))
    assert told["state"] == "failed"
    assert told["error"] == {
        "code": "invalid", "message": "not a zip file", "detail": {"field": "file"},
    }  # fmt: skip
    told = await ended(jobs, jobs.start("read", broken))
    assert told["error"]["code"] == "internal"
    assert "secret" not in str(told)
    assert "a job (read) failed" in caplog.text


async def test_so_many_at_once_and_no_more() -> None:
    jobs, work = Jobs(), Steps()
    running = [jobs.start("count", work) for _ in range(module.MOST_RUNNING)]
    with pytest.raises(Busy, match="2 pieces of long work are under way"):
        jobs.start("count", work)
    work.go.set()
    for job in running:
        await ended(jobs, job)
    await ended(jobs, jobs.start("count", work))


async def test_how_a_job_ended_is_kept_for_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    jobs, work = Jobs(), Steps()
    work.go.set()
    first = jobs.start("count", work)
    await ended(jobs, first)
    with pytest.raises(NotFound, match="there is no job with the id 'nobody'"):
        jobs.get("nobody")
    monkeypatch.setattr(module, "MOST_KEPT", 1)
    second = jobs.start("count", work)
    await ended(jobs, second)
    with pytest.raises(NotFound):
        jobs.get(first.id)
    monkeypatch.setattr(module, "KEPT_S", -1.0)
    with pytest.raises(NotFound):
        jobs.get(second.id)


async def test_closing_waits_until_each_has_undone_what_it_began() -> None:
    jobs, work = Jobs(), Steps()
    job = jobs.start("count", work)
    await asyncio.sleep(0)
    closing = asyncio.create_task(jobs.close())
    await asyncio.sleep(0)
    assert not closing.done()
    work.go.set()
    await closing
    assert job.state == "cancelled"
    assert work.undone
