"""Stops that one session asks for."""

import asyncio

from app.errors import FarhandError
from app.gateway.lease_keeper import LeaseRefused
from app.gateway.stops import MAX_STOPS, Stops


class Robot:
    """Confirms a stop when it is let."""

    def __init__(self) -> None:
        self.reasons: list[str] = []
        self.sources: list[str] = []
        self.told: list[FarhandError] = []
        self.confirms = asyncio.Event()
        self.error: FarhandError | None = None
        self.stops = Stops(self.stop, self.sources.append, self.told.append)

    async def stop(self, reason: str, source: str) -> None:
        self.reasons.append(reason)
        await self.confirms.wait()
        if self.error is not None:
            raise self.error


async def turns() -> None:
    """Let everything that can run do so."""
    for _ in range(5):
        await asyncio.sleep(0)


async def test_a_stop_begins_without_waiting_and_is_counted_by_its_source() -> None:
    robot = Robot()
    robot.stops.begin("enough", "button")
    robot.stops.begin("a hand says stop", "gesture")
    await turns()
    assert robot.reasons == ["enough", "a hand says stop"]
    assert robot.sources == ["button", "gesture"]
    robot.confirms.set()
    await turns()
    assert robot.told == []


async def test_only_so_many_are_under_way_and_then_there_is_room_again() -> None:
    robot = Robot()
    for _ in range(3 * MAX_STOPS):
        robot.stops.begin("enough", "button")
    await turns()
    assert len(robot.reasons) == len(robot.sources) == MAX_STOPS
    robot.confirms.set()
    await turns()
    robot.stops.begin("again", "button")
    await turns()
    assert robot.reasons[-1] == "again"


async def test_one_that_is_not_confirmed_is_told() -> None:
    robot = Robot()
    robot.error = LeaseRefused("sent but not confirmed")
    robot.stops.begin("enough", "button")
    robot.confirms.set()
    await turns()
    assert robot.told == [robot.error]
