"""One PyBullet world without a window, and what stands in it.

The only module that starts PyBullet; :mod:`app.robot.sim.arm` (physics) and
:mod:`app.robot.sim.renderer` (pictures) each have a world of their own, in processes of their own.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import pybullet

from app.errors import CannotStart
from app.link.messages import ObjectState
from app.robot.models import ObjectModel

STEPS_PER_SECOND = 240
"""Bullet's contact parameters are tuned for this step; the control loop runs at the same rate."""


def connect() -> int:
    """A new world; returns its client id.

    Raises:
        CannotStart: this PyBullet was built without numpy, and would give pictures and Jacobians as
            tuples, hundreds of times slower.
    """
    if not pybullet.isNumpyEnabled():
        raise CannotStart(
            "PyBullet was built without numpy; install the wheel of pybullet 3.2.7 for "
            "CPython 3.11, or install numpy first and then build pybullet anew",
            package="pybullet",
        )
    client = int(pybullet.connect(pybullet.DIRECT))
    if client < 0:
        raise CannotStart("PyBullet has no free physics client left in this process")
    return client


def load_robot(
    client: int, urdf: Path, *, fixed: bool = True
) -> tuple[int, dict[str, int], dict[str, int]]:
    """Load a robot, fixed to the world unless told otherwise.

    Returns:
        Its body id, the joints by name, and the links by name (the base is -1).

    Raises:
        CannotStart: Bullet cannot load the file.
    """
    # Inertias of the file, not of the collision shapes.
    flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_MATERIAL_COLORS_FROM_MTL
    if not fixed:  # wheels are round: as a hull of flat faces they would rumble
        flags |= pybullet.URDF_USE_IMPLICIT_CYLINDER
    try:
        body = pybullet.loadURDF(
            str(urdf),
            useFixedBase=fixed,
            flags=flags,
            physicsClientId=client,
        )
    except pybullet.error as error:
        raise CannotStart(f"PyBullet cannot load {urdf}: {error}", file=str(urdf)) from error
    joints: dict[str, int] = {}
    base = pybullet.getBodyInfo(body, physicsClientId=client)[0].decode()
    links = {base: -1}
    for index in range(pybullet.getNumJoints(body, physicsClientId=client)):
        info = pybullet.getJointInfo(body, index, physicsClientId=client)
        joints[info[1].decode()] = index
        links[info[12].decode()] = index
    return int(body), joints, links


def add_floor(client: int) -> int:
    """An endless floor at z = 0, for things that fall off the table."""
    plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
    return int(pybullet.createMultiBody(0, plane, physicsClientId=client))


def add_object(client: int, thing: ObjectModel) -> int:
    """Put one thing into a world for physics; returns its body id."""
    if thing.shape == "box":
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_BOX,
            halfExtents=[edge / 2 for edge in thing.size],
            physicsClientId=client,
        )
    else:
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_CYLINDER,
            radius=thing.size[0] / 2,
            height=thing.size[2],
            physicsClientId=client,
        )
    body = pybullet.createMultiBody(
        thing.mass,
        shape,
        basePosition=thing.position,
        baseOrientation=upright(thing.turn),
        physicsClientId=client,
    )
    pybullet.changeDynamics(
        body,
        -1,
        lateralFriction=thing.friction,
        spinningFriction=0.002,
        rollingFriction=0.0002,
        physicsClientId=client,
    )
    return int(body)


def object_state(client: int, name: str, body: int) -> ObjectState:
    """Where a thing is."""
    position, (x, y, z, w) = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
    # Values from Bullet need no checking; this runs 240 times a second.
    return ObjectState.model_construct(name=name, position=position, orientation=(w, x, y, z))


def upright(turn: float) -> tuple[float, float, float, float]:
    """A turn about Z as Bullet's quaternion x, y, z, w."""
    return 0.0, 0.0, math.sin(turn / 2), math.cos(turn / 2)


def reset_objects(client: int, things: Sequence[ObjectModel], bodies: dict[str, int]) -> None:
    """Put the things of ``bodies`` (name to body id) back where the model has them, at rest."""
    for thing in things:
        if (body := bodies.get(thing.name)) is not None:
            pybullet.resetBasePositionAndOrientation(
                body, thing.position, upright(thing.turn), physicsClientId=client
            )
            nothing = (0.0, 0.0, 0.0)
            pybullet.resetBaseVelocity(body, nothing, nothing, physicsClientId=client)
