"""Which tests may run beside one another, and in what order they are handed out.

A machine of two cores has room for one thing that keeps real time, and for nothing beside it. So
``make test`` runs all tests that are not ``live`` in several workers first, the longest files
before the others, and then the live ones, one after another and alone.
"""

from typing import Any

from xdist.scheduler import LoadScopeScheduling

LIVE = (
    "e2e/test_browser_faults.py",
    "e2e/test_drive.py",
    "e2e/test_first_minutes.py",
    "e2e/test_glass.py",
    "e2e/test_keys.py",
    "e2e/test_people.py",
    "e2e/test_pick_and_place.py",
    "e2e/test_slow_link.py",
    "e2e/test_stops.py",
    "e2e/test_timeline.py",
    "gateway/test_real_robot.py",
    "gateway/test_strangers.py",
    "robot/test_camera.py",
    "robot/test_dry_run.py",
    "robot/test_node.py",
    "robot/test_node_latch.py",
    "test_doctor.py",
    "test_faults.py",
    "test_unread_log.py",
)
"""Somebody drives a real node: a command that comes 250 ms late is none, and the arm waits."""

_IN_TIME = ("e2e/", "gateway/", "link/", "test_cli.py", *LIVE)
"""Servers, nodes and browsers that are waited for, but not for ever."""

SECONDS = {
    "test_cli.py": 100,
    "gateway/test_serve.py": 60,
    "robot/sim/test_brakes.py": 50,
    "robot/test_random_commands.py": 50,
    "e2e/test_remote.py": 40,
    "test_pick_and_place.py": 40,
    "robot/test_any_order.py": 30,
    "e2e/test_programs.py": 20,
}
"""About how long a file takes, where its few tests are long ones; else half a second a test. They
are begun first, so that none is left at the end while the other workers have nothing to do."""

TOGETHER = ("e2e/units",)
"""Folders whose files share what is made for them."""


def _file(nodeid: str) -> str:
    return nodeid.partition("::")[0].removeprefix("tests/")


def is_live(nodeid: str) -> bool:
    """Whether a test drives a real node, and so must have the machine for itself."""
    return _file(nodeid) in LIVE


def scope_of(nodeid: str) -> str:
    """Tests of one scope run one after another, on one worker.

    A file stays whole, for what its tests share, and so do some folders.
    """
    name = _file(nodeid)
    folder = name.rpartition("/")[0]
    return folder if folder in TOGETHER else name


def keeps_real_time(nodeid: str) -> bool:
    """Whether a test may fail because the machine is busy, and for no other reason."""
    return nodeid.removeprefix("tests/").startswith(_IN_TIME)


def weight(scope: str, tests: int) -> float:
    """About how long the tests of a scope take, s."""
    return SECONDS.get(scope, tests / 2)


class LongestFirst(LoadScopeScheduling):
    """Hands out the longest scope that waits."""

    def _split_scope(self, nodeid: str) -> str:
        return scope_of(nodeid)

    def _assign_work_unit(self, node: Any) -> None:
        longest = max(self.workqueue, key=lambda scope: weight(scope, len(self.workqueue[scope])))
        self.workqueue.move_to_end(longest, last=False)
        super()._assign_work_unit(node)
