"""Disks that fail: frozen, read-only. Full ones are in conftest.py."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest


def _run(*command: str | Path) -> None:
    subprocess.run(command, check=True, capture_output=True)


class Disk:
    """A file system of its own that can be frozen: what writes to it waits inside the kernel."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._frozen = False

    def freeze(self) -> None:
        _run("fsfreeze", "-f", self.folder)
        self._frozen = True

    def thaw(self) -> None:
        if self._frozen:
            _run("fsfreeze", "-u", self.folder)
        self._frozen = False


@contextmanager
def freezable(folder: Path, mebibytes: int = 8) -> Iterator[Disk]:
    """An ext4 on a loop device; skips where none may be mounted."""
    image, mounted = folder / "image", folder / "mounted"
    mounted.mkdir()
    with image.open("wb") as file:
        file.truncate(mebibytes << 20)
    disk = Disk(mounted)
    try:
        _run("mkfs.ext4", "-q", "-m", "0", image)
        _run("mount", "-o", "loop", image, mounted)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no file system may be mounted here")
    try:
        try:
            disk.freeze()
            disk.thaw()
        except (OSError, subprocess.CalledProcessError):
            pytest.skip("no file system may be frozen here")
        yield disk
    finally:
        disk.thaw()
        _run("umount", "-l", mounted)


@contextmanager
def read_only(folder: Path) -> Iterator[None]:
    """The folder can only be read meanwhile, even by root; skips where that may not be done."""
    try:
        _run("mount", "--bind", folder, folder)
        _run("mount", "-o", "remount,bind,ro", folder)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no file system may be mounted here")
    try:
        yield
    finally:
        _run("umount", "-l", folder)
