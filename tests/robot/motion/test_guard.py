"""Distances and workspace, with the real geometry of arm and scene."""

import random
from collections.abc import Iterator

import numpy as np
import pytest

from app.config import ClearanceSettings
from app.link.actions import JogCartesian, JogJoint, Pose, TurnJoint
from app.link.messages import ObjectState
from app.robot.arm import Near, Reading, ToolPose
from app.robot.models import model_assets
from app.robot.motion.guard import Guard, Margin
from app.robot.sim.proximity import SimulatedProximity
from tests.robot.fakes import DT, FakeArm
from tests.robot.motion.rig import Rig
from tests.robot.motion.test_motion import random_action

SETTINGS = ClearanceSettings()
ASSETS = model_assets("puma560")
LOW = ASSETS.model.pose("ready")


@pytest.fixture(scope="module")
def world() -> Iterator[SimulatedProximity]:
    proximity = SimulatedProximity(ASSETS)
    yield proximity
    proximity.close()


@pytest.fixture
def proximity(world: SimulatedProximity) -> SimulatedProximity:
    arm = FakeArm()
    things = tuple(
        ObjectState(name=thing.name, position=thing.position, orientation=turned(thing.turn))
        for thing in ASSETS.model.objects
        if thing.mass > 0
    )
    arm.objects = things
    world.follow(arm.read(), standing=True)
    return world


def turned(turn: float) -> tuple[float, float, float, float]:
    return float(np.cos(turn / 2)), 0.0, 0.0, float(np.sin(turn / 2))


class Watched(Rig):
    """Every commanded step is checked against every distance, and against the workspace."""

    def __init__(self, proximity: SimulatedProximity, joints: np.ndarray | None = None) -> None:
        arm = FakeArm(joints)
        arm.proximity = proximity
        super().__init__(arm)
        self.before: dict[tuple[str, str], float] = self.margins()
        self.least: dict[str, float] = {}

    def margins(self) -> dict[tuple[str, str], float]:
        found = {}
        for margin in self.motion.guard.margins(self.motion.trajectory.position):
            found[margin.pair] = margin.distance - margin.stop
        return found

    def step(self) -> None:
        super().step()
        now = self.margins()
        for pair, room in now.items():
            # Outside the stop distance, or not nearer than it was.
            assert room >= min(0.0, self.before.get(pair, 0.0)) - 2e-4, (pair, room)
        self.before = now
        for margin in self.motion.guard.margins(self.motion.trajectory.position):
            self.least[margin.kind] = min(self.least.get(margin.kind, 1.0), margin.distance)


def test_the_hand_comes_down_to_where_things_are_grasped_and_no_further(
    proximity: SimulatedProximity,
) -> None:
    rig = Watched(proximity, LOW)
    rig.do(JogCartesian(linear=(0.0, 0.0, -0.2)), 4.0)
    tool = rig.arm.read().tool.position
    # The tips are 10 mm beyond the tool's point, the table's top is at 0.40.
    assert 0.404 <= tool[2] - 0.010 < 0.406
    assert any(text.startswith("slowed: ") for text in rig.limits)
    assert any("finger is 4 mm from the table" in text for text in rig.limits)
    start = rig.arm.kinematics.forward(LOW).position
    for joints in rig.track:  # straight to the end
        assert np.abs(rig.arm.kinematics.forward(joints).position - start)[:2].max() < 1e-3
    rig.do(JogCartesian(linear=(0.0, 0.0, 0.2)), 1.0)  # and back
    assert rig.arm.read().tool.position[2] > 0.5


def test_slow_from_100_mm(proximity: SimulatedProximity) -> None:
    rig = Watched(proximity, LOW)
    rig.motion.begin(JogCartesian(linear=(0.0, 0.0, -0.2)))
    speeds: dict[int, float] = {}
    for _ in range(round(4.0 / DT)):
        before = rig.arm.read().tool.position[2]
        rig.step()
        at = rig.arm.read().tool.position[2]
        speeds[round(1000 * (at - 0.410))] = (before - at) / DT
    assert speeds[115] == pytest.approx(0.2, rel=0.03)
    assert speeds[30] < 0.75 * speeds[115]
    assert speeds[10] < 0.5 * speeds[115]


def test_an_elbow_stops_at_20_mm_and_comes_away_again(proximity: SimulatedProximity) -> None:
    rig = Watched(proximity)
    rig.do(JogJoint(joint=2, velocity=-1.0), 6.0)
    text = next(iter(text for text in rig.limits if text.startswith("stopped")))
    assert text
    down = rig.arm.joints[1]
    rig.do(JogJoint(joint=2, velocity=1.0), 0.5)
    assert rig.arm.joints[1] > down + 0.1


