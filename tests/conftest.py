"""Which tests may run beside one another."""

from typing import Any

import pytest
from xdist.scheduler import LoadScopeScheduling

LIVE = (
    "e2e",
    "gateway/test_real_robot.py",
    "gateway/test_serve.py",
    "robot/test_camera.py",
    "robot/test_dry_run.py",
    "robot/test_node.py",
    "test_cli.py",
    "test_doctor.py",
    "test_faults.py",
)
"""Browsers, servers and nodes that run in real time: one after another, so that no two of them
share a machine of two cores."""


class _Apart(LoadScopeScheduling):
    def _split_scope(self, nodeid: str) -> str:
        name = nodeid.partition("::")[0].removeprefix("tests/")
        live = name in LIVE or name.partition("/")[0] in LIVE
        # Other files each stay whole, for what their tests share.
        return "live" if live else name


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadScopeScheduling:
    return _Apart(config, log)
