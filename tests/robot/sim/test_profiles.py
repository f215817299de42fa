"""The profiles that come with Farhand, and one of one's own, in physics and in pictures."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from app.link.actions import Gripper, JogCartesian, JogJoint, MoveLinear, Pose, TurnJoint
from app.link.messages import StopCategory
from app.robot.arm import ToolPose
from app.robot.models import model_assets, model_names
from app.robot.sim.arm import SimulatedArm
from app.robot.sim.kinematics import SerialKinematics
from app.robot.sim.renderer import Renderer
from tests.robot.models.profiles import TOML, write_profile
from tests.robot.sim.rig import STANDING, Rig, touching

ARMS = ["franka_panda", "kuka_iiwa", "puma560"]
DOWN = ("home", "ready", "inspect", "left", "right", "tray")


@pytest.fixture(params=ARMS)
def rig(request: pytest.FixtureRequest) -> Iterator[Rig]:
    rig = Rig(request.param)
    yield rig
    rig.arm.close()


def test_every_pose_is_reached_without_touching_anything(rig: Rig) -> None:
    hits: set[tuple[str, str]] = set()
    count = 0

    def look() -> None:
        nonlocal count
        count += 1
        if count % 24 == 0:
            hits.update(touching(rig.arm))

    for name, pose in rig.arm.description.poses.items():
        reading = rig.show(Pose(name=name), 15.0, look)
        assert reading.joints == pytest.approx(np.array(pose), abs=1e-3), name
        rig.wait(0.1)
    assert hits == set()
    assert rig.controller.fault is None


def test_a_touch_would_be_seen(rig: Rig) -> None:
    assert isinstance(rig.arm, SimulatedArm)
    table = rig.arm.objects["table"]
    import pybullet

    position = rig.controller.reading.tool.position
    pybullet.resetBasePositionAndOrientation(
        table, position, (0, 0, 0, 1), physicsClientId=rig.arm.client
    )
    assert touching(rig.arm)


@pytest.mark.parametrize("profile", ARMS)
def test_the_tool_points_down_in_every_pose(profile: str) -> None:
    assets = model_assets(profile)
    chain = SerialKinematics(assets.urdf_path, assets.model.base_link, assets.model.tool_link)
    assert chain.names == [joint.name for joint in assets.model.joints]
    for name in DOWN:
        w, x, y, z = chain.forward(assets.model.pose(name)).orientation
        assert 1 - 2 * (x * x + y * y) == pytest.approx(-1.0, abs=1e-3), (name, w, z)


@pytest.mark.parametrize("profile", ["puma560", "kuka_iiwa", "franka_panda"])
def test_poses_are_found_again_by_inverse_kinematics(profile: str) -> None:
    assets = model_assets(profile)
    chain = SerialKinematics(assets.urdf_path, assets.model.base_link, assets.model.tool_link)
    for name in DOWN:
        wanted = chain.forward(assets.model.pose(name))
        found = chain.inverse(ToolPose(*wanted), assets.model.pose("home"))
        assert found.converged, name


def test_every_joint_stands_within_200_ms_of_every_stop(rig: Rig) -> None:
    """As measured, from the full speed of ordinary motion."""
    rig.show(Pose(name="inspect"), 15.0)
    categories: tuple[StopCategory, ...] = ("S2", "S1", "S0")
    for number, joint in enumerate(rig.arm.description.joints, start=1):
        # To the side that has more room, long enough for the full speed.
        angle = rig.controller.reading.joints[number - 1]
        way = 1.0 if joint.upper - angle > angle - joint.lower else -1.0
        reading = rig.show(JogJoint(joint=number, velocity=4.3 * way), 0.35)
        # Near its own links a joint is slowed a little.
        assert abs(reading.velocities[number - 1]) > 0.4 * joint.velocity, joint.name
        category = categories[number % 3]
        assert rig.stop(category) <= 0.2, (joint.name, category)
        if category != "S2":
            rig.reset()
        rig.show(Pose(name="inspect"), 15.0)
        rig.wait(0.1)
    assert rig.controller.fault is None


def test_straight_jogs_are_straight(rig: Rig) -> None:
    for linear in ([0.1, 0, 0], [0, 0.1, 0], [0, 0, -0.1]):
        rig.show(Pose(name="home"), 15.0)
        rig.wait(0.1)
        start = rig.controller.reading.tool
        jog = JogCartesian(linear=tuple(linear))
        way = rig.show(jog, 1.3).tool.position - start.position
        along = np.array(linear) / 0.1
        assert way @ along > 0.05
        assert np.linalg.norm(way - (way @ along) * along) < 1e-3
        rig.wait(0.5)


def test_the_gripper_picks_a_cube_up(rig: Rig) -> None:
    model = rig.arm.model  # type: ignore[attr-defined]
    cube = next(thing for thing in model.objects if thing.name == "red_cube")
    chain = rig.arm.kinematics
    tool = rig.controller.reading.tool
    rig.show(Pose(name="ready"), 15.0)
    above = np.array([*cube.position[:2], cube.position[2] + 0.12])
    joints = chain.inverse(  # type: ignore[attr-defined]
        ToolPose(above, tool.orientation), rig.controller.reading.joints
    )
    assert joints.converged
    for number, angle in enumerate(joints.joints, start=1):
        turn = float(angle - rig.controller.reading.joints[number - 1])
        rig.show(TurnJoint(joint=number, angle=turn), 10.0)
        rig.wait(0.1)
    way = cube.position[2] + 0.008 - rig.controller.reading.tool.position[2]
    rig.show(MoveLinear(offset=(0, 0, way)), 10.0)
    rig.wait(0.5)
    rig.show(Gripper(width=0.0), 5.0)
    rig.wait(0.3)
    rig.show(JogCartesian(linear=(0, 0, 0.1)), 2.5)
    rig.wait(0.5)
    held = {thing.name: thing for thing in rig.controller.reading.objects}["red_cube"]
    assert held.position[2] > cube.position[2] + 0.1
    assert rig.controller.fault is None


@pytest.mark.parametrize("profile", model_names())
def test_every_camera_shows_the_robot_and_its_things(profile: str) -> None:
    renderer = Renderer(profile, hardware=False)
    try:
        assert renderer.names == ("wrist", "scene")
        for name in renderer.names:
            picture = renderer.picture(name)
            assert picture.std() > 20
            hsv = picture.max(axis=2).astype(int) - picture.min(axis=2)
            assert (hsv > 60).mean() > 0.01  # coloured things, not only floor and walls
            assert (picture == 255).all(axis=2).mean() < 0.2
    finally:
        renderer.close()


@pytest.mark.parametrize("profile", model_names())
def test_every_joint_changes_what_the_scene_camera_sees(profile: str) -> None:
    renderer = Renderer(profile, hardware=False)
    try:
        home = renderer.model.pose(renderer.model.home)
        before = renderer.picture("scene").astype(int)
        for joint in range(len(home)):
            joints = home.copy()
            joints[joint] += 0.4
            renderer.update(joints, 0.0, ())
            assert (np.abs(renderer.picture("scene") - before) > 20).any(axis=2).sum() >= 5, joint
    finally:
        renderer.close()


def test_the_scene_follows_a_base() -> None:
    renderer = Renderer("husky", hardware=False)
    try:
        start = {name: renderer.picture(name).astype(int) for name in renderer.names}
        renderer.update((1.0, 0.5), 0.0, (), (1.0, 0.2, 0.5))
        for name, before in start.items():
            assert (np.abs(renderer.picture(name) - before) > 30).any(axis=2).mean() > 0.01, name
    finally:
        renderer.close()


def test_a_robot_of_ones_own_moves_and_is_drawn_in_its_colours(tmp_path: Path) -> None:
    path = str(write_profile(tmp_path / "mine"))
    rig = Rig(path)
    reading = rig.show(TurnJoint(joint=2, angle=0.2), 10.0)
    assert reading.joints == pytest.approx(np.array([0.0, 0.3]), abs=1e-3)
    assert rig.show(JogJoint(joint=1, velocity=1.0), 0.7).velocities[0] > 0.9
    assert rig.stop("S1") <= 0.2
    rig.arm.close()
    renderer = Renderer(path, hardware=False)
    picture = renderer.picture("scene").astype(int)
    renderer.close()
    r, g, b = picture.transpose(2, 0, 1)
    assert ((r > 1.8 * g) & (r > 1.8 * b)).sum() + ((b > 1.8 * r) & (b > 1.8 * g)).sum() > 3


def test_without_a_gripper_the_action_is_refused(tmp_path: Path) -> None:
    toml = re.sub(r"(?s)\[gripper\].*?\n\n", "", TOML)
    rig = Rig(str(write_profile(tmp_path / "mine", toml)))
    rig.show(Gripper(width=0.0), 0.1)
    state = rig.controller.state(rig.now)
    assert state.reason == "this robot has no gripper"
    assert state.gripper == 0.0
    rig.arm.close()


def test_what_is_standing_stays_standing(rig: Rig) -> None:
    rig.wait(1.0)
    assert np.abs(rig.controller.reading.velocities).max() < STANDING
