"""With brakes on nothing moves: every shipped robot, with a load, from rest and from full speed."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pybullet
import pytest

from app.errors import CannotStart
from app.link.actions import JogJoint, Pose
from app.robot.arm import Arm, Reading, Vector
from app.robot.models import load_profile, model_assets, model_names
from app.robot.sim.arm import SimulatedArm
from app.robot.sim.base import SimulatedBase
from app.robot.sim.brake_check import MARGIN, heaviest_load
from app.robot.sim.kinematic_arm import KinematicArm
from app.robot.sim.rehearsed_base import RehearsedBase
from app.robot.sim.world import STEPS_PER_SECOND
from tests.robot.models.profiles import TOML, write_profile
from tests.robot.sim.rig import Rig

BASES = [name for name in model_names() if model_assets(name).model.base is not None]
ARMS = [name for name in model_names() if name not in BASES]
NOTHING = 1e-4
"""rad or m in ten seconds"""
LOAD = "red_cube"


def wait(arm: Arm, seconds: float) -> Reading:
    for _ in range(round(seconds * STEPS_PER_SECOND)):
        arm.step()
    return arm.read()


def moved(before: Reading, after: Reading) -> float:
    """The largest way of a joint, or of the base in the room."""
    ways = np.abs(after.joints - before.joints)
    if before.base is not None and after.base is not None:
        ways = np.append(ways, np.abs(np.array(after.base) - before.base))
    return float(ways.max())


def until_rest(arm: Arm, seconds: float = 1.0) -> float:
    """Let the arm brake; returns for how long it moved, s."""
    last = 0
    for number in range(1, round(seconds * STEPS_PER_SECOND) + 1):
        arm.step()
        if np.abs(arm.read().velocities).max() > 1e-3:
            last = number
    return last / STEPS_PER_SECOND


def drive(arm: Arm, speeds: Vector, seconds: float) -> None:
    """Come to ``speeds`` within half the time, and go on with them."""
    steps = round(seconds * STEPS_PER_SECOND)
    place = arm.read().joints
    for number in range(1, steps + 1):
        now = speeds * min(1.0, 2 * number / steps)
        place = place + now / STEPS_PER_SECOND
        arm.move(place, now)
        arm.step()


def full_speed(arm: SimulatedArm, seed: int) -> Vector:
    """Every joint at the speed of its profile, to a side that is drawn."""
    speeds = np.array([joint.velocity for joint in arm.model.joints])
    return speeds * np.random.default_rng(seed).choice([-1.0, 1.0], len(speeds))


def load_offset(arm: SimulatedArm) -> Vector:
    """Where the load is, seen from the tool's place; m."""
    reading = arm.read()
    places = {thing.name: thing.position for thing in reading.objects}
    return np.array(places[LOAD]) - reading.tool.position


def grip_load(arm: SimulatedArm, mass: float | None = None) -> None:
    """Put the load between the fingers and close them."""
    body, client = arm.objects[LOAD], arm.client
    if mass is not None:
        pybullet.changeDynamics(body, -1, mass=mass, physicsClientId=client)
    tool = arm.read().tool
    w, x, y, z = tool.orientation
    pybullet.setGravity(0, 0, 0, physicsClientId=client)
    pybullet.resetBasePositionAndOrientation(
        body, tool.position, (x, y, z, w), physicsClientId=client
    )
    arm.grip(0.0)
    wait(arm, 0.8)
    pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
    wait(arm, 0.2)
    assert arm.read().held == LOAD


def stand(arm: SimulatedArm, joints: Vector) -> None:
    """Be at ``joints``, held by the motors."""
    arm._place(joints)
    arm.move(joints, np.zeros(len(joints)))
    wait(arm, 0.2)


@pytest.fixture(params=ARMS)
def arm(request: pytest.FixtureRequest) -> Iterator[SimulatedArm]:
    arm = SimulatedArm(request.param)
    yield arm
    arm.close()


@pytest.fixture(params=BASES)
def base(request: pytest.FixtureRequest) -> Iterator[SimulatedBase]:
    base = SimulatedBase(model_assets(request.param))
    yield base
    base.close()


