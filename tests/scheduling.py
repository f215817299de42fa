"""Which tests may run beside one another, and in what order they are handed out.

A machine of two cores has room for one thing that keeps real time and for much that only computes
or waits. So the tests with deadlines of their own go one after another through the first worker,
which begins with them; the others go through all workers, the longest files first, and give way.
"""

import os
from typing import Any

import pytest
from xdist.scheduler import LoadScopeScheduling

LIVE = (
    "e2e/test_browser_faults.py",
    "e2e/test_drive.py",
    "e2e/test_first_minutes.py",
    "e2e/test_glass.py",
    "e2e/test_keys.py",
    "e2e/test_pick_and_place.py",
    "e2e/test_slow_link.py",
    "e2e/test_stops.py",
    "e2e/test_timeline.py",
    "gateway/test_real_robot.py",
    "robot/test_dry_run.py",
    "robot/test_node.py",
    "test_faults.py",
)
"""Somebody drives a real node: a command that comes 250 ms late is none, and the arm waits."""

_IN_TIME = ("e2e/", "gateway/", "link/", "robot/test_camera.py", "test_cli.py", *LIVE)
"""Servers, nodes and browsers that are waited for, but not for ever."""

SECONDS = {
    "test_cli.py": 100,
    "gateway/test_serve.py": 60,
    "robot/test_camera.py": 55,
    "robot/test_random_commands.py": 50,
    "e2e/test_remote.py": 40,
    "test_pick_and_place.py": 40,
    "robot/test_any_order.py": 30,
    "e2e/test_people.py": 20,
    "e2e/test_programs.py": 20,
}
"""About how long a file takes, where its few tests are long ones; else half a second a test. They
are begun first, so that none is left at the end while the other workers have nothing to do."""

GIVES_WAY = 5
"""Niceness of all workers but the first. A quarter of the processor's time remains for them where
the first wants all of it: enough for everything that waits for conditions."""

TOGETHER = ("e2e/units",)
"""Folders whose files share what is made for them."""

_FIRST = "gw0"
_LIVE = "live"


def scope_of(nodeid: str) -> str:
    """Tests of one scope run one after another, on one worker.

    A file stays whole, for what its tests share, and so do some folders.
    """
    name = nodeid.partition("::")[0].removeprefix("tests/")
    folder = name.rpartition("/")[0]
    return _LIVE if name in LIVE else folder if folder in TOGETHER else name


def keeps_real_time(nodeid: str) -> bool:
    """Whether a test may fail because the machine is busy, and for no other reason."""
    return nodeid.removeprefix("tests/").startswith(_IN_TIME)


def weight(scope: str, tests: int) -> float:
    """About how long the tests of a scope take, s."""
    return SECONDS.get(scope, tests / 2)


class Apart(LoadScopeScheduling):
    """Hands out the live tests to the first worker, and else the longest scope that waits."""

    def _split_scope(self, nodeid: str) -> str:
        return scope_of(nodeid)

    def _assign_work_unit(self, node: Any) -> None:
        self.workqueue.move_to_end(self._next(node.gateway.id), last=False)
        super()._assign_work_unit(node)

    def _next(self, worker: str) -> str:
        if _LIVE in self.workqueue and (worker == _FIRST or len(self.workqueue) == 1):
            return _LIVE
        others = (scope for scope in self.workqueue if scope != _LIVE)
        return max(others, key=lambda scope: weight(scope, len(self.workqueue[scope])))


def give_way(config: pytest.Config) -> None:
    """In a worker: let the first one go before, with all that its tests start."""
    worker = getattr(config, "workerinput", {}).get("workerid", _FIRST)
    if worker != _FIRST:
        os.nice(GIVES_WAY)
