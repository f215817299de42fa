from collections.abc import Iterator

import numpy as np
import pytest

from app.robot.arm import Vector
from app.robot.sim.arm import SimulatedArm
from app.robot.sim.world import STEPS_PER_SECOND


class Driver:
    """Drives a simulated arm smoothly, as the node's motion generator does."""

    def __init__(self, arm: SimulatedArm) -> None:
        self.arm = arm

    def wait(self, seconds: float) -> None:
        for _ in range(round(seconds * STEPS_PER_SECOND)):
            self.arm.step()

    def go(self, joints: Vector, seconds: float) -> float:
        """Move along a minimum-jerk path; returns the largest joint error on the way (rad)."""
        start, worst = self.arm.read().joints, 0.0
        for number in range(round(seconds * STEPS_PER_SECOND)):
            t = (number + 1) / round(seconds * STEPS_PER_SECOND)
            part = 10 * t**3 - 15 * t**4 + 6 * t**5
            speed = (30 * t**2 - 60 * t**3 + 30 * t**4) / seconds
            wanted = start + (joints - start) * part
            self.arm.move(wanted, (joints - start) * speed)
            self.arm.step()
            worst = max(worst, float(np.abs(self.arm.read().joints - wanted).max()))
        return worst


@pytest.fixture
def arm() -> Iterator[SimulatedArm]:
    arm = SimulatedArm()
    yield arm
    arm.close()


@pytest.fixture
def driver(arm: SimulatedArm) -> Driver:
    return Driver(arm)
