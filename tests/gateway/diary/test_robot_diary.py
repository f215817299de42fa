"""What is told of the robot, from the states that it publishes."""

from typing import Any

import pytest

from app.gateway.diary.robot import RobotDiary
from app.link.messages import State, StopCategory, Transition


class Told:
    """In place of the writer and the snapshots: notes what it is told."""

    def __init__(self) -> None:
        self.events: list[dict[str, Any]] = []
        self.pictures: list[int] = []

    def record(self, kind: str, /, *, lasts: bool = False, ago_s: float = 0.0, **data: Any) -> int:
        if ago_s:
            data["ago_s"] = ago_s
        self.events.append({"kind": kind, **data, "open": lasts})
        return len(self.events) - 1

    def finish(self, token: int, **data: Any) -> None:
        assert self.events[token]["open"]
        self.events[token]["open"] = False

    def want(self, token: int) -> None:
        self.pictures.append(token)

    @property
    def kinds(self) -> list[str]:
        return [event["kind"] for event in self.events]


class Robot:
    """A robot that is whatever a test says."""

    def __init__(self) -> None:
        self.state: State | None = None
        self.online = False
        self.steps: list[Transition] = []
        self.tick = 0

    def step(
        self,
        before: str,
        after: str,
        stop: StopCategory | None = None,
        reason: str | None = None,
    ) -> None:
        number = self.steps[-1].number + 1 if self.steps else 1
        step = Transition(
            number=number, tick=5, before=before, after=after, stop=stop, reason=reason
        )
        self.steps = [*self.steps, step][-5:]

    def says(self, **values: Any) -> None:
        self.online = True
        self.tick += 1
        joints = (0.0,) * 6
        fields = {
            "robot": "puma", "tick": self.tick, "mode": "disarmed", "armed": False,
            "controller": None, "epoch": 0, "joints": joints, "velocities": joints,
            "commanded": joints, "gripper": 0.0, "tool_position": (0, 0, 0),
            "tool_orientation": (1, 0, 0, 0), "transitions": tuple(self.steps),
        }  # fmt: skip
        self.state = State(**{**fields, **values})


@pytest.fixture
def robot() -> Robot:
    return Robot()


@pytest.fixture
def told() -> Told:
    return Told()


@pytest.fixture
def clock() -> list[float]:
    return [100.0]


@pytest.fixture
def diary(robot: Robot, told: Told, clock: list[float]) -> RobotDiary:
    return RobotDiary(robot, told, told, lambda: clock[0])  # type: ignore[arg-type]


def test_what_happened_before_is_not_told(robot: Robot, told: Told, diary: RobotDiary) -> None:
    diary.look()
    robot.step("disarmed", "armed")
    robot.says()
    diary.look()
    diary.look()
    assert told.events == []


def test_who_drives_is_told_when_it_changes(robot: Robot, told: Told, diary: RobotDiary) -> None:
    for who in (None, "operator-1", "operator-1", "operator-2", None):
        robot.says(controller=who)
        diary.look()
    assert [(event["who"], event["before"]) for event in told.events] == [
        ("operator-1", None), ("operator-2", "operator-1"), (None, "operator-2"),
    ]  # fmt: skip


def test_every_step_is_told_once_however_many_come_together(
    robot: Robot, told: Told, diary: RobotDiary
) -> None:
    robot.says()
    diary.look()
    robot.step("disarmed", "armed")
    robot.step("armed", "holding", "S2", "no hand is in the picture")
    robot.step("holding", "armed")
    robot.step("armed", "stopped", "S1", "the stop button was pressed (operator-1)")
    robot.step("stopped", "disarmed", None, "reset; not armed yet")
    robot.says(controller="operator-1", doubt="no_hand")
    diary.look()
    robot.says(controller="operator-1")
    diary.look()
    assert told.kinds == ["armed", "hold", "stop", "reset", "control"]
    assert told.events[0]["who"] == "operator-1"
    assert (told.events[1]["category"], told.events[1]["doubt"]) == ("S2", "no_hand")
    # Only the stop is worth a picture.
    assert told.pictures == [2]
    robot.step("disarmed", "holding", "S2", "show no gesture")
    robot.step("holding", "disarmed", None, "disarmed by operator-1")
    robot.says(controller="operator-1")
    diary.look()
    assert told.kinds[5:] == ["armed", "disarmed"]
    assert told.events[6]["reason"] == "disarmed by operator-1"


