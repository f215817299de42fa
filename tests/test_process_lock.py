"""A lock that ends with its process, and is no other process's meanwhile."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from app import process_lock
from app.errors import CannotStart
from app.process_lock import ProcessLock

ROOT = Path(__file__).parents[1]
HOLDER = """
import os, subprocess, sys
from pathlib import Path
from app.process_lock import ProcessLock
lock = ProcessLock(Path(sys.argv[1]), "the box", "wait")
if "fork" in sys.argv:
    child = os.fork()
    if child == 0:
        sys.stdin.close()
        os.execvp("sleep", ["sleep", "60"]) if "exec" in sys.argv else __import__("time").sleep(60)
    print(child)
if "spawn" in sys.argv:
    print(subprocess.Popen(["sleep", "60"], close_fds="keep" not in sys.argv).pid)
print("held", flush=True)
sys.stdin.read()
"""


@contextmanager
def holder(path: Path, *how: str) -> Iterator[tuple[subprocess.Popen[str], list[int]]]:
    """Another process that holds the lock; and the children that it has made."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(path), *how],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )
    assert process.stdout is not None
    children = []
    while (line := process.stdout.readline().strip()) != "held":
        assert line, "the holder ended"
        children.append(int(line))
    try:
        yield process, children
    finally:
        process.kill()
        for child in children:
            os.kill(child, signal.SIGKILL)
        process.stdout.close()
        if process.stdin is not None:
            process.stdin.close()
        process.wait()


def take(path: Path, wait_s: float = 0.0) -> ProcessLock:
    return ProcessLock(path, "the box", "wait for it", wait_s)


def test_the_second_is_refused_and_told_who_has_it(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    with holder(path) as (process, _):
        with pytest.raises(CannotStart) as caught:
            take(path)
        since = r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d[+-]\d\d:\d\d"
        pattern = rf"the box is in use by process {process.pid} since {since}; wait for it"
        assert re.fullmatch(pattern, caught.value.message)
        assert caught.value.detail == {"path": str(path), "pid": process.pid}
    assert path.stat().st_mode & 0o777 == 0o600


def test_it_holds_while_its_process_is_stopped_and_ends_when_it_is_killed(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    with holder(path) as (process, _):
        process.send_signal(signal.SIGSTOP)
        with pytest.raises(CannotStart, match=f"process {process.pid} "):
            take(path)
        process.kill()
        process.wait()
        take(path).close()


@pytest.mark.parametrize("how", [("fork",), ("fork", "exec"), ("spawn",), ("spawn", "keep")])
def test_children_that_outlive_their_parent_do_not_have_it(
    tmp_path: Path, how: tuple[str, ...]
) -> None:
    path = tmp_path / "lock"
    with holder(path, *how) as (process, children):
        with pytest.raises(CannotStart):
            take(path)
        process.kill()
        process.wait()
        os.kill(children[0], 0)  # lives
        # A forked child lets go as soon as it runs.
        take(path, wait_s=20).close()


def test_one_that_is_just_ending_is_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    with holder(path) as (process, _):
        assert process.stdin is not None
        process.stdin.close()
        take(path, wait_s=20).close()


def test_a_lock_of_this_process_counts_too_and_closing_twice_does_no_harm(tmp_path: Path) -> None:
    lock = take(tmp_path / "lock")
    with pytest.raises(CannotStart, match=f"in use by process {os.getpid()} since"):
        take(tmp_path / "lock")
    lock.close()
    lock.close()
    take(tmp_path / "lock").close()


def test_one_of_another_machine_is_named(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    lock = take(path)
    path.write_text(json.dumps({"pid": 7, "host": "elsewhere", "since": "today"}))
    with pytest.raises(CannotStart, match="in use by process 7 on elsewhere since today"):
        take(path)
    path.write_text("[nonsense")
    with pytest.raises(CannotStart, match="in use by another process; wait"):
        take(path)
    lock.close()


def test_a_place_that_cannot_be_used_is_one_clear_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(CannotStart, match="cannot be opened"):
        take(tmp_path / "folder")
    (tmp_path / "target").touch()
    (tmp_path / "link").symlink_to(tmp_path / "target")
    with pytest.raises(CannotStart, match="it is a link"):
        take(tmp_path / "link")

    def no_locks(handle: int, how: int) -> None:
        raise OSError(37, "No locks available")

    # What a file system without locks answers, as NFS without its lock service does.
    monkeypatch.setattr(process_lock.fcntl, "flock", no_locks)
    with pytest.raises(CannotStart, match=r"cannot be locked \(No locks available\).*local disk"):
        take(tmp_path / "lock")
