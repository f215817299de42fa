"""Somebody who drives a controller with a fake arm, faster than time passes."""

from app.config import ArmMotionSettings
from app.link.actions import Action, JogJoint
from app.link.messages import Command, LeaseReply, LeaseRequest, State
from app.robot.controller import DT, Controller, tick_of
from app.robot.latch import StopLatch
from tests.robot.fakes import FakeArm

JOG = JogJoint(joint=1, velocity=1.0)


class Operator:
    """A controller with a fake arm, a clock of its own, and somebody who drives it."""

    def __init__(self, latch: StopLatch | None = None) -> None:
        self.arm = FakeArm()
        self.now = 1000.0
        self.controller = Controller(
            self.arm, "puma", ArmMotionSettings(), latch or StopLatch(None), self.now
        )
        self.epoch = 0
        self.sequence = 0

    @property
    def state(self) -> State:
        return self.controller.state(self.now)

    def ask(self, kind: str, holder: str = "anna", **more: object) -> LeaseReply:
        request = LeaseRequest(kind=kind, holder=holder, epoch=self.epoch, **more)
        reply = self.controller.answer(request, self.now)
        if kind == "take" and reply.granted:
            assert reply.epoch is not None
            self.epoch = reply.epoch
        return reply

    def command(self, action: Action | None, hold: int, **more: object) -> Command:
        self.sequence += 1
        values = {
            "epoch": self.epoch,
            "sequence": self.sequence,
            "tick": tick_of(self.now),
            "frame": self.sequence,
            "hold": hold,
            "gesture": None if action is None else action.type,
            "action": action,
        }
        return Command(**(values | more))

    def wait(self, seconds: float) -> None:
        for _ in range(round(seconds / DT)):
            self.now += DT
            self.controller.cycle(self.now)

    def show(self, action: Action | None, hold: int, seconds: float) -> None:
        """A command every eighth cycle, 30 a second."""
        for count in range(round(seconds / DT)):
            self.now += DT
            commands = [self.command(action, hold)] if count % 8 == 0 else []
            self.controller.cycle(self.now, commands)

    def ready(self) -> "Operator":
        assert self.ask("take").granted
        assert self.ask("arm").granted
        self.show(None, 0, 0.6)
        assert self.state.mode == "armed"
        return self

    def standstill_after(self, limit: float = 1.0) -> float:
        for count in range(round(limit / DT)):
            if not self.arm.velocities.any() and not self.controller.motion.busy:
                return count * DT
            self.wait(DT)
        raise AssertionError("still moving")
