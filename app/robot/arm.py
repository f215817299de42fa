"""What the control loop needs of an arm, simulated or real."""

from typing import Literal, NamedTuple, Protocol

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


class Contact(NamedTuple):
    """A link of the arm presses on a thing."""

    link: str
    """Name in the URDF"""
    thing: str
    force: float
    """N, the sum of the normal forces"""
    grasp: bool
    """A finger on something that can be grasped"""


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
    contacts: tuple[Contact, ...] = ()
    """What the arm touches, itself not counted; none where an arm does not feel"""
    held: str | None = None
    """Name of the thing that both fingers hold"""
    base: tuple[float, float, float] | None = None
    """Of a base that drives: m, m, rad about Z, in the room"""


class Met(NamedTuple):
    """A robot that drives is where a thing is."""

    thing: str
    """Its name"""
    fixed: bool
    """It cannot be pushed aside"""


NearKind = Literal["scene", "hand", "held", "itself"]
"""``scene``: a link of the arm and a thing. ``hand``: a finger, or what carries the fingers, and a
thing that does not move. ``held``: what is held and another thing. ``itself``: the arm and its own
links, or what it holds and its own links."""
Point = tuple[float, float, float]


class Near(NamedTuple):
    """Two that are near one another."""

    kind: NearKind
    link: str
    """Of the arm, or the name of what it holds"""
    thing: str
    """Name of the thing, or the arm's other link"""
    distance: float
    """m; negative when they overlap"""
    points: tuple[Point, Point]
    """m, base frame: the nearest points, on the link and on the thing"""
    joints: tuple[int, int]
    """From which joint on, counted from 0, up to which, not included: no other joint changes the
    distance"""


class Proximity(Protocol):
    """What is near an arm, wherever its joints were."""

    def follow(self, reading: Reading, *, standing: bool) -> bool:
        """Take over where fingers and things are, and what is held.

        Args:
            reading: As measured.
            standing: The arm stands: where a held thing lies in the hand is measured anew.

        Returns:
            Whether anything has changed, so that distances asked for before hold no more.
        """
        ...

    def near(self, joints: Vector, within: float) -> list[Near]:
        """What is nearer than ``within`` (m) with the joints at ``joints`` (rad, shape (n,))."""
        ...

    def plain(self, name: str) -> str:
        """A link or thing in plain words."""
        ...


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

    @property
    def proximity(self) -> Proximity | None:
        """What is near it; None where that cannot be known."""
        ...

    def read(self) -> Reading:
        """Measure."""
        ...

    def move(self, joints: Vector, velocities: Vector) -> None:
        """Set where the joints should be (rad) and how fast they should pass there (rad/s)."""
        ...

    def grip(self, width: float, force: float | None = None) -> None:
        """Open or close the fingers towards ``width`` (m) at the gripper's own speed.

        They press with ``force`` (N, each finger), the gripper's own unless given, and at most
        that.
        """
        ...

    def brake(self, engaged: bool) -> None:
        """Engaged: motors off and brakes on, nothing drops. Released: the motors hold."""
        ...

    def reset_scene(self) -> None:
        """Put every thing that can move back where it was at first. Only while the arm stands."""
        ...

    def step(self) -> None:
        """Let 1/240 s pass, where time is simulated."""
        ...

    def close(self) -> None:
        """Let go of everything held."""
        ...
