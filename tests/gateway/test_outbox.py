"""What waits for a browser."""

import asyncio
import json

import pytest

from app.gateway.outbox import CAPACITY, Outbox


async def drain(outbox: Outbox) -> list[dict]:
    messages = []
    while len(outbox):
        text = await outbox.get()
        assert text is not None
        messages.append(json.loads(text))
    return messages


async def test_messages_come_in_order() -> None:
    outbox = Outbox()
    for seq in range(3):
        outbox.put({"type": "gesture", "seq": seq})
    assert [message["seq"] for message in await drain(outbox)] == [0, 1, 2]


async def test_frames_and_robots_are_replaced_the_others_kept() -> None:
    outbox = Outbox()
    outbox.put({"type": "error", "n": 1})
    for n in range(5):
        outbox.put({"type": "frame", "n": n})
        outbox.put({"type": "robot", "n": n})
        outbox.put({"type": "gesture", "n": n})
    kinds = [(message["type"], message["n"]) for message in await drain(outbox)]
    assert kinds.count(("frame", 4)) == kinds.count(("robot", 4)) == 1
    assert len(kinds) == 8
    assert outbox.replaced == 8
    assert kinds[0] == ("error", 1)


async def test_it_waits_for_a_message() -> None:
    outbox = Outbox()
    waiting = asyncio.create_task(outbox.get())
    await asyncio.sleep(0)
    assert not waiting.done()
    outbox.put({"type": "pong"})
    assert await waiting == '{"type":"pong"}'


async def test_it_is_bounded() -> None:
    outbox = Outbox()
    for n in range(CAPACITY * 2):
        outbox.put({"type": "error", "n": n})
    assert len(outbox) == CAPACITY
    assert await outbox.get() is None


async def test_nan_never_leaves() -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        Outbox().put({"type": "frame", "motion": float("nan")})
