"""Distances, checked against another library's (coal, the collision library of Pinocchio)."""

import itertools
from collections.abc import Iterator

import coal
import numpy as np
import pybullet
import pytest

from app.link.messages import ObjectState
from app.robot.arm import ToolPose
from app.robot.models import model_assets
from app.robot.sim.kinematics import rotation
from app.robot.sim.proximity import SimulatedProximity, always_near
from tests.robot.fakes import FakeArm

ASSETS = model_assets("puma560")
MODEL = ASSETS.model
LOW = np.array([joint.lower for joint in MODEL.joints])
HIGH = np.array([joint.upper for joint in MODEL.joints])
HULLS = {-1: (0.10, 0.52), 0: (0.078, 0.28), 5: (0.0254, 0.010)}
"""Radius and height of the URDF's cylinders, which Bullet takes for many-sided hulls."""
IDENTITY = (1.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def proximity() -> Iterator[SimulatedProximity]:
    proximity = SimulatedProximity(ASSETS)
    proximity.follow(FakeArm().read(), standing=True)
    yield proximity
    proximity.close()


def poses(count: int, seed: int = 5) -> np.ndarray:
    return np.random.default_rng(seed).uniform(LOW, HIGH, (count, len(LOW)))


def named(proximity: SimulatedProximity) -> dict[str, tuple[int, int]]:
    """Body and link of everything that has a name."""
    arm = {name: (proximity._body, index) for index, name in proximity._names.items()}
    return arm | {name: (body, -1) for body, name in proximity._things.items()}


def solids(proximity: SimulatedProximity, body: int, link: int) -> list[tuple[object, object]]:
    """The shapes of a link for coal, with their places in the world."""
    client = proximity.client
    if link < 0:
        frame = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
    else:
        frame = pybullet.getLinkState(
            body, link, computeForwardKinematics=True, physicsClientId=client
        )[:2]
    found = []
    for shape in pybullet.getCollisionShapeData(body, link, physicsClientId=client):
        kind, size, _, place, turn = shape[2:7]
        where, (x, y, z, w) = pybullet.multiplyTransforms(*frame, place, turn)
        solid = {
            pybullet.GEOM_BOX: lambda s: coal.Box(*s),
            pybullet.GEOM_SPHERE: lambda s: coal.Sphere(s[0]),
            pybullet.GEOM_CYLINDER: lambda s: coal.Cylinder(s[1], s[0]),
            pybullet.GEOM_MESH: lambda _: coal.Cylinder(*HULLS[link]),
        }[kind](size)
        at = coal.Transform3s(rotation(np.array([w, x, y, z])), np.array(where))
        found.append((solid, at))
    return found


def test_distances_agree_with_coal(proximity: SimulatedProximity) -> None:
    """Every pair within 100 mm at 150 poses; none is missed, none is invented."""
    within = 0.1
    names = named(proximity)
    seen = 0
    for joints in poses(150):
        ours = {(n.link, n.thing): n.distance for n in proximity.near(joints, within)}
        shapes = {
            name: solids(proximity, *where) for name, where in names.items() if name != "floor"
        }
        arm = list(proximity._names.values())
        things = [thing.name for thing in MODEL.objects]
        hand = {"gripper", "left_finger", "right_finger"}
        movable = {thing.name for thing in MODEL.objects if thing.mass > 0}
        pairs = [(b, a) for a, b in proximity.self_pairs] + [
            (link, thing)
            for link, thing in itertools.product(arm, things)
            if link != "link0" and not (link in hand and thing in movable)
        ]
        for pair in pairs:
            distance = np.inf
            for (first, at), (second, there) in itertools.product(shapes[pair[0]], shapes[pair[1]]):
                result = coal.DistanceResult()
                request = coal.DistanceRequest()
                distance = min(distance, coal.distance(first, at, second, there, request, result))
            if pair in ours and ours[pair] > 0:
                assert ours[pair] == pytest.approx(distance, abs=2e-3), pair
                seen += 1
            elif pair in ours:
                assert distance < 2e-3, pair
            else:
                assert distance > within - 2e-3, pair
    assert seen > 100


def test_what_can_move_is_an_obstacle_to_the_arm_but_not_to_the_hand(
    proximity: SimulatedProximity,
) -> None:
    arm = FakeArm(MODEL.pose("ready"))
    tool = arm.read().tool.position
    put(proximity, arm, "green_block", tool)
    near = proximity.near(arm.joints, 0.1)
    assert "green_block" not in {n.thing for n in near if n.link in ("gripper", "left_finger")}
    wrist = tool + np.array([0.0, 0.0, 0.2])
    put(proximity, arm, "green_block", wrist + np.array([0.0, 0.12, 0.0]))
    near = proximity.near(arm.joints, 0.1)
    assert any(n.thing == "green_block" and n.kind == "scene" for n in near)


def test_what_is_held_goes_with_the_hand_until_it_is_let_go(
    proximity: SimulatedProximity,
) -> None:
    arm = FakeArm(MODEL.pose("ready"))
    tool = arm.read().tool.position
    arm.held = "red_cube"
    put(proximity, arm, "red_cube", tool)
    there = MODEL.pose("tray")
    proximity.near(there, 0.1)
    position, _ = pybullet.getBasePositionAndOrientation(
        named(proximity)["red_cube"][0], physicsClientId=proximity.client
    )
    expected: ToolPose = arm.kinematics.forward(there)
    assert position == pytest.approx(expected.position, abs=1e-3)
    arm.held = None
    put(proximity, arm, "red_cube", tool)
    proximity.near(there, 0.1)
    position, _ = pybullet.getBasePositionAndOrientation(
        named(proximity)["red_cube"][0], physicsClientId=proximity.client
    )
    assert position == pytest.approx(tool, abs=1e-6)


def put(proximity: SimulatedProximity, arm: FakeArm, name: str, at: np.ndarray) -> None:
    arm.objects = (ObjectState(name=name, position=tuple(at), orientation=IDENTITY),)
    proximity.follow(arm.read(), standing=True)


def test_pairs_that_never_touch_do_not(proximity: SimulatedProximity) -> None:
    """What the profile leaves out cannot meet; what it leaves in is not always too near."""
    model = MODEL.model_copy(update={"never_touch": ()})
    every = SimulatedProximity(ASSETS._replace(model=model), objects=False)
    every.follow(FakeArm().read(), standing=True)
    spans = always_near(every, poses(1500), 0.2)
    every.close()
    never = {frozenset(pair) for pair in MODEL.never_touch}
    for pair, (least, largest) in spans.items():
        if frozenset(pair) in never:
            # The flange lies inside the wrist's box; both are one joint's bearing.
            assert least > 0.001 or set(pair) == {"link4", "link6"}, pair
        else:
            assert largest > 0.1, pair


def test_things_have_plain_names(proximity: SimulatedProximity) -> None:
    assert proximity.plain("link3") == "forearm"
    assert proximity.plain("red_cube") == "red cube"