def test_an_arm_at_rest_with_a_load_does_not_move(arm: SimulatedArm) -> None:
    stand(arm, arm.home)
    grip_load(arm)
    for name in ("ready", "left", "tray"):
        arm.brake(False)
        drive_to(arm, arm.model.pose(name))
        before, offset = arm.read(), load_offset(arm)
        arm.brake(True)
        after = wait(arm, 10.0)
        assert moved(before, after) < NOTHING, name
        assert after.velocities == pytest.approx(np.zeros(len(after.joints)), abs=1e-6)
        assert after.held == LOAD
        assert load_offset(arm) == pytest.approx(offset, abs=1e-3), name


def drive_to(arm: SimulatedArm, joints: Vector, seconds: float = 2.0) -> None:
    """A minimum-jerk path."""
    start, steps = arm.read().joints, round(seconds * STEPS_PER_SECOND)
    for number in range(1, steps + 1):
        t = number / steps
        part, speed = 10 * t**3 - 15 * t**4 + 6 * t**5, 30 * t**2 - 60 * t**3 + 30 * t**4
        arm.move(start + (joints - start) * part, (joints - start) * speed / seconds)
        arm.step()
    wait(arm, 0.1)


@pytest.mark.parametrize(("load", "strength"), [(3.0, 1.0), (40.0, 100.0)])
@pytest.mark.parametrize("profile", ARMS)
def test_a_heavy_load_does_not_creep_whatever_the_brakes_torque(
    profile: str, load: float, strength: float
) -> None:
    """Heavy (kg at the hand), Bullet's solver leaves it a speed however strong the brake is."""
    arm = SimulatedArm(profile, objects=False)
    try:
        fingers = arm._fingers[0]
        hand = pybullet.getJointInfo(arm.body, fingers, physicsClientId=arm.client)[16]
        mass = pybullet.getDynamicsInfo(arm.body, hand, physicsClientId=arm.client)[0]
        pybullet.changeDynamics(arm.body, hand, mass=mass + load, physicsClientId=arm.client)
        arm._brakes._torques = [strength * torque for torque in arm._brakes._torques]
        for seed in range(5):
            arm.brake(False)
            lower = np.array([joint.lower for joint in arm.model.joints])
            upper = np.array([joint.upper for joint in arm.model.joints])
            part = np.random.default_rng(seed).uniform(0.3, 0.7, len(lower))
            stand(arm, lower + part * (upper - lower))
            drive(arm, 0.5 * full_speed(arm, seed), 0.2)
            arm.brake(True)
            before = wait(arm, 1.5)
            assert moved(before, wait(arm, 10.0)) < NOTHING, seed
    finally:
        arm.close()


def test_an_arm_at_full_speed_is_stopped_at_once_and_then_stands(arm: SimulatedArm) -> None:
    for seed in range(2):
        arm.brake(False)
        stand(arm, arm.model.pose("inspect"))
        arm.grip(0.08)
        wait(arm, 0.5)
        grip_load(arm)
        drive(arm, full_speed(arm, seed), 0.24)
        began = arm.read()
        arm.brake(True)
        assert until_rest(arm) <= 0.2
        stood, offset = arm.read(), load_offset(arm)
        assert moved(began, stood) < 0.3
        after = wait(arm, 10.0)
        assert moved(stood, after) < NOTHING
        assert after.held == LOAD
        assert load_offset(arm) == pytest.approx(offset, abs=1e-3)


def test_a_heavier_load_is_stopped_and_held_too(arm: SimulatedArm) -> None:
    stand(arm, arm.model.pose("inspect"))
    grip_load(arm, mass=0.5)
    drive(arm, 0.5 * full_speed(arm, 1), 0.3)
    arm.brake(True)
    assert until_rest(arm) <= 0.2
    before, offset = arm.read(), load_offset(arm)
    assert moved(before, wait(arm, 10.0)) < NOTHING
    assert load_offset(arm) == pytest.approx(offset, abs=1e-3)


