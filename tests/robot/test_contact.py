"""Contact, judged and real: an arm with physics, driven by its controller."""

from collections.abc import Iterator

import numpy as np
import pybullet
import pytest

from app.config import ArmMotionSettings, ClearanceSettings
from app.link.actions import Gripper, JogCartesian, JogJoint, MoveLinear
from app.robot.arm import Contact
from app.robot.contact import ContactWatch
from app.robot.controller import Controller
from app.robot.latch import StopLatch
from app.robot.sim.arm import SimulatedArm
from tests.robot.test_controller import Operator


def plain(name: str) -> str:
    return name


def felt(link: str, force: float, *, grasp: bool = False) -> tuple[Contact, ...]:
    return (Contact(link, "table", force, grasp),)


def test_over_the_threshold_is_a_collision_with_its_words() -> None:
    watch = ContactWatch(50.0, 40.0)
    assert watch.collision(felt("forearm", 49.0), plain) is None
    assert (
        watch.collision(felt("forearm", 61.4), plain) == "the forearm touched the table with 61 N"
    )
    assert watch.collision((), plain) is None


def test_a_grasp_may_press_with_the_grippers_force_on_top() -> None:
    watch = ContactWatch(50.0, 40.0)
    assert watch.collision(felt("finger", 80.0, grasp=True), plain) is None
    assert watch.collision(felt("finger", 91.0, grasp=True), plain) is not None


def test_what_the_arm_leans_on_when_the_brakes_come_off_leaves_the_way_out_open() -> None:
    watch = ContactWatch(50.0, 40.0)
    watch.released(felt("forearm", 70.0))
    assert watch.collision(felt("forearm", 75.0), plain) is None
    assert watch.collision(felt("forearm", 30.0), plain) is None
    assert watch.collision(felt("forearm", 85.0), plain) is not None  # 30 is what counts now
    assert watch.collision((), plain) is None
    assert watch.collision(felt("forearm", 60.0), plain) is not None


class Real(Operator):
    """A controller with the arm that has physics."""

    def __init__(self, settings: ArmMotionSettings | None = None) -> None:
        super().__init__()
        self.arm = SimulatedArm()  # type: ignore[assignment]
        self.controller = Controller(
            self.arm, "puma", settings or ArmMotionSettings(), StopLatch(None), self.now
        )

    def until(self, action: object, hold: int, seconds: float = 6.0) -> None:
        """Show it until the arm stands again."""
        self.show(action, hold, 0.3)  # type: ignore[arg-type]
        for _ in range(round(seconds / 0.1)):
            if self.state.mode != "moving":
                break
            self.show(action, hold, 0.1)  # type: ignore[arg-type]
        self.show(None, hold, 0.3)


@pytest.fixture
def real() -> Iterator[Real]:
    operator = Real()
    yield operator
    operator.arm.close()


def test_a_cube_is_picked_from_the_table_and_set_down_again(real: Real) -> None:
    real.ready()
    # Over the cube: down it goes at (0.55, 0.10), tool 20 mm above the table.
    real.until(MoveLinear(offset=(0.05, 0.10, 0.0)), 1)
    tool = real.state.tool_position
    assert tool[:2] == pytest.approx((0.55, 0.10), abs=0.01)
    real.until(JogCartesian(linear=(0.0, 0.0, -0.15)), 3)
    assert any("4 mm from the table" in text for text in real.state.limits) or (
        0.412 < real.state.tool_position[2] < 0.418
    )
    real.until(Gripper(width=0.0), 4)
    assert real.controller.reading.held == "red_cube"
    real.show(JogCartesian(linear=(0.0, 0.0, 0.15)), 5, 1.7)
    real.show(None, 5, 0.4)
    cube = {thing.name: thing for thing in real.state.objects}["red_cube"]
    assert cube.position[2] > 0.50
    real.until(JogCartesian(linear=(0.0, 0.0, -0.15)), 6)
    cube = {thing.name: thing for thing in real.state.objects}["red_cube"]
    assert 0.4225 < cube.position[2] < 0.4275  # 2 mm over the table, and not pressed on it
    real.until(Gripper(width=0.08), 7)
    assert real.controller.reading.held is None
    real.show(JogCartesian(linear=(0.0, 0.0, 0.15)), 8, 1.5)
    real.show(None, 8, 0.4)
    assert real.state.tool_position[2] > 0.5
    assert (real.state.mode, real.state.fault) == ("armed", None)


def test_something_that_nobody_knew_of_is_hit_once_and_latched(real: Real) -> None:
    real.ready()
    client = real.arm.client
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_BOX, halfExtents=[0.1, 0.05, 0.3], physicsClientId=client
    )
    hand = np.array(real.state.tool_position)
    pybullet.createMultiBody(
        0, shape, basePosition=hand + np.array([0.0, 0.25, 0.0]), physicsClientId=client
    )
    real.show(JogJoint(joint=1, velocity=0.5), 1, 2.0)
    state = real.state
    assert (state.mode, state.stop) == ("stopped", "S1")
    assert state.fault is not None
    assert state.fault.startswith("collision: the ")
    assert "touched the unknown thing with" in state.fault
    # The way out is open.
    real.wait(0.5)
    assert real.ask("reset").granted
    assert real.ask("arm").granted
    real.show(None, 1, 0.7)
    real.show(JogJoint(joint=1, velocity=-0.3), 2, 1.0)
    assert real.state.mode == "moving"
    assert real.state.joints[0] < state.joints[0] - 0.1


def test_fingers_pressed_on_the_table_are_a_collision() -> None:
    """With the stop distances off: what is left is what the arm feels."""
    off = ClearanceSettings(stop=0.0, stop_hand=0.0, stop_itself=0.0, stop_held=0.0)
    real = Real(ArmMotionSettings(clearance=off))
    real.controller.motion.guard._proximity = None
    try:
        real.ready()
        real.show(JogCartesian(linear=(0.0, 0.0, -0.2)), 1, 3.0)
        assert real.state.stop == "S1"
        assert real.state.fault is not None
        assert "finger touched the table with" in real.state.fault
    finally:
        real.arm.close()
