"""What the control loop needs of an arm, simulated or real."""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from app.link.messages import Description, ObjectState

Vector = NDArray[np.float64]


class ToolPose(NamedTuple):
    """Where the tool centre point (between the finger tips) is, in the base frame."""

    position: Vector
    """m, shape (3,)"""
    orientation: Vector
    """Unit quaternion w, x, y, z, shape (4,)"""


class Reading(NamedTuple):
    """What an arm measures, all of one moment."""

    joints: Vector
    """rad, shape (n,)"""
    velocities: Vector
    """rad/s, shape (n,)"""
    gripper: float
    """m between the fingers"""
    tool: ToolPose
    objects: tuple[ObjectState, ...]
    base: tuple[float, float, float] | None = None
    """Of a base that drives: m, m, rad about Z, in the room"""


class Kinematics(Protocol):
    """Geometry of an arm, without any state of its own."""

    def forward(self, joints: Vector) -> ToolPose:
        """Where the tool is with the joints at ``joints`` (rad, shape (n,))."""
        ...

    def jacobian(self, joints: Vector) -> NDArray[np.float64]:
        """Geometric Jacobian of the tool in the base frame, shape (6, n).

        Rows 0 to 2: m/s per rad/s; rows 3 to 5: rad/s per rad/s.
        """
        ...


class Arm(Protocol):
    """One arm with a gripper. Not thread-safe: the control loop is its only user."""

    @property
    def description(self) -> Description:
        """What the robot is."""
        ...

    @property
    def home(self) -> Vector:
        """The joints (rad, shape (n,)) of the action ``home``, inside the limits."""
        ...

    @property
    def kinematics(self) -> Kinematics:
        """Its geometry."""
        ...

    def read(self) -> Reading:
        """Measure."""
        ...

    def move(self, joints: Vector, velocities: Vector) -> None:
        """Set where the joints should be (rad) and how fast they should pass there (rad/s)."""
        ...

    def grip(self, width: float) -> None:
        """Open or close the fingers towards ``width`` (m) at the gripper's own speed and force."""
        ...

    def brake(self, engaged: bool) -> None:
        """Engaged: motors off and brakes on, nothing drops. Released: the motors hold."""
        ...

    def step(self) -> None:
        """Let 1/240 s pass, where time is simulated."""
        ...

    def close(self) -> None:
        """Let go of everything held."""
        ...
