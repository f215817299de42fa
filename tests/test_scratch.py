"""Temporary folders go with their owner, whatever it died of; nobody else's are touched."""

import os
import signal
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from app.scratch import OWNER, ScratchFolder, remove_left_behind

HOLD = """
import sys, tempfile
tempfile.tempdir = sys.argv[1]
from app.scratch import ScratchFolder
folder = ScratchFolder()
(folder.path / "link").write_text("x")
print(folder.path, flush=True)
sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_a_folder_is_private_and_goes_when_it_is_closed(here: Path) -> None:
    folder = ScratchFolder()
    assert folder.path.parent == here
    assert stat.S_IMODE(folder.path.stat().st_mode) == 0o700
    assert remove_left_behind() == 0
    assert folder.path.is_dir()
    folder.close()
    folder.close()
    assert list(here.iterdir()) == []


def test_a_killed_process_leaves_nothing_for_long(here: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(here)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with process:
        assert process.stdout is not None
        left = Path(process.stdout.readline().strip())
        assert remove_left_behind() == 0, "its owner lives"
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert (left / "link").exists()
    own = ScratchFolder()
    assert remove_left_behind() == 1
    assert sorted(here.iterdir()) == [own.path]
    own.close()


def test_what_is_not_of_this_kind_stays(
    here: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    (elsewhere / OWNER).touch()
    (here / "farhand-link").symlink_to(elsewhere)
    (here / "farhand-file").write_text("mine")
    for name, owner in (
        ("farhand-none", None),
        ("farhand-pipe", "pipe"),
        ("farhand-to", "link"),
        ("other", "file"),
    ):
        folder = here / name
        folder.mkdir()
        if owner == "pipe":
            os.mkfifo(folder / OWNER)
        elif owner == "link":
            (folder / OWNER).symlink_to(elsewhere / OWNER)
        elif owner == "file":
            (folder / OWNER).touch()
    before = sorted(here.iterdir())
    assert remove_left_behind() == 0
    assert sorted(here.iterdir()) == before
    assert (elsewhere / OWNER).exists()
    assert remove_left_behind(here / "missing") == 0
