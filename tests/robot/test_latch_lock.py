"""A stop latch is one node's alone, and a disk that fails does not keep that one from starting."""

import logging
from pathlib import Path

import pytest

from app.errors import CannotStart
from app.robot import latch_lock
from app.robot.latch_lock import lock_latch
from tests.conftest import fill
from tests.disks import freezable, read_only


@pytest.fixture(autouse=True)
def brief(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody else ends meanwhile."""
    monkeypatch.setattr(latch_lock, "HANDOVER_S", 0.1)
    monkeypatch.setattr(latch_lock, "START_S", 1.0)


def test_a_second_node_is_refused_until_the_first_is_gone(tmp_path: Path) -> None:
    latch = tmp_path / "new" / "latch"
    first = lock_latch(latch)
    assert first is not None
    with pytest.raises(CannotStart, match=f"the stop latch {latch} is in use by process"):
        lock_latch(latch)
    first.close()
    again = lock_latch(latch)
    assert again is not None
    again.close()


def test_on_a_full_disk_it_is_had_all_the_same(small_disk: Path) -> None:
    lock = lock_latch(small_disk / "latch")
    assert lock is not None
    lock.close()
    fill(small_disk)
    lock = lock_latch(small_disk / "latch")
    assert lock is not None
    with pytest.raises(CannotStart, match="in use by"):
        lock_latch(small_disk / "latch")
    lock.close()


def test_a_read_only_disk_keeps_no_node_from_starting(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with read_only(tmp_path):
        assert lock_latch(tmp_path / "latch") is None
    assert "would not be kept out" in caplog.text
    assert "Read-only file system" in caplog.text


def test_a_frozen_disk_keeps_no_node_from_starting(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING)
    with freezable(tmp_path) as disk:
        disk.freeze()
        try:
            assert lock_latch(disk.folder / "latch") is None
        finally:
            disk.thaw()
    assert "the disk does not answer" in caplog.text


def test_a_folder_that_cannot_be_made_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(CannotStart, match=r"cannot be made \(File exists\); name a file"):
        lock_latch(tmp_path / "file" / "latch")
