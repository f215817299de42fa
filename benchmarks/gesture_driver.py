"""Somebody who drives a robot by gestures: looks, raises a hand, lowers it in time, looks again.

The eyes are the robot's published state over REST, as late as a person's; the hands are a
:class:`~benchmarks.live_webcam.LiveWebcam`. Nothing else reaches the robot.
"""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from types import TracebackType
from typing import Any, Self

import httpx
import numpy as np
from numpy.typing import NDArray

from app.link.messages import State
from benchmarks.live_webcam import Clock, LiveWebcam

F64 = NDArray[np.float64]
REACTION_S = 0.2
"""From seeing to acting; simple reactions to something seen take about so long."""
LOOK_S = 0.04
"""The state is read so often."""
MOVES = {
    0: ("forward", "back"),
    1: ("left", "right"),
    2: ("up", "down"),
}
"""Gestures of the starter set by axis of the base: towards more, towards less."""
STARTS_S = 1.5
"""When a hand at rest has moved nothing for so long, it is lowered and shown again."""
ASTRAY_M = 0.012
"""When the tool has gone so far another way than wanted, the sign was taken for another: the hand
is lowered and shown a little differently."""
STILL_M = 0.001
"""The tool has not come farther than this: it stood."""


LEARNS = 0.4
"""Part of a surprise about how far the tool runs on that is expected the next time."""
CRAWLS_S = 0.45
"""Who lowers the hand later than so long after the tool has started does so at its full speed, once
the hand is down."""


class CannotDrive(RuntimeError):
    """The robot does not do what is shown, however often."""


