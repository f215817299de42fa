"""A base that only would drive, held against the one that does."""

from collections.abc import Iterator

import numpy as np
import pytest

from app.config import ArmMotionSettings
from app.link.actions import Action, Home, JogCartesian, MoveLinear, Sequence, TurnJoint
from app.link.messages import DryRunReport, ObjectState
from app.robot import rehearsal
from app.robot.controller import DT
from app.robot.models import model_assets
from app.robot.rehearsal import Rehearsal
from app.robot.sim.rehearsed_base import RehearsedBase
from tests.robot.sim.rig import Rig


@pytest.fixture(scope="module")
def base() -> Iterator[RehearsedBase]:
    made = RehearsedBase(model_assets("husky"))
    yield made
    made.close()


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """A busy machine is slower than the check would wait."""
    monkeypatch.setattr(rehearsal, "MOST_WALL_S", 600.0)


def run(
    base: RehearsedBase,
    action: Action,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    objects: tuple[ObjectState, ...] = (),
) -> DryRunReport:
    base.place(np.array([3.0, 0.4]), start, objects)
    report = Rehearsal(base, ArmMotionSettings(), meets=base.meets, dt=DT).run(action)
    assert len(report.path.base) == len(report.path.times)
    return report


CURVE = Sequence(
    steps=(
        MoveLinear(offset=(0.6, 0.0, 0.0)),
        MoveLinear(rotation=(0.0, 0.0, 0.9)),
        JogCartesian(linear=(0.2, 0.0, 0.0), angular=(0.0, 0.0, 0.4), duration=2.0),
    )
)


def test_it_ends_where_the_wheels_would_lead(base: RehearsedBase) -> None:
    report = run(base, CURVE)
    assert report.ok
    rig = Rig("husky")
    try:
        rig.show(CURVE, report.duration_s + 3.0)
        there = rig.controller.reading.base
    finally:
        rig.arm.close()
    assert there is not None
    assert report.path.base[-1][:2] == pytest.approx(there[:2], abs=0.02)
    assert report.path.base[-1][2] == pytest.approx(there[2], abs=0.02)


def test_it_begins_where_it_is_put_and_drives_where_it_looks(base: RehearsedBase) -> None:
    report = run(base, MoveLinear(offset=(1.0, 0.0, 0.0)), (-1.0, 1.0, np.pi / 2))
    assert report.path.base[0] == pytest.approx((-1.0, 1.0, np.pi / 2), abs=1e-3)
    assert report.path.base[-1] == pytest.approx((-1.0, 2.0, np.pi / 2), abs=0.02)
    assert report.path.joints[0] == pytest.approx((3.0, 0.4))
    assert report.path.joints[-1] == pytest.approx((4.0, 0.4), abs=0.01)


def test_a_turn_goes_past_half_a_turn(base: RehearsedBase) -> None:
    report = run(base, TurnJoint(joint=2, angle=4.0))
    assert report.ok
    assert report.path.base[-1][2] == pytest.approx(4.0 - 2 * np.pi, abs=0.03)
    assert report.path.joints[-1][1] == pytest.approx(4.4, abs=0.01)


def test_what_can_be_pushed_is_told_and_what_stands_is_the_end_of_the_way(
    base: RehearsedBase,
) -> None:
    far = Sequence(steps=tuple(MoveLinear(offset=(1.0, 0.0, 0.0)) for _ in range(6)))
    report = run(base, far)
    assert not report.ok
    assert [(each.step, each.kind, each.message) for each in report.problems] == [
        (2, "collision", "the robot would push the crate"),
    ]
    # The crate was carried away meanwhile, and the wall is next.
    crate = ObjectState(name="crate", position=(0.0, 3.0, 0.2), orientation=(1.0, 0.0, 0.0, 0.0))
    report = run(base, far, objects=(crate,))
    assert [(each.step, each.kind, each.message) for each in report.problems] == [
        (5, "collision", "the robot would drive against the wall front"),
    ]
    assert report.path.base[-1][0] < 5.1


def test_what_it_stands_at_already_it_may_leave(base: RehearsedBase) -> None:
    start = (4.995, 0.0, 0.0)
    report = run(base, MoveLinear(offset=(-0.5, 0.0, 0.0)), start)
    assert report.ok
    assert report.path.base[-1][0] == pytest.approx(start[0] - 0.5, abs=0.03)


def test_it_finds_no_way_by_itself(base: RehearsedBase) -> None:
    report = run(base, Home())
    assert [each.kind for each in report.problems] == ["unreachable"]
    assert len(report.path.base) == 1
