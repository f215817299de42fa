import numpy as np
import pytest

from app.link.actions import Home, MoveLinear, Sequence, TurnJoint
from app.robot.motion.rotation import difference, rotate
from tests.robot.fakes import FakeArm
from tests.robot.motion.rig import Rig

SPEED = 0.25
"""m/s; of a straight move whose action names none."""


def off_the_line(rig: Rig, start: np.ndarray, along: np.ndarray) -> float:
    """m; the farthest that the tool was from its line, or past its end."""
    length = float(np.linalg.norm(along))
    direction, worst = along / length, 0.0
    for joints in rig.track:
        moved = rig.arm.kinematics.forward(joints).position - start
        part = float(moved @ direction)
        aside = float(np.linalg.norm(moved - part * direction))
        worst = max(worst, aside, part - length, -part)
    return worst


@pytest.mark.parametrize(
    ("offset", "rotation"),
    [
        ((0.0, 0.1, 0.0), (0.0, 0.0, 0.0)),
        ((0.0, 0.2, -0.1), (0.0, 0.0, 0.0)),
        ((0.0, 0.0, 0.0001), (0.0, 0.0, 0.0)),
        ((-0.05, 0.0, -0.15), (0.0, 0.2, 0.8)),
    ],
)
def test_it_ends_exactly_and_is_straight_and_even(
    offset: tuple[float, float, float], rotation: tuple[float, float, float]
) -> None:
    rig = Rig()
    start = rig.arm.read().tool
    rig.motion.begin(MoveLinear(offset=offset, rotation=rotation))
    rig.finish()
    end = rig.arm.read().tool
    assert end.position - start.position == pytest.approx(offset, abs=1e-8)
    assert difference(end.orientation, start.orientation) == pytest.approx(rotation, abs=1e-7)
    assert off_the_line(rig, start.position, np.array(offset)) < 1e-5
    whole, turned = np.linalg.norm(offset), np.array(rotation)
    for joints in rig.track:
        tool = rig.arm.kinematics.forward(joints)
        part = float(np.linalg.norm(tool.position - start.position)) / float(whole)
        now = difference(tool.orientation, start.orientation)
        assert now == pytest.approx(part * turned, abs=1e-3)


def test_the_tools_frame_is_that_of_the_beginning() -> None:
    rig = Rig()
    start = rig.arm.read().tool
    action = MoveLinear(frame="tool", offset=(0.02, 0.0, 0.1), rotation=(0.0, 0.0, 0.5))
    rig.motion.begin(action)
    rig.finish()
    end = rig.arm.read().tool
    along = rotate(start.orientation, np.array(action.offset))
    assert end.position - start.position == pytest.approx(along, abs=1e-8)
    assert off_the_line(rig, start.position, along) < 1e-5
    turned = difference(end.orientation, start.orientation)
    assert turned == pytest.approx(rotate(start.orientation, np.array([0, 0, 0.5])), abs=1e-7)


def test_a_turn_of_more_than_half_a_circle_goes_the_way_it_says() -> None:
    rig = Rig(FakeArm(np.array([0.3, 1.36, -3.35, -1.5, -1.15, -2.0])))
    rig.motion.begin(MoveLinear(frame="tool", rotation=(0.0, 0.0, 3.1)))
    rig.finish()
    first = rig.track[len(rig.track) // 4][5] - rig.track[0][5]
    assert rig.track[-1][5] - rig.track[0][5] == pytest.approx(3.1, abs=1e-6)
    assert first > 0


def test_the_speed_is_the_one_asked_for_and_the_robots_own_otherwise() -> None:
    for speed, expected in ((0.05, 0.05), (None, SPEED), (1.0, 0.5)):
        rig = Rig()
        rig.motion.begin(MoveLinear(offset=(0.0, 0.3, 0.0), speed=speed))
        rig.finish()
        places = [rig.arm.kinematics.forward(joints).position for joints in rig.track]
        fastest = max(np.linalg.norm(np.diff(places, axis=0), axis=1)) * 240
        assert fastest == pytest.approx(expected, rel=0.01)
        assert ("the tool moves at most at 0.50 m/s" in rig.limits) == (speed == 1.0)


@pytest.mark.parametrize(
    ("offset", "kind", "text"),
    [
        (
            (1.0, 0.0, 0.0),
            "unreachable",
            "only 32.0 cm of 100.0 cm can be reached in a straight line: it is",
        ),
        ((0.1, 0.0, 0.6), "joint_limit", "joint 5 would pass its limit"),
    ],
)
def test_what_cannot_be_reached_is_refused_before_it_moves(
    offset: tuple[float, float, float], kind: str, text: str
) -> None:
    rig = Rig()
    rig.motion.begin(MoveLinear(offset=offset))
    rig.finish()
    assert rig.motion.gave_up is not None
    assert text in rig.motion.gave_up
    assert rig.motion.gave_up.kind == kind
    assert all((joints == rig.track[0]).all() for joints in rig.track)


def test_what_cannot_be_done_ends_its_sequence() -> None:
    rig = Rig()
    steps = (TurnJoint(joint=1, angle=0.1), MoveLinear(offset=(1.0, 0.0, 0.0)), Home())
    rig.motion.begin(Sequence(steps=steps))
    rig.finish()
    assert rig.motion.gave_up is not None
    assert rig.motion.gave_up.startswith("step 2 of 3: only ")
    assert rig.arm.joints[0] == pytest.approx(rig.arm.home[0] + 0.1)
    rig.motion.begin(Home())
    assert rig.motion.gave_up is None
    rig.finish()


def test_letting_go_ends_it_on_the_line() -> None:
    rig = Rig()
    start = rig.arm.read().tool.position
    along = np.array([0.0, 0.3, 0.0])
    rig.motion.begin(MoveLinear(offset=(0.0, 0.3, 0.0)))
    rig.run(0.6)
    rig.motion.release()
    assert rig.finish() < 0.35
    assert 0.03 < rig.arm.read().tool.position[1] - start[1] < 0.25
    assert off_the_line(rig, start, along) < 1e-4
    assert rig.motion.gave_up is None


def test_a_stop_in_it_takes_at_most_200_ms() -> None:
    for count in range(10, 300, 20):
        rig = Rig()
        rig.motion.begin(MoveLinear(offset=(0.0, 0.3, -0.1), speed=0.5))
        for _ in range(count):
            rig.step()
        rig.motion.halt()
        assert rig.finish() <= 0.2


def test_no_way_at_all_ends_at_once() -> None:
    rig = Rig()
    rig.motion.begin(MoveLinear())
    assert rig.finish() < 0.02


def test_an_arm_that_is_shut_in_on_the_way_gives_up_in_words(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What shows only on the way (here: a limit that closes in) ends the move, too."""
    rig = Rig()
    rig.motion.begin(MoveLinear(offset=(0.0, 0.3, 0.0)))
    rig.run(0.5)
    rig.motion.trajectory.limits.upper[0] = rig.arm.joints[0] + 0.1
    rig.finish()
    assert rig.motion.gave_up is not None
    assert rig.motion.gave_up.kind == "joint_limit"
    assert "a joint is at its limit" in rig.motion.gave_up
