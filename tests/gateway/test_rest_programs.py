"""Programs over REST: versions, changes that meet, and dry runs with a stand-in that answers."""

import threading
from collections.abc import Iterator
from typing import Any

import pytest

from app.link.messages import DryRunPath, DryRunProblem, DryRunReport, DryRunRequest, key
from app.link.session import open_session
from tests.gateway.running import Running, StandIn, wait_for
from tests.gateway.test_rest_gestures import error

HOME = {"type": "home"}
STOP = {"type": "stop"}
PROGRAM: dict[str, Any] = {
    "type": "sequence",
    "steps": [
        {"type": "move_linear", "frame": "tool", "offset": [0, 0, 0.05], "rotation": [0, 0, 0.5]},
        {"type": "gripper", "width": 0.0, "force": 10.0},
        {"type": "wait", "duration": 0.5},
        {"type": "repeat", "times": 3, "steps": [{"type": "turn_joint", "joint": 1, "angle": 0.1}]},
        HOME,
    ],
}


@pytest.fixture
def path(server: Running) -> str:
    (gesture,) = (g for g in server.http.get("/api/gestures").json() if g["name"] == "home")
    assert gesture["version"] == 1
    return f"/api/gestures/{gesture['id']}"


def test_every_version_of_a_program_is_listed(server: Running, path: str) -> None:
    changed = server.http.patch(path, json={"action": PROGRAM}).json()
    assert changed["version"] == 2
    assert [step["type"] for step in changed["action"]["steps"]] == [
        step["type"] for step in PROGRAM["steps"]
    ]
    versions = server.http.get(f"{path}/versions").json()
    assert [version["version"] for version in versions] == [1, 2]
    assert versions[0]["action"] == HOME
    assert versions[1]["action"] == changed["action"]
    assert versions[0]["created"] < versions[1]["created"]


def test_a_former_version_is_restored_and_obeyed(server: Running, path: str) -> None:
    server.http.patch(path, json={"action": STOP})
    restored = server.http.post(f"{path}/versions/1/restore").json()
    assert (restored["version"], restored["action"]) == (3, HOME)
    assert server.http.get(path).json() == restored
    assert server.hub.gallery.current.actions["home"].type == "home"
    error(server.http.post(f"{path}/versions/4/restore"), 404, "not_found")
    error(server.http.post(f"{path}/versions/0/restore"), 422, "invalid")
    error(server.http.post(f"{path}/versions/{2**40}/restore"), 422, "invalid")
    error(server.http.get("/api/gestures/nothing/versions"), 404, "not_found")
    error(server.http.post("/api/gestures/nothing/versions/1/restore"), 404, "not_found")


def test_of_two_changes_that_meet_the_second_is_refused(server: Running, path: str) -> None:
    first = server.http.patch(path, json={"action": STOP, "version": 1})
    assert first.json()["version"] == 2
    message = error(
        server.http.patch(path, json={"action": PROGRAM, "version": 1}), 409, "changed_meanwhile"
    )
    assert message.startswith("the action of home was changed meanwhile: its newest version is 2")
    assert server.http.get(path).json()["action"] == STOP
    assert server.http.patch(path, json={"name": "house", "version": 2}).status_code == 200


@pytest.mark.parametrize(
    "body", [{"version": 1}, {"name": "x", "version": "1"}, {"name": "x", "version": True}]
)
def test_a_version_alone_or_of_another_kind_is_refused(
    server: Running, path: str, body: dict[str, Any]
) -> None:
    error(server.http.patch(path, json=body), 422, "invalid")


class Checker:
    """Answers dry runs as the process beside a node does; can be told to wait."""

    def __init__(self, node: StandIn) -> None:
        self.asked: list[DryRunRequest] = []
        self.report = DryRunReport(
            ok=False,
            duration_s=1.5,
            problems=(
                DryRunProblem(step=2, time_s=1.0, kind="joint_limit", message="joint 5 is far"),
            ),
            path=DryRunPath(times=(0.0,), joints=((0.0,) * 6,), tool=((0.5, 0.0, 0.7),)),
        )
        self.go_on = threading.Event()
        self.go_on.set()
        self._key = key(node.robot, "dry_run")
        self._session = open_session(node.endpoint, listen=False)
        self._queryable = self._session.declare_queryable(self._key, self._answer)

    def _answer(self, query: Any) -> None:
        self.asked.append(DryRunRequest.model_validate_json(query.payload.to_bytes()))
        self.go_on.wait(20)
        query.reply(self._key, self.report.encode())
        query.drop()

    def close(self) -> None:
        self.go_on.set()
        self._session.close()