def push(arm: SimulatedArm, force: tuple[float, float, float], seconds: float) -> None:
    """Press on the tool, N."""
    link = arm._links[arm.model.tool_link]
    for _ in range(round(seconds * STEPS_PER_SECOND)):
        pybullet.applyExternalForce(
            arm.body,
            link,
            force,
            arm.read().tool.position,
            pybullet.WORLD_FRAME,
            physicsClientId=arm.client,
        )
        arm.step()


@pytest.mark.parametrize("force", [(0.0, -15.0, 0.0), (0.0, 0.0, -15.0)])
def test_a_braked_arm_that_is_pushed_stays(
    arm: SimulatedArm, force: tuple[float, float, float]
) -> None:
    arm.brake(True)
    before = wait(arm, 0.1)
    push(arm, force, 2.0)
    assert moved(before, arm.read()) < NOTHING
    assert moved(before, wait(arm, 10.0)) < NOTHING


def test_what_pushes_harder_than_the_brakes_moves_the_arm_and_it_stays_there(
    arm: SimulatedArm,
) -> None:
    arm.brake(True)
    before = wait(arm, 0.1)
    push(arm, (0.0, 3000.0, 0.0), 0.2)
    pushed = wait(arm, 1.0)
    assert moved(before, pushed) > 0.01
    assert moved(pushed, wait(arm, 10.0)) < NOTHING


def test_the_motors_take_over_where_the_brakes_held(arm: SimulatedArm) -> None:
    drive(arm, 0.5 * full_speed(arm, 3), 0.3)
    arm.brake(True)
    before = wait(arm, 1.0)
    arm.move(arm.home, np.zeros(len(arm.home)))
    assert moved(before, wait(arm, 0.5)) < NOTHING
    arm.brake(False)
    assert moved(before, wait(arm, 1.0)) < 1e-3
    drive_to(arm, arm.home)
    assert arm.read().joints == pytest.approx(arm.home, abs=2e-3)


@pytest.mark.parametrize("speeds", [(0.5, 0.0), (-0.5, 0.0), (0.0, 1.0), (0.4, -0.8), (0.0, 0.0)])
def test_a_base_stops_at_once_and_then_stands(
    base: SimulatedBase, speeds: tuple[float, float]
) -> None:
    drive(base, np.array(speeds), 0.8)
    began = base.read()
    base.brake(True)
    assert until_rest(base) <= 0.2
    stood = base.read()
    assert moved(began, stood) < 0.05
    assert moved(stood, wait(base, 10.0)) < NOTHING


@pytest.mark.parametrize("force", [(0.0, 100.0, 0.0), (150.0, 150.0, 0.0)])
def test_a_braked_base_that_is_pushed_stays(
    base: SimulatedBase, force: tuple[float, float, float]
) -> None:
    base.brake(True)
    before = wait(base, 0.5)
    shove(base, force, 2.0)
    assert moved(before, base.read()) < NOTHING
    assert moved(before, wait(base, 10.0)) < NOTHING


def test_what_pushes_harder_than_tyres_hold_moves_a_base_and_it_stays_there(
    base: SimulatedBase,
) -> None:
    base.brake(True)
    before = wait(base, 0.5)
    shove(base, (900.0, 0.0, 0.0), 0.3)
    pushed = wait(base, 1.5)
    assert moved(before, pushed) > 0.02
    assert moved(pushed, wait(base, 10.0)) < NOTHING


def shove(base: SimulatedBase, force: tuple[float, float, float], seconds: float) -> None:
    for _ in range(round(seconds * STEPS_PER_SECOND)):
        place = base.read().base
        assert place is not None
        pybullet.applyExternalForce(
            base.body,
            -1,
            force,
            (place[0], place[1], 0.15),
            pybullet.WORLD_FRAME,
            physicsClientId=base.client,
        )
        base.step()


@pytest.mark.parametrize("profile", ARMS)
def test_s0_in_motion_stops_and_then_nothing_moves_under_the_controller(profile: str) -> None:
    rig = Rig(profile)
    try:
        rig.show(Pose(name="inspect"), 15.0)
        for number in (1, 2):
            rig.show(JogJoint(joint=number, velocity=0.8), 0.4)
            assert rig.stop("S0") <= 0.2
            before = rig.controller.reading
            for _ in range(10 * STEPS_PER_SECOND):
                rig.cycle()
            assert moved(before, rig.controller.reading) < NOTHING
            rig.reset()
    finally:
        rig.arm.close()