def test_the_arm_keeps_off_itself(proximity: SimulatedProximity) -> None:
    """The hand folded back against the forearm."""
    folded = np.array([0.3, 1.4, -2.0, 0.0, 0.0, 0.0])
    rig = Watched(proximity, folded)
    for joint, velocity in [(5, 4.0), (5, -4.0)]:
        rig.do(JogJoint(joint=joint, velocity=velocity), 2.0)
    assert rig.least.get("itself", 1.0) >= SETTINGS.stop_itself


def test_the_tool_stays_in_its_box(proximity: SimulatedProximity) -> None:
    rig = Watched(proximity)
    rig.do(JogJoint(joint=1, velocity=1.4), 6.0)
    assert any("from the edge of its workspace" in text for text in rig.limits)
    box = rig.arm.description.workspace
    assert box is not None
    tool = rig.arm.read().tool.position
    assert tool[0] > box.lower[0]
    assert rig.arm.joints[0] < 2.7  # not the joint's own limit
    rig.do(JogJoint(joint=1, velocity=-1.4), 1.0)
    assert rig.arm.joints[0] < 2.0


def test_from_inside_the_stop_distance_only_the_way_out_is_open(
    proximity: SimulatedProximity,
) -> None:
    """A thing was put beside the forearm, nearer than the arm itself would have come."""
    rig = Watched(proximity, LOW)
    rig.run(0.1)
    flange = rig.arm.kinematics.forward(rig.arm.joints).position + np.array(
        [0.0, 0.0, 0.124 + 0.005]
    )
    rig.arm.objects = (
        ObjectState(
            name="blue_cylinder",
            position=(float(flange[0]), float(flange[1]) + 0.065, float(flange[2])),
            orientation=(1.0, 0.0, 0.0, 0.0),
        ),
    )
    rig.before = {}
    rig.motion.step(rig.arm.read())
    for _ in range(8):
        rig.motion.step(rig.arm.read())
    rig.before = rig.margins()
    assert min(rig.before.values()) < 0
    start = rig.arm.joints.copy()
    rig.do(JogCartesian(linear=(0.0, 0.1, 0.0)), 1.0)
    assert np.abs(rig.arm.joints - start).max() < 1e-3
    assert any(text.startswith("stopped: ") for text in rig.limits)
    rig.do(JogCartesian(linear=(0.0, -0.1, 0.0)), 1.6)
    assert rig.arm.read().tool.position[1] < flange[1] - 0.08


def test_what_is_held_is_part_of_the_arm(proximity: SimulatedProximity) -> None:
    rig = Watched(proximity, LOW)
    tool = rig.arm.read().tool.position
    rig.arm.objects = (
        ObjectState(name="red_cube", position=tuple(tool), orientation=(1.0, 0.0, 0.0, 0.0)),
    )
    rig.arm.held, rig.arm.width = "red_cube", 0.045
    rig.run(0.1)
    rig.before = rig.margins()
    rig.motion.begin(JogCartesian(linear=(0.0, 0.0, -0.2)))
    rig.run(4.0)
    rig.motion.release()
    rig.finish()
    down = rig.arm.read().tool.position[2]
    assert 0.402 <= down - 0.0225 < 0.404
    assert any("red cube is 2 mm from the table" in text for text in rig.limits)


def test_what_settles_in_the_hand_is_noticed(proximity: SimulatedProximity) -> None:
    reading = FakeArm(LOW).read()
    x, y, z = reading.tool.position

    def hold(height: float) -> bool:
        cube = ObjectState(name="red_cube", position=(x, y, height), orientation=(1, 0, 0, 0))
        held = reading._replace(objects=(cube,), held="red_cube", gripper=0.045)
        return proximity.follow(held, standing=True)

    assert hold(z)
    assert not hold(z)
    assert hold(z - 5e-5)


class OneThing:
    """Something held, at a distance that the test sets."""

    distance = -1e-5

    def follow(self, reading: Reading, *, standing: bool) -> bool:
        return True

    def near(self, joints: np.ndarray, within: float) -> list[Near]:
        here = (0.0, 0.0, 0.0)
        return [Near("held", "cube", "table", self.distance, (here, here), (0, 6))]

    def plain(self, name: str) -> str:
        return name


