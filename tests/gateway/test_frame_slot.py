"""The slot for a session's newest frame."""

import time
from functools import cache

import numpy as np
import pytest
import simplejpeg

from app.config import Settings
from app.errors import FrameRefused, NotAllowed
from app.gateway.drive import Situation
from app.gateway.frame_age import Age
from app.gateway.frame_slot import FrameSlot
from app.gateway.gallery import Enrolled, fit
from app.gateway.metrics import Metrics
from app.gateway.numbers import tick_ms
from app.gateway.roles import Role
from app.link.header import FrameHeader

SETTINGS = Settings(gateway={"detail_rate_hz": 1.0})  # type: ignore[arg-type]
ENROLLED = Enrolled(1, fit((), SETTINGS.pipeline))


@cache
def picture(width: int = 64, height: int = 48) -> bytes:
    return simplejpeg.encode_jpeg(np.zeros((height, width, 3), np.uint8), colorspace="BGR")


def message(seq: int, tick: int | None = None, jpeg: bytes | None = None) -> bytes:
    tick = tick_ms() if tick is None else tick
    return FrameHeader(seq, time.monotonic() * 1000, tick).pack() + (jpeg or picture())


class Slot(FrameSlot):
    """A slot whose situations can be looked at."""

    def __init__(self, role: Role = "operator") -> None:
        self.metrics = Metrics()
        super().__init__(role, SETTINGS, self.metrics, lambda: ENROLLED, self.situate)

    def situate(self, enrolled: Enrolled, now: float, age: Age) -> Situation:
        assert enrolled is ENROLLED
        return Situation({}, None, None, stale=age.stale, life_ms=age.life_ms, at=now)

    def counted(self, result: str) -> float:
        return float(self.metrics.frames.labels(result)._value.get())


async def test_a_frame_comes_out_as_it_went_in() -> None:
    slot = Slot()
    slot.put(message(5), arrival=9)
    job = await slot.take(1)
    assert job is not None
    assert (job.seq, job.arrival, job.jpeg) == (5, 9, picture())
    assert job.enrolled is ENROLLED
    assert job.situation.stale is None
    assert job.situation.at == job.arrived
    assert (job.detail, job.glass) == (False, False)


async def test_an_empty_slot_gives_nothing_after_a_while() -> None:
    slot = Slot()
    assert await slot.take(0.01) is None
    slot.put(message(1), arrival=1)
    assert await slot.take(1) is not None
    assert await slot.take(0.01) is None, "a frame comes out once"


async def test_a_newer_frame_replaces_the_one_that_waits_and_an_older_one_does_not() -> None:
    slot = Slot()
    for seq in (3, 4, 2, 4):
        slot.put(message(seq), arrival=seq)
    job = await slot.take(1)
    assert job is not None and job.seq == 4
    assert (slot.counted("replaced"), slot.counted("out_of_order")) == (1, 2)


async def test_a_frame_from_before_is_too_old_and_comes_out_all_the_same() -> None:
    slot = Slot()
    old = max(1, tick_ms() - 10 * SETTINGS.gateway.max_frame_age_ms)
    slot.put(message(1, tick=old), arrival=1)
    job = await slot.take(1)
    assert job is not None and job.situation.stale is not None
    assert "too old to move the robot" in job.situation.stale


async def test_a_view_is_made_no_oftener_than_asked_for() -> None:
    slot = Slot()
    slot.detail = slot.glass = True
    wanted = []
    for seq in range(20):
        slot.put(message(seq), arrival=seq)
        job = await slot.take(1)
        assert job is not None and job.glass
        wanted.append(job.detail)
    assert wanted[0]
    assert not all(wanted)


def test_what_cannot_be_a_frame_is_refused_before_it_waits() -> None:
    slot = Slot()
    limits = SETTINGS.pipeline.decode
    wide = picture(limits.max_width + 16, 16)
    heavy = picture() + bytes(limits.max_bytes)
    refusals = (
        (wide, "frame_too_large"),
        (heavy, "frame_too_large"),
        (b"GIF89a" + bytes(100), "frame_not_jpeg"),
    )
    for jpeg, code in refusals:
        with pytest.raises(FrameRefused) as refused:
            slot.put(message(7, jpeg=jpeg), arrival=1)
        assert refused.value.code == code
        assert refused.value.detail["seq"] == 7
    with pytest.raises(FrameRefused) as refused:
        slot.put(b"FH", arrival=1)
    assert "seq" not in refused.value.detail
    # What was refused counts for nothing: its number may come again.
    slot.put(message(7), arrival=2)
    assert slot.counted("out_of_order") == 0


def test_an_observers_frame_is_not_looked_at() -> None:
    with pytest.raises(NotAllowed, match="an observer's frames") as refused:
        Slot("observer").put(message(3), arrival=1)
    assert refused.value.detail["seq"] == 3
