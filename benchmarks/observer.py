"""Somebody who only watches a node, over a link of its own, and measures at the joints.

All times are of the node's clock: its ticks, ms. On one machine that is ``time.monotonic()``, which
is the same for all processes, so that what a benchmark does itself has a tick, too.
"""

import asyncio
import time
from collections.abc import Callable
from typing import NamedTuple, Self

import zenoh

from app.link.actions import JogJoint
from app.link.messages import COMMAND_TTL_MS, Command, State, key
from app.link.reading import decode
from app.link.session import open_session

ROBOT = "puma"
MOVING = 0.02
"""rad/s; a joint that is measured to be faster moves."""
FULL = 1.3
"""rad/s; joint 1 jogs at 95% of 1.43."""
FULL_SPEED = 4.3
"""rad/s; more than any joint can, so that its limit is its speed."""
STANDSTILL_MS = 500.0
"""What is promised: from the last valid frame to standstill, whatever failed."""
_CONNECT_S = 60.0


def tick_now() -> int:
    """The tick of this moment on a node on this machine."""
    return time.monotonic_ns() // 1_000_000


class Standstill(NamedTuple):
    """How an arm came to rest."""

    since_command_ms: float
    """From the tick that the last command carried, which is never later than its frame's
    arrival at the gateway, to the first state in which the arm stands."""
    since_fault_ms: float
    """From the fault to the same state; 0 when it stood before."""
    at: int
    """Tick of that state."""
    since_obeyed_ms: float | None
    """From the tick of the last command that the node itself obeyed, by when it held for want of
    the next, as if that one had lived its full 250 ms: at most; None where it came to rest for
    another reason. Shorter than the first of these: the one that watches missed a command or
    two."""


class Observer:
    """Keeps every state of a node and every command to it, with the tick of its arrival.

    Args:
        endpoint: Of the node; waited for.
    """

    def __init__(self, endpoint: str) -> None:
        self.states: list[State] = []
        self.commands: list[tuple[int, Command]] = []
        deadline = time.monotonic() + _CONNECT_S
        while True:
            try:
                self._session = open_session(endpoint, listen=False)
                break
            except Exception:
                if time.monotonic() > deadline:
                    raise
                time.sleep(0.1)
        self._subscribers = [
            self._session.declare_subscriber(key(ROBOT, "state"), self._take_state),
            self._session.declare_subscriber(key(ROBOT, "command"), self._take_command),
        ]
        wait(lambda: self.states, "the first state")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._session.close()  # type: ignore[no-untyped-call]

    def _take_state(self, sample: zenoh.Sample) -> None:
        state = decode(State, sample.payload.to_bytes())
        if state is not None:
            self.states.append(state)

    def _take_command(self, sample: zenoh.Sample) -> None:
        command = decode(Command, sample.payload.to_bytes())
        if command is not None:
            self.commands.append((tick_now(), command))

    @property
    def state(self) -> State:
        """The newest state."""
        return self.states[-1]

    def at_full_speed(self) -> bool:
        """Whether joint 1 jogs as fast as it can."""
        state = self.state
        fresh = tick_now() - state.tick < 100
        return fresh and isinstance(state.action, JogJoint) and abs(state.velocities[0]) > FULL

    def direction(self) -> int:
        """Which way to jog joint 1 next, to stay in the middle of its range: 1 or -1."""
        return -1 if self.state.joints[0] > 0 else 1

    def forget(self) -> None:
        """Forget all but the newest state."""
        del self.states[:-1]
        self.commands.clear()

    def stands(self) -> bool:
        """Whether the arm stands, as last measured."""
        return not _moves(self.state)

    def standstill(self, fault: int, until: int) -> Standstill:
        """How the arm came to rest between the ticks ``fault`` and ``until``.

        Raises:
            RuntimeError: it moved to the end.
        """
        seen = [state for state in self.states if state.tick <= until]
        last = max((number for number, state in enumerate(seen) if _moves(state)), default=-1)
        if last + 1 >= len(seen):
            raise RuntimeError(f"the arm still moved {until - fault} ms after the fault")
        at = seen[last + 1].tick
        heard = [
            command.tick
            for arrived, command in self.commands
            if arrived <= until and arrived - command.tick <= command.ttl_ms
        ]
        lapsed = [
            step.tick
            for step in seen[last + 1].transitions
            if step.tick > fault and (step.reason or "").startswith("no command in time")
        ]
        return Standstill(
            at - max(heard, default=fault),
            max(0.0, at - fault),
            at,
            at - (lapsed[0] - COMMAND_TTL_MS) if lapsed else None,
        )

    def moved_between(self, begin: int, end: int) -> bool:
        """Whether the arm moved after ``begin``, up to ``end``."""
        return any(_moves(state) for state in self.states if begin < state.tick <= end)


def _moves(state: State) -> bool:
    return max(map(abs, state.velocities)) > MOVING


def wait(condition: Callable[[], object], what: str, seconds: float = 60.0) -> None:
    """Wait until something is so.

    Raises:
        TimeoutError: it did not become so.
    """
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"waited {seconds:g} s in vain: {what}")
        time.sleep(0.005)


async def wait_async(condition: Callable[[], object], what: str, seconds: float = 60.0) -> None:
    """:func:`wait` beside other tasks."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"waited {seconds:g} s in vain: {what}")
        await asyncio.sleep(0.005)
