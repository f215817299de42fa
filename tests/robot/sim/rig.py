"""A simulated robot under the node's own controller, faster than time passes."""

from collections.abc import Callable

import numpy as np
import pybullet

from app.config import ArmMotionSettings
from app.link.actions import Action
from app.link.messages import Command, LeaseRequest, StopCategory, StopRequest
from app.robot.arm import Reading
from app.robot.controller import DT, Controller
from app.robot.latch import StopLatch
from app.robot.sim.robot import simulated

STANDING = 0.02
"""rad/s or m/s"""


class Rig:
    """Takes the lease, arms, shows actions, stops."""

    def __init__(self, profile: str, *, objects: bool = True) -> None:
        self.arm = simulated(profile, "r", objects=objects)
        self.now = 100.0
        self.controller = Controller(self.arm, "r", ArmMotionSettings(), StopLatch(None), self.now)
        self._sequence = self._hold = 0
        self.controller.answer(LeaseRequest(kind="take", holder="a"), self.now)
        self.arm_again()

    def arm_again(self) -> None:
        epoch = self.controller.lease.epoch
        request = LeaseRequest(kind="arm", holder="a", epoch=epoch)
        assert self.controller.answer(request, self.now).granted
        self.wait(0.8)

    def reset(self) -> None:
        request = LeaseRequest(kind="reset", holder="a")
        assert self.controller.answer(request, self.now).granted
        self.arm_again()

    def cycle(self, action: Action | None = None) -> Reading:
        self.now += DT
        self._sequence += 1
        command = Command(
            epoch=self.controller.lease.epoch,
            sequence=self._sequence,
            tick=int(self.now * 1000),
            hold=self._hold,
            gesture=None if action is None else "g",
            action=action,
        )
        self.controller.cycle(self.now, [command])
        return self.controller.reading

    def wait(self, seconds: float) -> Reading:
        for _ in range(round(seconds / DT)):
            self.cycle()
        return self.controller.reading

    def show(
        self, action: Action, seconds: float, each: Callable[[], None] = lambda: None
    ) -> Reading:
        """Show an action for so long, or until it has ended by itself; then nothing, until rest."""
        self._hold += 1
        for number in range(round(seconds / DT)):
            self.cycle(action)
            each()
            if number > 5 and not self.controller.motion.busy:
                break
        return self.controller.reading

    def stop(self, category: StopCategory) -> float:
        """Stop; returns for how long it moved on, as measured, s."""
        self.controller.stop(StopRequest(category=category, source="test", reason="test"))
        moved = 0
        for number in range(1, 241):
            self.cycle()
            if np.abs(self.controller.reading.velocities).max() > STANDING:
                moved = number
        return moved * DT


def touching(arm: object) -> list[tuple[str, str]]:
    """What of the robot touches what: links by number, things by name; neighbours left out."""
    client, body = arm.client, arm.body  # type: ignore[attr-defined]
    names = {number: name for name, number in arm._links.items()}  # type: ignore[attr-defined]
    found = []
    for name, other in arm.objects.items():  # type: ignore[attr-defined]
        for point in pybullet.getClosestPoints(body, other, 0.0, physicsClientId=client):
            found.append((names[point[3]], name))
    links = range(-1, pybullet.getNumJoints(body, physicsClientId=client))
    parent = {
        link: pybullet.getJointInfo(body, link, physicsClientId=client)[16] for link in links[1:]
    }
    for a in links:
        for b in links[a + 2 :]:
            # Links joined by one or two joints overlap where they turn in one another.
            near = {a, parent.get(a), parent.get(parent.get(a, -2))}
            if b in near or {b, parent.get(b), parent.get(parent[b])} & {a}:
                continue
            if parent.get(a) is not None and parent.get(a) == parent[b]:
                continue
            if pybullet.getClosestPoints(body, body, 0.0, a, b, physicsClientId=client):
                found.append((names[a], names[b]))
    return sorted(set(found))
