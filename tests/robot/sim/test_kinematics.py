import math
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pybullet
import pytest

from app.errors import CannotStart
from app.robot.arm import ToolPose
from app.robot.models import model_assets
from app.robot.sim.kinematics import (
    SerialKinematics,
    quaternion,
    rotation,
    rotation_vector,
)

URDF = model_assets("puma560").urdf_path

# Corke and Armstrong-Helouvry 1994, standard DH: d, a, alpha.
DH = [
    (0.672, 0.0, math.pi / 2),
    (0.0, 0.4318, 0.0),
    (0.15005, 0.0203, -math.pi / 2),
    (0.4318, 0.0, math.pi / 2),
    (0.0, 0.0, -math.pi / 2),
    (0.0, 0.0, 0.0),
]
TOOL = 0.05625 + 0.124
"""m from the wrist's centre to the tool centre point."""


def dh_pose(joints: np.ndarray) -> np.ndarray:
    pose = np.eye(4)
    for q, (d, a, alpha) in zip(joints, DH, strict=True):
        c, s, ca, sa = math.cos(q), math.sin(q), math.cos(alpha), math.sin(alpha)
        pose = pose @ np.array(
            [
                [c, -s * ca, s * sa, a * c],
                [s, c * ca, -c * sa, a * s],
                [0, sa, ca, d],
                [0, 0, 0, 1],
            ]
        )
    pose[:3, 3] += TOOL * pose[:3, 2]
    return pose


@pytest.fixture(scope="module")
def chain() -> SerialKinematics:
    return SerialKinematics(URDF, "link0", "tool")


@pytest.fixture(scope="module")
def bullet() -> Iterator[tuple[int, int]]:
    client = pybullet.connect(pybullet.DIRECT)
    yield client, pybullet.loadURDF(str(URDF), useFixedBase=True, physicsClientId=client)
    pybullet.disconnect(client)


def random_joints(chain: SerialKinematics, count: int) -> np.ndarray:
    return np.random.default_rng(3).uniform(chain.lower, chain.upper, (count, 6))


def test_the_chain_is_the_six_joints_with_their_limits(chain: SerialKinematics) -> None:
    assert chain.names == [f"joint{number}" for number in range(1, 7)]
    model = model_assets("puma560").model
    assert chain.lower == pytest.approx([joint.lower for joint in model.joints])
    assert chain.upper == pytest.approx([joint.upper for joint in model.joints])


def test_forward_agrees_with_the_published_parameters(chain: SerialKinematics) -> None:
    for joints in random_joints(chain, 50):
        tool, expected = chain.forward(joints), dh_pose(joints)
        assert tool.position == pytest.approx(expected[:3, 3], abs=1e-9)
        assert rotation(tool.orientation) == pytest.approx(expected[:3, :3], abs=1e-9)


def test_forward_and_jacobian_agree_with_bullet(
    chain: SerialKinematics, bullet: tuple[int, int]
) -> None:
    client, body = bullet
    names = [
        pybullet.getJointInfo(body, j, physicsClientId=client)[12].decode()
        for j in range(pybullet.getNumJoints(body, physicsClientId=client))
    ]
    tool = names.index("tool")
    for joints in random_joints(chain, 25):
        for index, angle in enumerate(joints):
            pybullet.resetJointState(body, index, angle, physicsClientId=client)
        state = pybullet.getLinkState(
            body, tool, computeForwardKinematics=True, physicsClientId=client
        )
        ours = chain.forward(joints)
        assert ours.position == pytest.approx(np.array(state[4]), abs=1e-6)
        x, y, z, w = state[5]
        assert abs(np.dot(ours.orientation, [w, x, y, z])) == pytest.approx(1.0, abs=1e-6)
        linear, angular = pybullet.calculateJacobian(
            body,
            tool,
            [0.0, 0.0, 0.0],
            [*joints, 0.0, 0.0],
            [0.0] * 8,
            [0.0] * 8,
            physicsClientId=client,
        )
        expected = np.vstack([np.array(linear)[:, :6], np.array(angular)[:, :6]])
        assert chain.jacobian(joints) == pytest.approx(expected, abs=1e-6)


