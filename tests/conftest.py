"""Which tests may run beside one another."""

from pathlib import Path

import pytest

TESTS = Path(__file__).parent
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


def pytest_itemcollected(item: pytest.Item) -> None:
    name = item.path.relative_to(TESTS).as_posix()
    live = name in LIVE or name.partition("/")[0] in LIVE
    # Other files each stay whole, for what their tests share.
    item.add_marker(pytest.mark.xdist_group("live" if live else name))