class Eyes:
    """What has been seen of the robot, and when."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.seen: deque[tuple[float, State]] = deque(maxlen=100)

    def now(self) -> State:
        """The newest state; for what measures, and for who has looked long enough."""
        return self.seen[-1][1]

    def see(self, ago: float = REACTION_S) -> State:
        """The state as a person acts on it now: ``ago`` s old."""
        before = self.clock.now() - ago
        old = [state for at, state in list(self.seen) if at <= before]
        return old[-1] if old else self.seen[0][1]


class RemoteEyes(Eyes):
    """Reads the states over REST. A context manager."""

    def __init__(self, api: httpx.Client, robot: str = "puma") -> None:
        super().__init__(Clock())
        self._api = api
        self._path = f"/api/robots/{robot}"
        self._over = threading.Event()
        self._first = threading.Event()
        self._thread = threading.Thread(target=self._look, name="eyes", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        if not self._first.wait(20):
            raise CannotDrive("the robot is not seen")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._over.set()
        self._thread.join(20)

    def _look(self) -> None:
        while not self._over.wait(LOOK_S):
            try:
                answer: dict[str, Any] = self._api.get(self._path).json()
            except httpx.TransportError:
                return  # the server is gone, and so is the robot
            if answer["state"] is not None:
                state = State.model_validate(answer["state"] | {"fault": answer["fault"]})
                self.seen.append((self.clock.now(), state))
                self._first.set()


@dataclass(frozen=True)
class Showing:
    """One raising of a hand."""

    gesture: str
    began: float
    """s, monotonic, as all times here: the hand starts on its way up."""
    rested: float
    """It is held still."""
    moved: float | None
    """The robot is seen moving; None: it did not."""
    let_go: float
    """The hand starts on its way down."""
    stood: float
    """The robot is seen standing."""
    way: float
    """m, how far the tool came, with its sign along the axis; 0 for other gestures."""


@dataclass
class GestureDriver:
    """Brings the tool where it is wanted, one axis at a time, and opens and closes the gripper.

    A person knows after a few tries how far the tool runs on after the hand is lowered, from a
    crawl and from full speed; so does this: ``runs_on`` is what was seen lately.
    """

    webcam: LiveWebcam
    eyes: Eyes
    patience_s: float = 180.0
    """From the first showing on; then it gives up."""
    runs_on: dict[str, float] = field(default_factory=lambda: {"crawl": 0.015, "full": 0.06})
    """m, from letting go (as seen then, a reaction late) to standing."""
    showings: list[Showing] = field(default_factory=list)
    astray: bool = False
    """The last showing was taken for another sign, and the tool is where it should not be."""
    _gives_up: float | None = None
    _since: float | None = None
    """Since when the robot has been seen moving in this showing."""

    @property
    def clock(self) -> Clock:
        """The hand's."""
        return self.webcam.clock

    def to(self, axis: int, target: float, within: float) -> float:
        """Bring one coordinate of the tool to ``target``, in one showing or more.

        Breaks off where a sign that was mistaken has led elsewhere, see :attr:`astray`, or where
        something is in the way.

        Returns:
            How far off it is in the end, m.

        Raises:
            CannotDrive: patience is at its end, or the robot is stopped.
        """
        self.astray = False
        while abs(off := target - _tool(self.eyes.now())[axis]) > within:
            self._jog(axis, off, target)
            if self.astray or self._blocked():
                break
        return float(off)

    def grip(self, gesture: str, done: Callable[[State], bool]) -> None:
        """Show a gripper's gesture until ``done`` says so of what is seen.

        Raises:
            CannotDrive: patience is at its end, or the robot is stopped.
        """
        while not done(self.eyes.now()):
            self._show(gesture, None, lambda: done(self.eyes.see()), 3.0)

    def _jog(self, axis: int, off: float, target: float) -> None:
        """One showing towards the target."""
        towards = 1.0 if off > 0 else -1.0
        gesture = MOVES[axis][0 if off > 0 else 1]

        def there() -> bool:
            left = towards * (target - _tool(self.eyes.see())[axis])
            return bool(left <= self.runs_on[self._speed()])

        self._show(gesture, axis, there, abs(off) / 0.01)

    def _show(
        self, gesture: str, axis: int | None, enough: Callable[[], bool], longest: float
    ) -> None:
        """Raise the hand, hold it until it was enough, lower it, wait until the robot stands."""
        self._ready()
        self._since = None
        began, start = self.clock.now(), _tool(self.eyes.now())
        rested = self.webcam.raise_hand(gesture)
        while not self._lets_go(rested, enough, longest) and not self._leads_astray(
            axis, gesture, start
        ):
            self.clock.sleep(0.01)
        self.astray = self._leads_astray(axis, gesture, start)
        speed, driving = self._speed(), self.eyes.now().mode == "moving"
        seen = _tool(self.eyes.see())
        self.webcam.lower_hand(wait=False)
        let_go = self.clock.now()
        while self.eyes.now().mode == "moving" and self.clock.now() - let_go < 5:
            self.clock.sleep(0.01)
        stood = self.clock.now()
        self.webcam.lower_hand()
        end = _tool(self.eyes.now())
        way = 0.0 if axis is None else float(end[axis] - start[axis])
        if axis is not None and driving:
            runs_on = abs(float(end[axis] - seen[axis]))
            self.runs_on[speed] += LEARNS * (runs_on - self.runs_on[speed])
        self.showings.append(Showing(gesture, began, rested, self._since, let_go, stood, way))
        broken_off = axis is not None and not driving and self.eyes.see().mode == "armed"
        if self._since is None or broken_off or self.astray:
            # The sign was not understood, or not all the time: show it a little differently.
            self.webcam.person = replace(self.webcam.person, seed=self.webcam.person.seed + 1)

    def _leads_astray(self, axis: int | None, gesture: str, start: F64) -> bool:
        """The robot is seen to go elsewhere than what was shown says."""
        moved = _tool(self.eyes.see()) - start
        if axis is not None:
            towards = 1.0 if gesture == MOVES[axis][0] else -1.0
            moved[axis] = min(0.0, towards * moved[axis])
        return bool(np.abs(moved).max() > ASTRAY_M)

    def _lets_go(self, rested: float, enough: Callable[[], bool], longest: float) -> bool:
        """Whether to lower the hand now, which has been held still since ``rested``."""
        now, mode = self.clock.now(), self.eyes.now().mode
        if self._since is None:
            if mode == "moving":
                self._since = now
            return now - rested > STARTS_S
        if now - self._since < REACTION_S:
            return False
        # What holds the robot still, or is done, needs no hand any more.
        return enough() or now - self._since > longest or self.eyes.see().mode != "moving"

    def _speed(self) -> str:
        """How fast the tool goes now, as far as a person tells by the time it has gone."""
        since = self._since
        return "full" if since is not None and self.clock.now() - since > CRAWLS_S else "crawl"

    def _ready(self) -> None:
        """Wait, with the hand down, until the robot may move again."""
        if self._gives_up is None:
            self._gives_up = self.clock.now() + self.patience_s
        if self.clock.now() > self._gives_up:
            raise CannotDrive(f"not done within {self.patience_s:.0f} s")
        deadline = self.clock.now() + 10
        while (state := self.eyes.now()).mode != "armed":
            if state.mode in ("stopped", "faulted") or self.clock.now() > deadline:
                raise CannotDrive(f"the robot is {state.mode}: {state.fault or state.reason}")
            self.clock.sleep(0.01)

    def _blocked(self) -> bool:
        """Something keeps the tool from going on: it did what was shown, and came nowhere."""
        # Once may be a sign that was taken for another, such as the gripper's.
        last = self.showings[-2:]
        return len({showing.gesture for showing in last}) == 1 < len(last) and all(
            showing.moved is not None and abs(showing.way) < STILL_M for showing in last
        )


def _tool(state: State) -> F64:
    return np.asarray(state.tool_position)
