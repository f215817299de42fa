"""How fast the joints may move: in ordinary motion, and to stop."""

from dataclasses import dataclass

import numpy as np

from app.config import ArmMotionSettings
from app.errors import CannotStart
from app.link.messages import JointDescription
from app.robot.arm import Vector


@dataclass(frozen=True)
class Pace:
    """Bounds of one kind of motion, shape (n,) each."""

    velocity: Vector
    """rad/s"""
    acceleration: Vector
    """rad/s^2"""
    jerk: Vector
    """rad/s^3"""


@dataclass(frozen=True)
class Limits:
    """Where the joints may be, and the two paces at which they may move.

    ``ordinary`` is a part of the arm's own limits (``ArmMotionSettings``); ``stop`` is all of them.
    The difference is what a stop needs: a joint that is still speeding up when the stop comes must
    first lose that acceleration, and yet stand within 200 ms. With ``t = a0/j + v/a + a/j`` the
    slowest joint of the PUMA 560 takes 0.19 s from the worst ordinary state.
    """

    lower: Vector
    """rad, shape (n,)"""
    upper: Vector
    """rad, shape (n,)"""
    ordinary: Pace
    stop: Pace

    @classmethod
    def of(cls, joints: tuple[JointDescription, ...], settings: ArmMotionSettings) -> "Limits":
        """The limits of an arm.

        Raises:
            CannotStart: a limit is not a positive, finite number, or a range is empty.
        """
        table = np.array(
            [[j.lower, j.upper, j.velocity, j.acceleration, j.jerk] for j in joints], dtype=float
        ).reshape(-1, 5)
        lower, upper, velocity, acceleration, jerk = table.T
        fine = np.isfinite(table).all() and (table[:, 2:] > 0).all() and (lower < upper).all()
        if not fine:
            raise CannotStart(
                "every joint needs finite limits: lower below upper, and velocity, acceleration "
                "and jerk above 0"
            )
        return cls(
            lower=lower,
            upper=upper,
            ordinary=Pace(
                velocity * settings.speed,
                acceleration * settings.acceleration,
                jerk * settings.jerk,
            ),
            stop=Pace(velocity, acceleration, jerk),
        )