def test_the_jacobian_is_the_derivative(chain: SerialKinematics) -> None:
    step = 1e-6
    for joints in random_joints(chain, 10):
        jacobian, here = chain.jacobian(joints), chain.forward(joints)
        for index in range(6):
            moved = joints.copy()
            moved[index] += step
            there = chain.forward(moved)
            assert (there.position - here.position) / step == pytest.approx(
                jacobian[:3, index], abs=1e-5
            )
            turn = rotation_vector(rotation(there.orientation) @ rotation(here.orientation).T)
            assert turn / step == pytest.approx(jacobian[3:, index], abs=1e-5)


@pytest.mark.parametrize("pose", sorted(model_assets("puma560").model.poses))
def test_poses_point_down_and_are_far_from_singular(chain: SerialKinematics, pose: str) -> None:
    joints = model_assets("puma560").model.pose(pose)
    down = rotation(chain.forward(joints).orientation)
    assert down[:, 2] == pytest.approx([0, 0, -1], abs=1e-3)
    assert abs(down[1, 1]) == pytest.approx(1, abs=1e-3)  # fingers along Y of the base
    assert np.linalg.svd(chain.jacobian(joints), compute_uv=False)[-1] > 0.15
    assert chain.manipulability(joints) > 0.05


def test_manipulability_vanishes_with_the_arm_stretched_out(chain: SerialKinematics) -> None:
    elbow = -math.pi / 2 + math.atan2(0.0203, 0.4318)
    out = np.array([0.0, 0.4, elbow, 0.3, 0.5, 0.0])
    assert chain.manipulability(out) < 1e-3


def test_inverse_finds_back(chain: SerialKinematics) -> None:
    model = model_assets("puma560").model
    change = np.random.default_rng(4)
    for name in model.poses:
        joints = model.pose(name) + change.uniform(-0.2, 0.2, 6)
        solution = chain.inverse(chain.forward(joints), model.pose(name))
        assert solution.converged
        assert solution.joints == pytest.approx(joints, abs=1e-3)


def test_inverse_says_when_a_pose_is_out_of_reach(chain: SerialKinematics) -> None:
    home = model_assets("puma560").model.pose("home")
    far = ToolPose(np.array([2.0, 0.0, 0.5]), np.array([0.0, 0.0, 1.0, 0.0]))
    solution = chain.inverse(far, home)
    assert not solution.converged
    assert solution.position_error > 0.5
    assert np.all(solution.joints >= chain.lower) and np.all(solution.joints <= chain.upper)


def test_a_sliding_joint_slides(tmp_path: Path) -> None:
    path = tmp_path / "slider.urdf"
    path.write_text(
        """<robot name="slider"><link name="a"/><link name="b"/><link name="c"/>
        <joint name="turn" type="continuous"><parent link="a"/><child link="b"/>
          <axis xyz="0 0 1"/></joint>
        <joint name="slide" type="prismatic"><parent link="b"/><child link="c"/>
          <origin xyz="0 0 1"/><axis xyz="2 0 0"/><limit lower="0" upper="1"/></joint></robot>"""
    )
    chain = SerialKinematics(path, "a", "c")
    joints = np.array([math.pi / 2, 0.5])
    assert chain.forward(joints).position == pytest.approx([0, 0.5, 1])
    assert chain.jacobian(joints) == pytest.approx(
        np.array([[-0.5, 0], [0, 1], [0, 0], [0, 0], [0, 0], [1, 0]])
    )
    assert chain.lower[0] == -math.inf


def test_a_missing_link_is_named() -> None:
    with pytest.raises(CannotStart, match="no joints from the link link0 to the link nose"):
        SerialKinematics(URDF, "link0", "nose")


@pytest.mark.parametrize("seed", range(5))
def test_quaternions_and_rotations_agree(seed: int) -> None:
    q = np.random.default_rng(seed).normal(size=4)
    q /= np.linalg.norm(q) * (1 if q[0] >= 0 else -1)
    assert quaternion(rotation(q)) == pytest.approx(q)


@pytest.mark.parametrize("axis", range(3))
def test_half_turns_are_found(axis: int) -> None:
    vector = np.zeros(3)
    vector[axis] = math.pi
    half = np.diag([1.0 if index == axis else -1.0 for index in range(3)])
    assert np.abs(rotation_vector(half)) == pytest.approx(vector)


def test_is_fast_enough_for_the_control_loop(chain: SerialKinematics) -> None:
    joints = model_assets("puma560").model.pose("ready")

    def best(function) -> float:
        times = []
        for _ in range(300):
            start = time.perf_counter()
            function(joints)
            times.append(time.perf_counter() - start)
        return min(times)

    assert best(chain.forward) < 100e-6
    assert best(chain.jacobian) < 100e-6
