"""A friction grasp holds in every motion and every stop, if it is firm enough; else things slip."""

from collections.abc import Callable

import numpy as np
import pytest

from app.config import ArmMotionSettings
from app.link.actions import Action, Gripper, JogCartesian, JogJoint
from app.robot.arm import Vector
from app.robot.motion.motion import Motion
from app.robot.motion.rotation import rotate
from app.robot.sim.arm import SimulatedArm
from app.robot.sim.world import STEPS_PER_SECOND
from tests.robot.sim.conftest import Driver
from tests.robot.sim.test_arm import grasp, position_of, turn_about_z, ways_to

CUBE = "red_cube"
INVERSE = np.array([1.0, -1.0, -1.0, -1.0])

JOGS: tuple[tuple[Action, float, str], ...] = (
    (JogCartesian(linear=(0.0, 0.5, 0.0)), 0.5, "release"),
    (JogCartesian(linear=(0.0, -0.5, 0.0)), 0.5, "S1"),
    (JogCartesian(linear=(0.0, 0.0, 0.5)), 0.4, "S1"),
    (JogJoint(joint=1, velocity=1.4), 0.6, "S1"),
    (JogJoint(joint=1, velocity=-1.4), 0.6, "S0"),
    (JogJoint(joint=6, velocity=4.0), 0.5, "S1"),
    (JogJoint(joint=5, velocity=-3.0), 0.3, "S0"),
    (JogJoint(joint=4, velocity=4.0), 0.4, "S0"),
)
"""At full speed: what, for how long (s), and how it is stopped."""


def in_the_hand(arm: SimulatedArm) -> Vector:
    """Where the cube is, seen from the tool (m)."""
    tool = arm.read().tool
    away = position_of(arm, CUBE) - tool.position
    return rotate(tool.orientation * INVERSE, away)


def carry(driver: Driver, after: Callable[[], None]) -> None:
    """Do the jogs one after another, each to its stop; ``after`` is called at each standstill."""
    arm = driver.arm
    motion = Motion(arm, ArmMotionSettings(), 1 / STEPS_PER_SECOND)

    def run(seconds: float) -> None:
        for _ in range(round(seconds * STEPS_PER_SECOND)):
            motion.step(arm.read())
            arm.move(motion.trajectory.position, motion.trajectory.velocity)
            arm.step()

    for action, seconds, stop in JOGS:
        motion.reset(arm.read().joints)
        motion.begin(action)
        run(seconds)
        if stop == "release":
            motion.release()
            run(0.6)
        else:
            if stop == "S1":
                motion.halt()
                run(0.2)
            arm.brake(True)
            driver.wait(0.5)
            arm.brake(False)
        after()


@pytest.mark.parametrize("force", [5.0, 15.0, None])
def test_what_is_held_stays_in_the_hand_in_every_motion_and_stop(
    driver: Driver, force: float | None
) -> None:
    grasp(driver, CUBE, force)
    held = in_the_hand(driver.arm)

    def look() -> None:
        assert np.linalg.norm(in_the_hand(driver.arm) - held) < 0.001

    carry(driver, look)


@pytest.mark.parametrize("cycles", [8, 24, 64])
def test_a_thing_askew_is_held_however_soon_the_gesture_is_let_go(
    driver: Driver, cycles: int
) -> None:
    """It turns into its place between the fingers, for about 0.3 s."""
    arm = driver.arm
    place = position_of(arm, CUBE)
    turn_about_z(arm, CUBE, np.deg2rad(12))
    above, at = ways_to(arm, place)
    driver.go(above, 1.5)
    driver.go(at, 1.0)
    motion = Motion(arm, ArmMotionSettings(), 1 / STEPS_PER_SECOND)
    motion.begin(Gripper(width=0.0))
    since = 0
    while since < cycles:
        reading = arm.read()
        since += reading.held == CUBE
        motion.step(reading)
        arm.step()
    motion.release()
    driver.wait(0.5)
    driver.go(above, 1.0)
    assert position_of(arm, CUBE)[2] - place[2] == pytest.approx(0.1, abs=0.01)


def test_what_is_held_too_softly_slips_in_a_stop(driver: Driver) -> None:
    place = position_of(driver.arm, CUBE)
    # 0.8 N of weight; two fingers of 0.7 N hold 2 x 0.7 x 0.6 = 0.84 N: at rest, no more.
    grasp(driver, CUBE, 0.7)
    assert position_of(driver.arm, CUBE)[2] - place[2] == pytest.approx(0.1, abs=0.01)
    held = in_the_hand(driver.arm)
    moved: list[float] = []
    carry(driver, lambda: moved.append(float(np.linalg.norm(in_the_hand(driver.arm) - held))))
    assert moved[-1] > 0.05


def test_what_is_held_with_less_than_its_weight_stays_on_the_table(driver: Driver) -> None:
    place = position_of(driver.arm, CUBE)
    grasp(driver, CUBE, 0.4)
    assert position_of(driver.arm, CUBE) == pytest.approx(place, abs=0.01)


def test_more_than_the_gripper_can_is_what_it_can(driver: Driver) -> None:
    grasp(driver, CUBE, 500.0)
    held = in_the_hand(driver.arm)
    driver.wait(1.0)
    assert in_the_hand(driver.arm) == pytest.approx(held, abs=1e-3)
