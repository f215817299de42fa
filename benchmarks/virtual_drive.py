"""Driving by gestures in one process and by a virtual clock.

The webcam's pictures, the pipeline, the decisions of the gateway, the robot node's controller and
the simulated arm are the product's own; between them are neither browser, nor network, nor another
process, and time passes only when somebody waits. So the same run gives the same figures whatever
else the machine does.
"""

from collections import deque
from typing import Literal

from app.config import ArmMotionSettings, PipelineSettings
from app.gateway.drive import Driver, Lease, Situation
from app.gateway.numbers import Counter
from app.gestures.starter import ACTIONS
from app.link.messages import Command, LeaseRequest
from app.pipeline import PcaMatcher, Pipeline
from app.robot.controller import DT, Controller
from app.robot.latch import StopLatch
from app.robot.sim.arm import SimulatedArm
from benchmarks.gesture_driver import LOOK_S, Eyes
from benchmarks.live_webcam import FPS, Clock, LiveWebcam
from benchmarks.pipeline_speed import starter_gallery
from benchmarks.streams.measure import to_jpeg
from benchmarks.streams.scene import U8

LAG_S = 0.12
"""From a picture's capture to its being processed: webcam, browser, encoding, network."""
RENEW_S = 0.5
_OPERATOR = "virtual"


class VirtualClock(Clock):
    """Time passes in a world."""

    def __init__(self, world: "VirtualWorld") -> None:
        self._world = world

    def now(self) -> float:
        """Seconds since the world began, and some."""
        return self._world.time

    def sleep(self, seconds: float) -> None:
        """Let the world run."""
        self._world.run(seconds)


class VirtualWorld:
    """A person, a webcam, and an armed robot that this person drives.

    Args:
        seed: Of the person.
        lag_s: From a picture's capture to its being processed.
        motion: How the arm moves.

    Attributes:
        time: s.
        webcam: What the person shows.
        eyes: What the person sees.
    """

    def __init__(
        self, seed: int, lag_s: float = LAG_S, motion: ArmMotionSettings | None = None
    ) -> None:
        self.time = 100.0
        clock = VirtualClock(self)
        # This person is drawn, and MediaPipe's networks know photographs.
        settings = PipelineSettings.model_validate({"landmarks": {"mode": "off"}})
        self.webcam = LiveWebcam(None, seed, clock=clock)
        self.eyes = Eyes(clock)
        self._lag_s = lag_s
        self._pipeline = Pipeline(settings, PcaMatcher.fit(starter_gallery(99), settings.match))
        self._driver = Driver(_OPERATOR, Counter(), Counter())
        self._arm = SimulatedArm()
        self._robot = Controller(
            self._arm, "puma", motion or ArmMotionSettings(), StopLatch(None), self.time
        )
        self._epoch = self._ask("take")
        self._ask("arm")
        self._under_way: deque[tuple[float, U8]] = deque()
        self._next_picture = self._next_look = self._next_renewal = self.time
        self._frames = 0
        self.run(1.0)

    def run(self, seconds: float) -> None:
        """Let time pass, in cycles of the robot's control loop."""
        end = self.time + seconds
        while self.time < end - DT / 2:
            self.time += DT
            if self.time >= self._next_picture:
                self._next_picture += 1 / FPS
                self._under_way.append((self.time + self._lag_s, next(self.webcam.pictures)))
            commands: list[Command] = []
            while self._under_way and self._under_way[0][0] <= self.time:
                commands += self._process(self._under_way.popleft()[1])
            if self.time >= self._next_renewal:
                self._next_renewal += RENEW_S
                self._ask("renew")
            self._robot.cycle(self.time, commands)
            if self.time >= self._next_look:
                self._next_look += LOOK_S
                self.eyes.seen.append((self.time, self._robot.state(self.time)))

    def close(self) -> None:
        """Give the simulated world back."""
        self._arm.close()

    def _process(self, picture: U8) -> list[Command]:
        """One picture: what the gateway does with it."""
        self._frames += 1
        result = self._pipeline(to_jpeg(picture), seq=self._frames, now=self.time)
        state = self._robot.state(self.time)
        situation = Situation(ACTIONS, Lease(self._epoch), state, at=self.time)
        decision = self._driver.decide(result.gesture, self._frames, situation)
        if decision.stop is not None:
            self._robot.stop(decision.stop)
        return [] if decision.command is None else [decision.command]

    def _ask(self, kind: Literal["take", "arm", "renew"]) -> int:
        epoch = None if kind == "take" else self._epoch
        request = LeaseRequest(kind=kind, holder=_OPERATOR, epoch=epoch)
        reply = self._robot.answer(request, self.time)
        if not reply.granted:
            raise RuntimeError(f"{kind}: {reply.code} {reply.reason}")
        return self._epoch if reply.epoch is None else reply.epoch