def test_an_arm_without_physics_stands_when_braked_too() -> None:
    arm = KinematicArm(dt=1 / 60)
    try:
        speed = np.full(len(arm.home), 0.5)
        arm.move(arm.home + 0.1, speed)
        arm.step()
        arm.brake(True)
        before = arm.read()
        assert before.velocities == pytest.approx(np.zeros(len(speed)))
        arm.move(arm.home, speed)
        arm.step()
        assert moved(before, arm.read()) == 0
        arm.brake(False)
        arm.move(arm.home, speed)
        assert arm.read().joints == pytest.approx(arm.home)
    finally:
        arm.close()


@pytest.mark.parametrize("profile", BASES)
def test_a_base_in_a_dry_run_stands_when_braked_too(profile: str) -> None:
    base = RehearsedBase(model_assets(profile))
    try:
        base.place(np.array([1.0, 0.5]), (0.5, 0.2, 0.5), ())
        drive(base, np.array([0.4, 0.5]), 0.5)
        base.brake(True)
        before = wait(base, 0.5)
        assert moved(before, wait(base, 10.0)) < NOTHING
        base.place(np.zeros(2), (0.0, 0.0, 0.0), ())
        assert base.read().base == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    finally:
        base.close()


WEAK = TOML.replace("brake = 400.0", "brake = 12.0")


def test_brakes_that_cannot_hold_the_arm_are_refused_with_numbers(tmp_path: Path) -> None:
    """A slide that stands upright, with two masses of 1 kg and two fingers of 1 kg on it."""
    path = write_profile(tmp_path, WEAK)
    urdf = path.with_name("mine.urdf")
    urdf.write_text(urdf.read_text().replace('<axis xyz="1 0 0"/>', '<axis xyz="0 0 1"/>', 1))
    line = WEAK.splitlines().index("brake = 12.0") + 1
    with pytest.raises(CannotStart, match="its brake of 12 N does not hold the arm") as caught:
        SimulatedArm(str(path))
    assert caught.value.message.startswith(f"{path}:{line}: slide: ")
    assert "that takes up to 29.4 N, and 1.25 times as much to be sure, 36.8 N" in str(caught.value)


def test_the_load_counts_for_the_brakes(tmp_path: Path) -> None:
    thing = (
        '\n[[objects]]\nname = "ingot"\nshape = "box"\nsize = [0.04, 0.04, 0.04]\n'
        "position = [0.5, 0.0, 0.02]\nmass = 2.0\ncolour = [0.5, 0.5, 0.5, 1.0]\n"
    )
    path = write_profile(tmp_path, TOML.replace("brake = 400.0", "brake = 50.0") + thing)
    urdf = path.with_name("mine.urdf")
    urdf.write_text(urdf.read_text().replace('<axis xyz="1 0 0"/>', '<axis xyz="0 0 1"/>', 1))
    with pytest.raises(CannotStart, match="does not hold the arm and 2 kg in its gripper"):
        SimulatedArm(str(path))


@pytest.mark.parametrize("profile", ARMS)
def test_shipped_brakes_hold_with_room_to_spare(profile: str) -> None:
    """As measured, anywhere in the joints' ranges."""
    assert heaviest_load(load_profile(profile).model) > 0
    arm = SimulatedArm(profile, objects=False)
    try:
        rng = np.random.default_rng(2)
        lower = np.array([joint.lower for joint in arm.model.joints])
        upper = np.array([joint.upper for joint in arm.model.joints])
        for _ in range(10):
            stand(arm, rng.uniform(lower, upper))
            arm.brake(True)
            arm.step()
            states = pybullet.getJointStates(arm.body, arm._joints, physicsClientId=arm.client)
            torques = np.abs([state[3] for state in states])
            brakes = np.array([joint.brake for joint in arm.model.joints])
            assert (torques * MARGIN < brakes).all()
            arm.brake(False)
    finally:
        arm.close()
