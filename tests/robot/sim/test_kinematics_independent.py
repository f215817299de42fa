"""Forward kinematics, Jacobian and inverse kinematics against Pinocchio's."""

import numpy as np
import pinocchio
import pytest

from app.robot.arm import ToolPose
from app.robot.models import model_assets
from app.robot.sim.kinematics import SerialKinematics, quaternion, rotation

ASSETS = model_assets("puma560")
OURS = SerialKinematics(ASSETS.urdf_path, ASSETS.model.base_link, ASSETS.model.tool_link)
THEIRS = pinocchio.buildModelFromUrdf(str(ASSETS.urdf_path))
DATA = THEIRS.createData()
TOOL = THEIRS.getFrameId(ASSETS.model.tool_link)
COLUMNS = [THEIRS.joints[THEIRS.getJointId(joint.name)].idx_v for joint in ASSETS.model.joints]
SOME = np.random.default_rng(9).uniform(OURS.lower, OURS.upper, (200, len(OURS.lower)))


def whole(joints: np.ndarray) -> np.ndarray:
    """Pinocchio's vector: the fingers are joints, too."""
    q = pinocchio.neutral(THEIRS)
    q[COLUMNS] = joints
    return q


@pytest.mark.parametrize("joints", SOME)
def test_forward_and_jacobian_are_the_same(joints: np.ndarray) -> None:
    q = whole(joints)
    pinocchio.framesForwardKinematics(THEIRS, DATA, q)
    place = DATA.oMf[TOOL]
    tool = OURS.forward(joints)
    assert tool.position == pytest.approx(place.translation, abs=1e-9)
    assert rotation(tool.orientation) == pytest.approx(place.rotation, abs=1e-9)
    aligned = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
    jacobian = pinocchio.computeFrameJacobian(THEIRS, DATA, q, TOOL, aligned)
    assert OURS.jacobian(joints) == pytest.approx(jacobian[:, COLUMNS], abs=1e-9)


def test_inverse_finds_joints_that_pinocchio_puts_at_the_pose() -> None:
    """Poses that Pinocchio says are within reach, from a start 0.3 rad away in every joint."""
    rng = np.random.default_rng(4)
    found = 0
    for joints in SOME:
        pinocchio.framesForwardKinematics(THEIRS, DATA, whole(joints))
        place = DATA.oMf[TOOL].copy()
        pose = ToolPose(place.translation, quaternion(place.rotation))
        start = np.clip(joints + rng.uniform(-0.3, 0.3, len(joints)), OURS.lower, OURS.upper)
        solution = OURS.inverse(pose, start)
        if not solution.converged:
            continue
        found += 1
        pinocchio.framesForwardKinematics(THEIRS, DATA, whole(solution.joints))
        away = pinocchio.log6(place.actInv(DATA.oMf[TOOL])).vector
        assert np.abs(away).max() < 1e-4
        assert (solution.joints >= OURS.lower).all()
        assert (solution.joints <= OURS.upper).all()
    assert found >= 0.95 * len(SOME)
