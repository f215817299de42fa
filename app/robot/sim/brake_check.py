"""Whether an arm's brakes are strong enough: they have to hold it, and what it carries, anywhere.

The torque that gravity asks of a joint is that of the arm's own links (recursive Newton-Euler, as
Bullet does it: Featherstone, "Rigid Body Dynamics Algorithms", 2008, chapter 5) and of the load,
``J_z m g``, with the tool's Jacobian ``J``. Its maximum over the joints' ranges is looked for at
poses drawn evenly from them.
"""

from typing import NamedTuple

import numpy as np
import pybullet

from app.robot.arm import Vector
from app.robot.models import Model
from app.robot.sim.kinematics import SerialKinematics

GRAVITY = 9.81
"""m/s^2"""
MARGIN = 1.25
"""How many times the largest torque of gravity a brake has to hold: one that only just holds slips
at the next touch, and the poses that are tried miss the worst one by some percent."""
_POSES = 1000


class TooWeak(NamedTuple):
    """A brake that does not hold."""

    joint: int
    """Counted from 0"""
    needed: float
    """Nm (N where the joint slides), without the margin"""
    load: float
    """kg in the gripper, counted in"""


def heaviest_load(model: Model) -> float:
    """The mass (kg) of the heaviest thing that the arm can pick up; 0 without a gripper."""
    if model.gripper is None:
        return 0.0
    return max((thing.mass for thing in model.objects), default=0.0)


def weakest_brake(
    client: int, body: int, joints: list[int], model: Model, kinematics: SerialKinematics
) -> TooWeak | None:
    """The brake that is the farthest from holding the arm, or None when all hold it.

    Args:
        client: Number of a Bullet world with gravity.
        body: Number of the arm in it.
        joints: Numbers of the joints of ``model``, in its order.
        model: Of the arm.
        kinematics: Of the same arm.
    """
    load = heaviest_load(model)
    needed = np.zeros(len(joints))
    moving = _moving_joints(client, body)
    still = [0.0] * len(moving)
    places = [moving.index(joint) for joint in joints]
    for pose in _poses(model):
        at = dict(zip(joints, pose.tolist(), strict=True))
        torques = pybullet.calculateInverseDynamics(
            body, [at.get(joint, 0.0) for joint in moving], still, still, physicsClientId=client
        )
        own = np.array(torques)[places]
        carried = kinematics.jacobian(pose)[2] * load * GRAVITY
        needed = np.maximum(needed, np.maximum(np.abs(own), np.abs(own + carried)))
    brakes = np.array([joint.brake for joint in model.joints])
    worst = int((needed / brakes).argmax())
    if needed[worst] * MARGIN <= brakes[worst]:
        return None
    return TooWeak(worst, float(needed[worst]), load)


def _moving_joints(client: int, body: int) -> list[int]:
    """The joints that are not fixed, fingers included, in Bullet's order."""
    infos = (
        pybullet.getJointInfo(body, joint, physicsClientId=client)
        for joint in range(pybullet.getNumJoints(body, physicsClientId=client))
    )
    return [info[0] for info in infos if info[2] != pybullet.JOINT_FIXED]


def _poses(model: Model) -> list[Vector]:
    lower = np.array([joint.lower for joint in model.joints])
    upper = np.array([joint.upper for joint in model.joints])
    drawn = np.random.default_rng(0).uniform(lower, upper, (_POSES, len(lower)))
    return [*drawn, *(np.array(pose) for pose in model.poses.values())]
