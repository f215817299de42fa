"""Forward kinematics, Jacobian and inverse kinematics of a serial chain, in numpy alone.

Each joint i turns (or slides) by ``q_i`` about its axis ``a_i``, after a fixed transform ``O_i``::

    revolute   T_i(q) = O_i R(a_i, q) = A_i + sin(q) B_i + (1 - cos(q)) C_i
               with A_i = O_i, B_i = O_i K_i, C_i = O_i K_i^2, K_i the cross-product matrix of a_i
               (Rodrigues' formula, as 4x4 matrices)
    prismatic  T_i(q) = A_i + q B_i, with B_i = O_i D_i, D_i holding a_i as its translation

so that all joints' transforms come from one vectorised expression, and only the chain's products
are left. The geometric Jacobian is that of Siciliano et al., "Robotics: Modelling, Planning and
Control", eq. 3.30.
"""

import math
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from app.errors import CannotStart
from app.robot.arm import ToolPose, Vector

Matrix = NDArray[np.float64]


class Solution(NamedTuple):
    """What an inverse kinematics search found."""

    joints: Vector
    """rad, shape (n,)"""
    converged: bool
    """Both errors are within the tolerances."""
    position_error: float
    """m"""
    orientation_error: float
    """rad"""


class SerialKinematics:
    """The kinematics of the moving joints between two links of a URDF.

    Args:
        urdf: The file.
        base: Name of the link whose frame everything is given in.
        tool: Name of the link whose origin is the tool centre point.

    Raises:
        CannotStart: the file has no chain from ``base`` to ``tool``.
    """

    def __init__(self, urdf: Path, base: str, tool: str) -> None:
        chain = _chain(urdf, base, tool)
        fixed = np.eye(4)
        first, second, third, axes, revolute, limits = [], [], [], [], [], []
        self.names: list[str] = []
        for joint in chain:
            fixed = fixed @ origin_of(joint)
            kind = joint.get("type")
            if kind == "fixed":
                continue
            axis = _numbers(joint.find("axis"), "xyz", (1.0, 0.0, 0.0))
            axis /= np.linalg.norm(axis)
            turns = kind != "prismatic"
            move = np.zeros((4, 4))
            if turns:
                move[:3, :3] = _cross_matrix(axis)
            else:
                move[:3, 3] = axis
            first.append(fixed)
            second.append(fixed @ move)
            third.append(fixed @ move @ move if turns else np.zeros((4, 4)))
            axes.append(axis)
            revolute.append(turns)
            limits.append(_limits(joint))
            self.names.append(joint.get("name", ""))
            fixed = np.eye(4)
        self._first, self._second, self._third = map(np.array, (first, second, third))
        self._axes = np.array(axes)
        self._revolute = np.array(revolute)
        self._all_revolute = bool(self._revolute.all())
        self._last = fixed
        self.lower, self.upper = np.array(limits).T.copy()

    def forward(self, joints: Vector) -> ToolPose:
        """Where the tool is with the joints at ``joints`` (rad, shape (n,))."""
        pose = self._frames(joints)[-1] @ self._last
        return ToolPose(pose[:3, 3].copy(), quaternion(pose))

    def jacobian(self, joints: Vector) -> Matrix:
        """Geometric Jacobian of the tool in the base frame, shape (6, n).

        Rows 0 to 2: m/s per rad/s; rows 3 to 5: rad/s per rad/s.
        """
        frames = self._frames(joints)
        return self._jacobian(frames, (frames[-1] @ self._last)[:3, 3])

    def inverse(
        self,
        pose: ToolPose,
        seed: Vector,
        *,
        steps: int = 200,
        tolerance: float = 1e-5,
        damping: float = 0.02,
    ) -> Solution:
        """Joint angles that bring the tool to ``pose``, near ``seed``, inside the joint limits.

        Damped least squares, dq = J^T (J J^T + damping^2 I)^-1 e (Nakamura and Hanafusa 1986), the
        damping shrinking with the error. Finds the solution in the seed's own configuration
        (elbow up stays elbow up), or none.
        """
        joints = np.clip(np.asarray(seed, dtype=float), self.lower, self.upper)
        target = rotation(pose.orientation)
        position_error = orientation_error = math.inf
        for _ in range(steps):
            frames = self._frames(joints)
            now = frames[-1] @ self._last
            away = np.concatenate(
                (pose.position - now[:3, 3], rotation_vector(target @ now[:3, :3].T))
            )
            position_error = float(np.linalg.norm(away[:3]))
            orientation_error = float(np.linalg.norm(away[3:]))
            if position_error < tolerance and orientation_error < tolerance:
                return Solution(joints, True, position_error, orientation_error)
            size = float(np.linalg.norm(away))
            if size > 0.5:  # a step over which the Jacobian still holds
                away *= 0.5 / size
            jacobian = self._jacobian(frames, now[:3, 3])
            damp = (damping * min(1.0, size)) ** 2 + 1e-10
            joints = joints + jacobian.T @ np.linalg.solve(
                jacobian @ jacobian.T + damp * np.eye(6), away
            )
            joints = np.clip(joints, self.lower, self.upper)
        return Solution(joints, False, position_error, orientation_error)

    def manipulability(self, joints: Vector) -> float:
        """Yoshikawa's measure sqrt(det(J J^T)); zero at a singular position."""
        jacobian = self.jacobian(joints)
        return math.sqrt(max(0.0, float(np.linalg.det(jacobian @ jacobian.T))))

    def _frames(self, joints: Vector) -> list[Matrix]:
        """The frame of each joint, after its motion, in the base frame: n matrices 4x4."""
        q = np.asarray(joints, dtype=float).reshape(-1, 1, 1)
        if self._all_revolute:
            along, across = np.sin(q), 1.0 - np.cos(q)
        else:
            turns = self._revolute[:, None, None]
            along, across = np.where(turns, np.sin(q), q), 1.0 - np.cos(q)
        single = self._first + along * self._second + across * self._third
        frames = [single[0]]
        for matrix in single[1:]:
            frames.append(frames[-1] @ matrix)
        return frames

    def _jacobian(self, frames: list[Matrix], tool: Vector) -> Matrix:
        stack = np.array(frames)
        axes = np.einsum("nij,nj->ni", stack[:, :3, :3], self._axes)
        arm = tool - stack[:, :3, 3]
        result = np.empty((6, len(frames)))
        result[0] = axes[:, 1] * arm[:, 2] - axes[:, 2] * arm[:, 1]
        result[1] = axes[:, 2] * arm[:, 0] - axes[:, 0] * arm[:, 2]
        result[2] = axes[:, 0] * arm[:, 1] - axes[:, 1] * arm[:, 0]
        result[3:] = axes.T
        if not self._all_revolute:
            slides = ~self._revolute
            result[:3, slides] = axes[slides].T
            result[3:, slides] = 0.0
        return result


