"""A motion and an arm without physics, for tests."""

import numpy as np

from app.config import ArmMotionSettings
from app.link.actions import Action
from app.robot.motion.motion import Motion
from tests.robot.fakes import DT, FakeArm


class Rig:
    """A motion with a fake arm; every step is checked against every limit."""

    def __init__(self, arm: FakeArm | None = None) -> None:
        self.arm = arm or FakeArm()
        self.motion = Motion(self.arm, ArmMotionSettings(), DT)
        self.track: list[np.ndarray] = [self.arm.joints.copy()]
        self.limits: set[str] = set()

    def step(self) -> None:
        motion, trajectory = self.motion, self.motion.trajectory
        before = (trajectory.position, trajectory.velocity, trajectory.acceleration)
        motion.step(self.arm.read())
        self.arm.move(trajectory.position, trajectory.velocity)
        self.arm.step()
        self.track.append(trajectory.position.copy())
        self.limits |= set(motion.limits)
        bounds, most = trajectory.limits, trajectory.limits.stop
        position, velocity, acceleration = before
        assert (trajectory.position <= bounds.upper + 1e-6).all()
        assert (trajectory.position >= bounds.lower - 1e-6).all()
        assert (np.abs(trajectory.velocity) <= most.velocity + 1e-6).all()
        assert (np.abs(trajectory.acceleration) <= most.acceleration + 1e-6).all()
        jerk = np.abs(trajectory.acceleration - acceleration) / DT
        assert (jerk <= most.jerk * 1.001).all()
        # What is commanded is one smooth curve: position and velocity tell the same story.
        middle = (trajectory.velocity + velocity) / 2 * DT
        assert (
            np.abs(trajectory.position - position - middle) <= most.acceleration * DT**2 / 2 + 1e-9
        ).all()

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / DT)):
            self.step()

    def finish(self, within: float = 12.0) -> float:
        """Step until the action has ended; s that it took."""
        for count in range(round(within / DT)):
            if not self.motion.busy:
                return count * DT
            self.step()
        raise AssertionError("did not come to rest")

    def do(self, action: Action, seconds: float) -> None:
        self.motion.begin(action)
        self.run(seconds)
        self.motion.release()
        self.finish()
