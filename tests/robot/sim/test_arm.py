import numpy as np
import pybullet
import pytest

from app.errors import CannotStart
from app.link.messages import Description
from app.robot.arm import Arm, ToolPose
from app.robot.sim import world
from app.robot.sim.arm import SimulatedArm
from tests.robot.sim.conftest import Driver

DOWN = np.array([0.0, 0.0, 1.0, 0.0])
"""The tool's Z points down, its Y along the base's Y."""


def position_of(arm: SimulatedArm, name: str) -> np.ndarray:
    return np.array({thing.name: thing.position for thing in arm.read().objects}[name])


def ways_to(arm: SimulatedArm, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Joints with the tool 10 cm above a place, and at it."""
    above = arm.kinematics.inverse(
        ToolPose(place + np.array([0, 0, 0.1]), DOWN), np.array(arm.model.poses["ready"])
    )
    at = arm.kinematics.inverse(ToolPose(place, DOWN), above.joints)
    assert above.converged and at.converged
    return above.joints, at.joints


def turn_about_z(arm: SimulatedArm, name: str, angle: float) -> None:
    """Set a thing down where it is, turned by an angle (rad)."""
    body = next(body for thing, body in arm._moving if thing == name)
    turned = pybullet.getQuaternionFromEuler([0, 0, angle])
    pybullet.resetBasePositionAndOrientation(
        body, position_of(arm, name), turned, physicsClientId=arm.client
    )


def grasp(driver: Driver, name: str, force: float | None = None) -> np.ndarray:
    """Close the gripper on a thing and lift it 10 cm; returns the joints at the end."""
    arm = driver.arm
    above, at = ways_to(arm, position_of(arm, name))
    driver.go(above, 1.5)
    driver.go(at, 1.0)
    arm.grip(0.0, force)
    driver.wait(0.8)
    driver.go(above, 1.0)
    return above


def test_is_an_arm_and_describes_itself(arm: SimulatedArm) -> None:
    interface: Arm = arm
    description = interface.description
    assert description == Description.model_validate_json(description.encode())
    assert description.id == "puma"
    assert description.model == "puma560"
    assert len(description.joints) == 6
    assert {camera.name for camera in description.cameras} == {"wrist", "scene"}
    assert {thing.name for thing in description.objects} >= {"table", "tray", "red_cube"}
    assert description.gripper_max == 0.08


def test_starts_at_home_at_rest_with_the_gripper_open(arm: SimulatedArm) -> None:
    reading = arm.read()
    assert reading.joints == pytest.approx(arm.home, abs=1e-9)
    assert reading.velocities == pytest.approx(np.zeros(6))
    assert reading.gripper == pytest.approx(0.08)
    assert [thing.name for thing in reading.objects] == [
        "red_cube",
        "green_block",
        "blue_cylinder",
    ]


def test_stands_still_and_nothing_moves_by_itself(arm: SimulatedArm, driver: Driver) -> None:
    before = arm.read()
    driver.wait(2.0)
    after = arm.read()
    assert np.abs(after.joints - arm.home).max() < 1e-4
    for one, other in zip(before.objects, after.objects, strict=True):
        assert other.position == pytest.approx(one.position, abs=1e-3)


def test_the_reading_is_where_bullet_says_the_tool_is(arm: SimulatedArm, driver: Driver) -> None:
    driver.go(np.array(arm.model.poses["tray"]), 2.0)
    tool = arm.read().tool
    state = pybullet.getLinkState(
        arm.body, arm._links["tool"], computeForwardKinematics=True, physicsClientId=arm.client
    )
    assert tool.position == pytest.approx(np.array(state[4]), abs=1e-6)
    x, y, z, w = state[5]
    assert abs(np.dot(tool.orientation, [w, x, y, z])) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("pose", ["ready", "tray", "inspect"])
def test_follows_a_smooth_motion_closely(driver: Driver, pose: str) -> None:
    assert driver.go(np.array(driver.arm.model.poses[pose]), 2.0) < 0.002


def test_follows_near_full_speed(driver: Driver) -> None:
    # 0.9 rad in 2 s peaks at 0.84 rad/s: 90% of what joint 2 can do.
    there = driver.arm.home + np.array([0.9, -0.8, 0.9, 0.9, 0.9, -0.9])
    assert driver.go(there, 2.0) < 0.01


def test_holds_the_arm_stretched_out(driver: Driver) -> None:
    out = np.array([0.0, 0.0, -np.pi / 2, 0.0, 0.3, 0.0])
    driver.go(out, 4.0)
    driver.wait(1.0)
    assert np.abs(driver.arm.read().joints - out).max() < 1e-3


@pytest.mark.parametrize("name", ["red_cube", "green_block", "blue_cylinder"])
def test_lifts_and_holds(driver: Driver, name: str) -> None:
    start = position_of(driver.arm, name)
    grasp(driver, name)
    lifted = position_of(driver.arm, name)
    assert lifted[2] - start[2] == pytest.approx(0.1, abs=0.003)
    driver.wait(2.0)
    assert position_of(driver.arm, name) == pytest.approx(lifted, abs=0.001)
    assert driver.arm.read().gripper > 0.03


def test_a_held_cube_travels_along_and_falls_when_let_go(driver: Driver) -> None:
    grasp(driver, "red_cube")
    driver.go(np.array(driver.arm.model.poses["tray"]), 1.5)
    over = position_of(driver.arm, "red_cube")
    assert over == pytest.approx(driver.arm.read().tool.position, abs=0.01)
    driver.arm.grip(0.08)
    driver.wait(1.5)
    fallen = position_of(driver.arm, "red_cube")
    assert 0.40 < fallen[2] < 0.45
    assert abs(fallen[0] - 0.68) < 0.1 and abs(fallen[1] - 0.30) < 0.12  # in the tray


def test_the_fingers_keep_to_their_speed_and_their_ends(driver: Driver) -> None:
    arm = driver.arm
    arm.grip(-1.0)
    driver.wait(0.25)
    # Two fingers at 0.08 m/s each.
    assert arm.read().gripper == pytest.approx(0.08 - 2 * 0.08 * 0.25, abs=0.01)
    driver.wait(1.0)
    assert arm.read().gripper == pytest.approx(0.0, abs=1e-3)
    arm.grip(5.0)
    driver.wait(1.5)
    assert arm.read().gripper == pytest.approx(0.08, abs=1e-3)


@pytest.mark.parametrize("loaded", [False, True])
def test_the_brake_holds_against_gravity(driver: Driver, loaded: bool) -> None:
    arm = driver.arm
    if loaded:
        grasp(driver, "red_cube")
    else:
        driver.go(np.array([0.0, 0.2, -1.8, 0.0, 0.3, 0.0]), 4.0)
    before, cube = arm.read().joints, position_of(arm, "red_cube")
    arm.brake(True)
    driver.wait(2.0)
    assert np.abs(arm.read().joints - before).max() < 0.002
    if loaded:
        assert position_of(arm, "red_cube") == pytest.approx(cube, abs=0.002)


def test_the_brake_stops_a_motion_and_ignores_moves_until_released(driver: Driver) -> None:
    arm = driver.arm
    speed = np.array([1.0, -0.8, 1.5, 2.0, 2.0, 2.0])
    for number in range(40):
        arm.move(arm.home + speed * (number + 1) / 240, speed)
        arm.step()
    arm.brake(True)
    at_once = arm.read().joints
    driver.wait(0.1)
    stopped = arm.read()
    assert np.abs(stopped.velocities).max() < 0.01
    assert np.abs(stopped.joints - at_once).max() < 0.05
    driver.go(arm.home, 0.5)
    assert arm.read().joints == pytest.approx(stopped.joints, abs=0.002)
    arm.brake(False)
    driver.wait(0.5)
    assert arm.read().joints == pytest.approx(stopped.joints, abs=0.002)
    driver.go(arm.home, 1.5)
    assert arm.read().joints == pytest.approx(arm.home, abs=0.002)


def test_joints_do_not_leave_their_limits(driver: Driver) -> None:
    arm = driver.arm
    upper = np.array([joint.upper for joint in arm.model.joints])
    for _ in range(240):
        arm.move(upper + 0.5, np.zeros(6))
        arm.step()
    assert arm.read().joints[4] < upper[4] + 0.02


def test_closing_twice_does_no_harm() -> None:
    arm = SimulatedArm(objects=False)
    assert arm.read().objects == ()
    arm.close()
    other = SimulatedArm(objects=False)  # gets the number of the world that is free again
    arm.close()
    assert other.read().joints == pytest.approx(other.home)
    other.close()


def test_two_arms_do_not_disturb_one_another(arm: SimulatedArm) -> None:
    other = SimulatedArm()
    try:
        Driver(other).go(np.array(other.model.poses["ready"]), 0.5)
        assert arm.read().joints == pytest.approx(arm.home, abs=1e-9)
    finally:
        other.close()


def test_pybullet_without_numpy_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(world.pybullet, "isNumpyEnabled", lambda: 0)
    with pytest.raises(CannotStart, match="PyBullet was built without numpy; install the wheel"):
        SimulatedArm()


def test_an_unknown_model_is_named() -> None:
    with pytest.raises(CannotStart, match="no robot model 'r2d2'; there are: franka_panda, "):
        SimulatedArm("r2d2")


def test_things_go_back_to_where_they_began_and_lie_still(driver: Driver) -> None:
    arm = driver.arm
    before = {thing.name: thing for thing in arm.read().objects}
    grasp(driver, "red_cube")
    assert position_of(arm, "red_cube")[2] > before["red_cube"].position[2] + 0.05
    arm.reset_scene()
    driver.wait(0.5)
    for thing in arm.read().objects:
        assert thing.position == pytest.approx(before[thing.name].position, abs=0.003)
        assert np.abs(np.dot(thing.orientation, before[thing.name].orientation)) > 0.999
