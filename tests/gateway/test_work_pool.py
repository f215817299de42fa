"""Heavy work: in processes that stand back, within bounds, and ended when nobody waits for it."""

import asyncio
import os
import threading
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from app.errors import Invalid
from app.gateway.busy import Busy
from app.gateway.work_pool import Ended, TooMuchWork, WorkPool
from tests.gateway import held
from tests.gateway.running import wait_for

MEMORY = 256 << 20


@pytest.fixture
def pool() -> Iterator[WorkPool]:
    here = WorkPool(1, 2, MEMORY, 0)
    yield here
    here.close()


@pytest.fixture
def hold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "hold"
    path.touch()
    monkeypatch.setenv("HELD_WHILE", str(path))
    return path


def processes() -> list[psutil.Process]:
    return [
        each
        for each in psutil.Process().children()
        if "app.gateway.work_process" in " ".join(each.cmdline())
    ]


async def test_work_is_done_in_another_process_that_is_kept(pool: WorkPool) -> None:
    first = await pool.run(os.getpid)
    assert first != os.getpid()
    assert await pool.run(os.getpid) == first
    assert pool.call(pow, 2, 3) == 8


async def test_it_stands_back_and_has_no_secrets(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FARHAND_TOKEN", "secret")
    pool = WorkPool(1, 2, MEMORY, 7)
    try:
        before = os.getpriority(os.PRIO_PROCESS, 0)
        assert await pool.run(os.getpriority, os.PRIO_PROCESS, 0) == min(before + 7, 19)
        assert await pool.run(os.getenv, "FARHAND_TOKEN") is None
    finally:
        pool.close()


async def test_what_is_refused_there_is_refused_here(pool: WorkPool) -> None:
    with pytest.raises(Invalid, match="not 7") as caught:
        await pool.run(held.refuse, 7)
    assert (caught.value.code, caught.value.status) == ("invalid", 422)
    assert caught.value.detail == {"field": "value", "value": 7}


async def test_what_nobody_foresaw_is_an_error_and_the_process_goes_on(pool: WorkPool) -> None:
    pid = await pool.run(os.getpid)
    with pytest.raises(RuntimeError, match="KeyError"):
        await pool.run(held.fail)
    assert await pool.run(os.getpid) == pid


async def test_memory_is_bounded(pool: WorkPool) -> None:
    assert await pool.run(held.take, 100) == 100 << 20
    with pytest.raises(TooMuchWork, match="more than 256 MiB of memory"):
        await pool.run(held.take, 300)
    assert await pool.run(held.take, 100) == 100 << 20


async def test_processor_time_is_bounded(pool: WorkPool) -> None:
    with pytest.raises(TooMuchWork, match=r"more than 0\.1 s of computing"):
        await pool.run(held.burn, cpu_s=0.1)
    assert await pool.run(pow, 2, 3) == 8


async def test_a_crash_ends_one_piece_of_work(pool: WorkPool) -> None:
    with pytest.raises(TooMuchWork):
        await pool.run(held.crash)
    assert await pool.run(pow, 2, 3) == 8


async def test_whoever_gives_up_frees_the_place_at_once(pool: WorkPool, hold: Path) -> None:
    task = asyncio.create_task(pool.run(held.wait, grace_s=0.0))
    while not await asyncio.to_thread(processes):
        await asyncio.sleep(0.01)
    waiting = asyncio.create_task(pool.run(pow, 2, 3))
    await asyncio.sleep(0)
    task.cancel()
    with pytest.raises(asyncio.CancelledError):
        await task
    assert await waiting == 8
    assert hold.exists()


async def test_what_waits_is_bounded_and_what_was_given_up_does_not_count(
    pool: WorkPool, hold: Path
) -> None:
    running = pool.submit(held.wait)
    await asyncio.to_thread(wait_for, running.future.running)
    given_up, waits = pool.submit(pow, 2, 3), pool.submit(pow, 2, 4)
    with pytest.raises(Busy, match="too much waits") as caught:
        pool.submit(pow, 2, 5)
    assert caught.value.status == 429 and caught.value.detail["retry_after_s"] >= 1
    given_up.cancel()
    last = pool.submit(pow, 2, 5)
    hold.unlink()
    assert (await asyncio.wrap_future(waits.future), last.future.result(20)) == (16, 32)
    assert given_up.future.cancelled()


async def test_progress_is_told_and_what_it_raises_ends_the_work(pool: WorkPool) -> None:
    told: list[tuple[int, int]] = []
    task = pool.submit(held.tell, 10, progress=lambda done, total: told.append((done, total)))
    assert await asyncio.wrap_future(task.future) == "told"
    assert told == [(done, 10) for done in range(11)]

    def no_more(done: int, total: int) -> None:
        raise Invalid("no more")

    with pytest.raises(Invalid, match="no more"):
        await asyncio.wrap_future(pool.submit(held.tell, 10, progress=no_more).future)


def test_closing_ends_what_is_under_way(hold: Path) -> None:
    pool = WorkPool(1, 2, MEMORY, 0)
    running, waits = pool.submit(held.wait), pool.submit(pow, 2, 3)
    wait_for(running.future.running)
    pool.close()
    assert isinstance(running.future.exception(20), Ended)
    assert waits.future.cancelled()
    assert processes() == []
    assert not [each for each in threading.enumerate() if each.name == "work" and each.is_alive()]
    with pytest.raises(Busy):
        pool.submit(pow, 2, 3)