def fixed_pose(urdf: Path, base: str, tool: str) -> ToolPose:
    """Where ``tool`` is in the frame of ``base``, with every joint between them at zero.

    Raises:
        CannotStart: the file has no chain from ``base`` to ``tool``.
    """
    pose = np.eye(4)
    for joint in _chain(urdf, base, tool):
        pose = pose @ origin_of(joint)
    return ToolPose(pose[:3, 3].copy(), quaternion(pose))


def quaternion(matrix: Matrix) -> Vector:
    """The unit quaternion (w, x, y, z; w >= 0) of a rotation matrix, 3x3 or larger.

    Shepperd's method (1978): the largest of the four components first.
    """
    (a, b, c), (d, e, f), (g, h, i) = matrix[:3, :3].tolist()
    trace = a + e + i
    if trace > 0:
        s = 2.0 * math.sqrt(trace + 1.0)
        q = (0.25 * s, (h - f) / s, (c - g) / s, (d - b) / s)
    elif a >= e and a >= i:
        s = 2.0 * math.sqrt(1.0 + a - e - i)
        q = ((h - f) / s, 0.25 * s, (b + d) / s, (c + g) / s)
    elif e >= i:
        s = 2.0 * math.sqrt(1.0 + e - a - i)
        q = ((c - g) / s, (b + d) / s, 0.25 * s, (f + h) / s)
    else:
        s = 2.0 * math.sqrt(1.0 + i - a - e)
        q = ((d - b) / s, (c + g) / s, (f + h) / s, 0.25 * s)
    sign = -1.0 if q[0] < 0 else 1.0
    return np.array(q) * (sign / math.hypot(*q))


def rotation(quaternion: Vector) -> Matrix:
    """The 3x3 rotation matrix of a unit quaternion w, x, y, z."""
    w, x, y, z = (float(v) for v in quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotation_vector(matrix: Matrix) -> Vector:
    """Axis times angle (rad, shape (3,)) of a 3x3 rotation matrix."""
    q = quaternion(matrix)
    sine = float(np.linalg.norm(q[1:]))
    if sine < 1e-12:
        return 2.0 * q[1:]
    return q[1:] * (2.0 * math.atan2(sine, q[0]) / sine)


def _chain(urdf: Path, base: str, tool: str) -> list[ElementTree.Element]:
    """The URDF's joints from ``base`` to ``tool``, in this order."""
    parents = {}
    for joint in ElementTree.parse(urdf).getroot().findall("joint"):
        child = joint.find("child")
        if child is not None:
            parents[child.get("link")] = joint
    chain: list[ElementTree.Element] = []
    link: str | None = tool
    while link != base:
        if link not in parents or len(chain) > len(parents):
            raise CannotStart(f"{urdf} has no joints from the link {base} to the link {tool}")
        chain.append(parents[link])
        parent = parents[link].find("parent")
        link = parent.get("link") if parent is not None else None
    return chain[::-1]


def _numbers(
    element: ElementTree.Element | None, name: str, default: tuple[float, ...]
) -> NDArray[np.float64]:
    text = element.get(name) if element is not None else None
    return np.array([float(word) for word in text.split()] if text else default)


def _limits(joint: ElementTree.Element) -> tuple[float, float]:
    limit = joint.find("limit")
    if limit is None or joint.get("type") == "continuous":
        return -math.inf, math.inf
    return float(limit.get("lower", 0)), float(limit.get("upper", 0))


def origin_of(element: ElementTree.Element) -> Matrix:
    """The 4x4 transform of an element's ``<origin>``: turned about fixed X, Y, Z, then moved."""
    origin = element.find("origin")
    roll, pitch, yaw = _numbers(origin, "rpy", (0.0, 0.0, 0.0))
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    result = np.eye(4)
    result[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    result[:3, 3] = _numbers(origin, "xyz", (0.0, 0.0, 0.0))
    return result


def _cross_matrix(axis: Vector) -> Matrix:
    x, y, z = axis
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