def test_a_thing_that_settles_in_the_hand_leaves_the_way_out_open() -> None:
    """On the table, it sinks by less than the leeway; the rounding of the first step follows."""
    arm, thing = FakeArm(), OneThing()
    guard = Guard(thing, arm.kinematics, None, SETTINGS, 6)
    joints = arm.joints

    def room() -> float:
        return guard.room(guard.margins(joints))

    guard.watch(arm.read(), joints, standing=True)
    thing.distance = -1.08e-4
    for _ in range(8):
        guard.watch(arm.read(), joints, standing=True)
    thing.distance = -1.12e-4
    assert room() > 0
    thing.distance = -2.5e-4  # that is no rounding
    assert room() < 0


def test_the_state_tells_what_is_nearest(proximity: SimulatedProximity) -> None:
    rig = Watched(proximity, LOW)
    rig.do(JogCartesian(linear=(0.0, 0.0, -0.2)), 4.0)
    clearance = rig.motion.guard.clearance
    assert clearance is not None
    assert clearance.thing == "table"
    assert clearance.distance == pytest.approx(SETTINGS.stop_hand, abs=0.002)
    assert clearance.points[0][2] == pytest.approx(0.40 + clearance.distance, abs=1e-4)
    assert clearance.points[1][2] == pytest.approx(0.40, abs=1e-4)


def test_a_pose_behind_a_wall_is_reached_round_it(proximity: SimulatedProximity) -> None:
    """The fingers are down in the tray, beside its wall; the straight way would cut the wall."""
    rig = Watched(proximity, in_the_tray())
    rig.motion.begin(Pose(name="right"))
    rig.finish(40.0)
    assert rig.arm.joints == pytest.approx(rig.arm.description.poses["right"])
    assert "looking for a way that keeps clear of things" in rig.limits
    assert not any(text.startswith("stopped") for text in rig.limits)


def in_the_tray() -> np.ndarray:
    arm = FakeArm()
    down = arm.kinematics.forward(arm.home).orientation
    pose = ToolPose(np.array([0.66, 0.245, 0.425]), down)
    solution = arm.kinematics.inverse(pose, ASSETS.model.pose("tray"))
    assert solution.converged
    return solution.joints


def test_a_turn_straight_through_the_same_wall_stops_before_it(
    proximity: SimulatedProximity,
) -> None:
    rig = Watched(proximity, in_the_tray())
    rig.do(TurnJoint(joint=1, angle=-0.8), 4.0)
    assert rig.arm.joints[0] > in_the_tray()[0] - 0.2
    assert any(text.startswith("stopped: ") and "tray right" in text for text in rig.limits)


def test_a_pose_that_something_stands_in_is_refused_and_the_arm_stands(
    proximity: SimulatedProximity,
) -> None:
    rig = Watched(proximity)
    there = rig.arm.kinematics.forward(ASSETS.model.pose("right")).position
    rig.arm.objects = (
        ObjectState(
            name="blue_cylinder",
            position=(float(there[0]), float(there[1]), float(there[2]) + 0.2),
            orientation=(1.0, 0.0, 0.0, 0.0),
        ),
    )
    rig.motion.begin(Pose(name="right"))
    rig.finish(2.0)
    (told,) = rig.motion.limits
    assert told.startswith("the pose right is too near to something now: ")
    assert told.endswith(" mm from the blue cylinder")
    assert np.array_equal(rig.arm.joints, rig.arm.home)


def test_a_search_that_takes_too_long_is_given_up(proximity: SimulatedProximity) -> None:
    rig = Watched(proximity, in_the_tray())
    rig.motion._settings = rig.motion._settings.model_copy(update={"planning_s": 0.02})
    rig.motion.begin(Pose(name="right"))
    rig.finish(2.0)
    assert rig.motion.limits == ("found no way to the pose right that keeps clear of things",)
    assert np.array_equal(rig.arm.joints, in_the_tray())


@pytest.mark.parametrize("seed", range(3))
def test_no_distance_is_ever_broken_whatever_is_asked(
    proximity: SimulatedProximity, seed: int
) -> None:
    rng = random.Random(seed)
    rig = Watched(proximity)
    for _ in range(60):
        action = random_action(rng)
        if not rig.motion.busy:
            rig.motion.begin(action)
        for _ in range(rng.randint(1, 90)):
            rig.step()
        what = rng.random()
        if what < 0.5:
            rig.motion.release()
        elif what < 0.8:
            rig.motion.halt()
            assert rig.finish() <= 0.2


def test_margin_names_its_pair() -> None:
    margin = Margin("scene", "link3", "table", 0.05, 0.02, 0.1, slice(0, 3))
    assert margin.pair == ("link3", "table")