@pytest.mark.parametrize(
    ("reason", "who", "by"),
    [
        ("the stop button was pressed (observer-3)", "observer-3", "button"),
        ("a stop was asked for over REST (rest)", "rest", "rest"),
        ("the gesture 'stop' was shown (operator-7)", "operator-7", "gesture"),
        ("the sequence says stop (sequence)", None, "program"),
        ("forearm pressed on the table (arm)", None, "robot"),
        ("no word at all", None, "robot"),
    ],
)
def test_a_stop_is_told_with_who_asked_for_it_and_how(
    robot: Robot, told: Told, diary: RobotDiary, reason: str, who: str | None, by: str
) -> None:
    robot.says()
    diary.look()
    diary.asked("observer-3", "the stop button was pressed", "button")
    diary.asked("rest", "a stop was asked for over REST", "rest")
    robot.step("armed", "stopped", "S1", reason)
    robot.says()
    diary.look()
    assert told.events == [
        {"kind": "stop", "category": "S1", "who": who, "by": by, "reason": reason, "open": False}
    ]


def test_a_stop_that_nobody_confirms_is_told(told: Told, diary: RobotDiary) -> None:
    diary.unconfirmed("operator-1", "button")
    assert told.kinds == ["unconfirmed"]
    assert told.pictures == [0]


def test_a_fault_lasts_until_it_is_over(robot: Robot, told: Told, diary: RobotDiary) -> None:
    robot.says()
    diary.look()
    robot.says(fault="the arm does not follow")
    diary.look()
    diary.look()
    assert told.events == [{"kind": "fault", "reason": "the arm does not follow", "open": True}]
    robot.says()
    diary.look()
    assert told.events[0]["open"] is False
    robot.says(fault="again")
    diary.look()
    assert told.kinds == ["fault", "fault"]


def test_silence_and_a_new_node_are_told_and_its_steps_count_from_one(
    robot: Robot, told: Told, diary: RobotDiary, clock: list[float]
) -> None:
    for _ in range(7):
        robot.step("disarmed", "armed")
    robot.tick = 1000
    robot.says(controller="operator-1")
    diary.look()
    robot.online = False
    for _ in range(3):
        clock[0] += 0.5
        diary.look()
    assert told.kinds == ["control", "robot_lost"]
    assert told.events[1] == {"kind": "robot_lost", "ago_s": 1.0, "open": True}
    # Another process with another clock, and a stop that it kept.
    robot.steps, robot.tick = [], 10
    robot.step("disarmed", "stopped", "S1", "hit something (arm) (from before the node started)")
    robot.says()
    diary.look()
    assert told.kinds == ["control", "robot_lost", "robot_back", "stop", "control"]
    assert not told.events[1]["open"]
    assert told.events[3]["by"] == "robot"


def test_a_machine_that_stutters_does_not_fill_the_timeline(
    robot: Robot, told: Told, diary: RobotDiary, clock: list[float]
) -> None:
    def silent(seconds: float) -> None:
        robot.says()
        diary.look()
        robot.online = False
        for _ in range(round(seconds * 10)):
            clock[0] += 0.1
            diary.look()

    for _ in range(20):
        silent(0.5)
    assert told.events == []
    for _ in range(20):
        silent(1.5)
    assert told.kinds == ["robot_lost", "robot_back"]
    silent(5.5)
    robot.says()
    diary.look()
    assert told.kinds == ["robot_lost", "robot_back"] * 2
