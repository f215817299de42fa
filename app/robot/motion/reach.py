"""How far a point of an arm can travel when a joint turns."""

import math

import numpy as np

from app.robot.arm import Kinematics, Vector

_BESIDE = 0.15
"""m; what sticks out beside and before the tool: a hand's breadth, or a held thing."""


def reach_of(kinematics: Kinematics, count: int) -> Vector:
    """How far any point of the arm can be from each joint's axis (m, shape (n,)).

    The tool's distance from an axis is the length of its column of the Jacobian; its largest at
    many poses, and a hand's breadth. For a joint that slides it is more than 1, which is safe.
    """
    rng = np.random.default_rng(1)
    lengths = [
        np.linalg.norm(kinematics.jacobian(joints)[:3], axis=0)
        for joints in rng.uniform(-math.pi, math.pi, (300, count))
    ]
    return np.asarray(np.max(lengths, axis=0) + _BESIDE)