@pytest.fixture
def checker(server: Running, node: StandIn) -> Iterator[Checker]:
    wait_for(lambda: server.hub.robot.online, "the robot")
    made = Checker(node)
    yield made
    made.close()


VIEW = "0123456789abcdef"


def check(server: Running, **body: Any) -> Any:
    return server.http.post("/api/robots/puma/dry-run", json=body)


def test_a_dry_run_says_what_the_robot_says(server: Running, checker: Checker) -> None:
    wait_for(lambda: check(server, action=PROGRAM).status_code == 200, "an answer")
    checker.asked.clear()
    answer = check(server, action=PROGRAM, **{"from": "home"})
    assert answer.json() == {
        "ok": False,
        "duration_s": 1.5,
        "problems": [
            {"step": 2, "time_s": 1.0, "kind": "joint_limit", "message": "joint 5 is far"}
        ],
        "path": {
            "times": [0.0],
            "joints": [[0.0] * 6],
            "tool": [[0.5, 0.0, 0.7]],
            "base": [],
        },
    }
    (asked,) = checker.asked
    assert asked.start == "home"
    assert asked.action.type == "sequence"
    check(server, action=HOME)
    assert checker.asked[-1].start == "current"


def test_one_is_checked_at_a_time_and_the_server_goes_on(server: Running, checker: Checker) -> None:
    wait_for(lambda: check(server, action=HOME).status_code == 200, "an answer")
    checker.asked.clear()
    checker.go_on.clear()
    answers: list[Any] = []
    thread = threading.Thread(target=lambda: answers.append(check(server, action=HOME)))
    thread.start()
    wait_for(lambda: checker.asked, "the first to be asked")
    error(check(server, action=HOME), 429, "busy")
    assert server.http.get("/api/health").json()["status"] == "ok"
    checker.go_on.set()
    thread.join(20)
    assert answers[0].status_code == 200


@pytest.mark.parametrize(
    ("code", "status"),
    [("busy", 429), ("unknown_pose", 422), ("robot_unavailable", 503), ("internal", 503)],
)
def test_why_nothing_was_checked_is_an_error(
    server: Running, checker: Checker, code: str, status: int
) -> None:
    wait_for(lambda: check(server, action=HOME).status_code == 200, "an answer")
    checker.report = DryRunReport(code=code, reason="because")
    expected = "robot_unavailable" if code == "internal" else code
    assert error(check(server, action=HOME), status, expected) == "because"


@pytest.mark.parametrize(
    ("body", "code"),
    [
        ({}, "invalid"),
        ({"from": "home"}, "invalid"),
        ({"action": {"type": "dance"}}, "bad_action"),
        ({"action": {"type": "wait", "duration": 1}}, "bad_action"),
        ({"action": HOME, "from": 3}, "invalid"),
        ({"action": HOME, "from": "x" * 41}, "invalid"),
        ({"action": HOME, "start": "home"}, "invalid"),
        ({"action": HOME, "view": "short"}, "invalid"),
        ({"action": HOME, "view": "no/slashes/in/there/please"}, "invalid"),
        ({"action": HOME, "view": 5}, "invalid"),
        ({"action": HOME, "view": VIEW, "still": "yes"}, "invalid"),
    ],
)
def test_bad_questions_are_refused(lasting: Running, body: dict[str, Any], code: str) -> None:
    error(check(lasting, **body), 422, code)


def test_without_anybody_to_answer_it_is_503(server: Running) -> None:
    wait_for(lambda: server.hub.robot.online, "the robot")
    error(check(server, action=HOME), 503, "robot_unavailable")
    error(server.http.post("/api/robots/other/dry-run", json={"action": HOME}), 404, "not_found")


def test_without_a_3d_view_the_answer_is_the_same_and_nothing_is_kept(
    server: Running, checker: Checker
) -> None:
    wait_for(lambda: check(server, action=HOME).status_code == 200, "an answer")
    plain = check(server, action=HOME).json()
    assert check(server, action=HOME, view=VIEW, still=True).json() == plain
    path = "/api/robots/puma/dry-run/"
    assert server.http.delete(path + VIEW).status_code == 204
    error(server.http.delete(path + "short"), 422, "invalid")
    error(server.http.delete(f"/api/robots/other/dry-run/{VIEW}"), 404, "not_found")
