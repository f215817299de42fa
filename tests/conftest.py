"""Which tests may run beside one another, and a disk that can be filled."""

import subprocess
from collections.abc import Iterator
from pathlib import Path
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


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 2 MiB; skips where none may be mounted."""
    folder = tmp_path / "disk"
    folder.mkdir()
    try:
        mount = ["mount", "-t", "tmpfs", "-o", "size=2m,mode=700", "tmpfs", str(folder)]
        subprocess.run(mount, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no file system may be mounted here")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)


def fill(disk: Path, leave: int = 0) -> Path:
    """Fill a small disk but for ``leave`` bytes.

    Returns:
        The file to delete to have space again.
    """
    path = disk / "filler"
    with path.open("wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(4096))
        except OSError:
            file.truncate(max(0, path.stat().st_size - leave))
    return path
