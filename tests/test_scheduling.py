"""The order in which tests are handed out."""

from itertools import groupby
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.scheduling import LIVE, SECONDS, LongestFirst, is_live, keeps_real_time, scope_of

FOLDER = Path(__file__).parent


class Worker:
    """A worker that keeps what it is given."""

    def __init__(self, name: str, tests: list[str]) -> None:
        self.gateway = SimpleNamespace(id=name)
        self.shutting_down = False
        self._tests = tests
        self.given: list[str] = []

    def send_runtest_some(self, indices: list[int]) -> None:
        self.given += [self._tests[index] for index in indices]

    def shutdown(self) -> None:
        self.shutting_down = True


def handed_out(tests: list[str], workers: int) -> list[list[str]]:
    """What each worker is given, test after test; all take the same time for one."""
    config: Any = SimpleNamespace(
        getvalue=lambda name: {"tx": [f"{workers}*popen"]}[name],
        option=SimpleNamespace(loadscopereorder=True, debug=False),
    )
    scheduling = LongestFirst(config)
    nodes: list[Any] = [Worker(f"gw{number}", tests) for number in range(workers)]
    for node in nodes:
        scheduling.add_node(node)
        scheduling.add_node_collection(node, tests)
    scheduling.schedule()
    done = [0] * workers
    while any(done[n] < len(node.given) for n, node in enumerate(nodes)):
        for n, node in enumerate(nodes):
            if done[n] < len(node.given):
                scheduling.mark_test_complete(node, tests.index(node.given[done[n]]))
                done[n] += 1
    return [node.given for node in nodes]


def some(*files: tuple[str, int]) -> list[str]:
    return [f"tests/{name}::test_{number}" for name, count in files for number in range(count)]


MANY = some(
    ("pipeline/test_mask.py", 30),
    (LIVE[0], 2),
    ("test_pick_and_place.py", 1),
    ("gateway/test_auth.py", 40),
    (LIVE[-1], 9),
    ("link/test_ends.py", 5),
    ("robot/test_lease.py", 9),
)


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_every_test_is_handed_out_once(workers: int) -> None:
    given = handed_out(MANY, workers)
    assert sorted(test for each in given for test in each) == sorted(MANY)


def test_the_longest_go_first_and_files_stay_whole() -> None:
    first, second = (
        [scope for scope, _ in groupby(each, scope_of)] for each in handed_out(MANY, 2)
    )
    assert {first[0], second[0]} == {"test_pick_and_place.py", "gateway/test_auth.py"}
    assert len(first + second) == len(set(first + second)) == len({scope_of(one) for one in MANY})


def test_what_drives_a_node_is_marked_and_nothing_else(request: pytest.FixtureRequest) -> None:
    assert is_live("tests/e2e/test_drive.py::test_one[a/b]")
    assert not is_live("tests/robot/test_controller.py::test_one")
    items = request.session.items
    assert all(
        (item.get_closest_marker("live") is not None) == is_live(item.nodeid) for item in items
    )


def test_a_folder_whose_files_share_something_stays_whole() -> None:
    assert scope_of("tests/e2e/units/test_held.py::test_one") == "e2e/units"
    assert scope_of("tests/e2e/test_remote.py::test_one") == "e2e/test_remote.py"


def test_what_only_computes_keeps_no_real_time() -> None:
    assert keeps_real_time("tests/e2e/test_drive.py::test_one[a/b]")
    assert keeps_real_time("tests/robot/test_node.py::test_one")
    assert not keeps_real_time("tests/robot/test_controller.py::test_one")
    assert not keeps_real_time("tests/pipeline/test_mask.py::test_one[e2e/]")


def test_what_is_named_is_there() -> None:
    for name in (*LIVE, *SECONDS):
        assert (FOLDER / name).is_file(), name


def test_whatever_drives_a_real_node_is_live() -> None:
    """Who adds such a file is told so here."""
    signs = (
        "#btn-arm",
        "start_driving(",
        "take_and_arm(page",
        "benchmarks.rig import",
        "class Remote",
        "import ROOT, Remote",
    )
    for path in FOLDER.rglob("test_*.py"):
        name = path.relative_to(FOLDER).as_posix()
        if name not in LIVE and path != Path(__file__):
            assert not any(sign in path.read_text() for sign in signs), name
