"""What is bounded: threads that wait for something, and places."""

import asyncio
import threading

import pytest

from app.gateway.busy import BoundedThreads, Busy, Slots
from app.gateway.errors import error_response


async def test_as_many_wait_as_may_and_one_more_is_told_when_to_come_again() -> None:
    threads, go = BoundedThreads("test", 1, 1), threading.Event()
    try:
        running = asyncio.create_task(threads(go.wait, 20))
        waits = asyncio.create_task(threads(pow, 2, 3))
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        with pytest.raises(Busy, match="too many requests wait") as caught:
            await threads(pow, 2, 4)
        answer = error_response(caught.value)
        assert (answer.status_code, answer.headers["retry-after"]) == (429, "2")
        go.set()
        assert (await running, await waits) == (True, 8)
        assert await threads(pow, 2, exp=4) == 16
    finally:
        go.set()
        threads.close()


async def test_a_call_that_is_given_up_before_it_began_frees_its_place() -> None:
    threads, go = BoundedThreads("test", 1, 1), threading.Event()
    try:
        running = asyncio.create_task(threads(go.wait, 20))
        waits = asyncio.create_task(threads(pow, 2, 3))
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        waits.cancel()
        with pytest.raises(asyncio.CancelledError):
            await waits
        after = asyncio.create_task(threads(pow, 2, 4))
        await asyncio.sleep(0)
        go.set()
        assert (await running, await after) == (True, 16)
    finally:
        go.set()
        threads.close()


def test_places_are_given_back_whatever_happens() -> None:
    slots = Slots(1, "1 upload is under way")
    with pytest.raises(ZeroDivisionError), slots.one():
        with pytest.raises(Busy, match="1 upload is under way"):
            slots.check()
        raise ZeroDivisionError
    slots.check()
