"""The supervisor, with small real processes."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from app.gateway import node_process as module
from app.gateway.node_process import NodeProcess, describe_exit, node_environment
from tests.disks import freezable
from tests.gateway.running import wait_for


class Word:
    """When the child last spoke."""

    def __init__(self) -> None:
        self.at: float | None = None

    def __call__(self) -> float | None:
        return self.at


def supervise(script: str, word: Word, *, hung_s: float = 0.5, start_s: float = 30) -> NodeProcess:
    process = NodeProcess(
        [sys.executable, "-c", script], last_word=word, hung_s=hung_s, start_s=start_s
    )
    process.start()
    return process


def test_a_crash_is_told_and_mended() -> None:
    word = Word()
    process = supervise("raise SystemExit(3)", word)
    try:
        wait_for(lambda: process.restarts >= 1, "a restart")
        wait_for(lambda: process.fault == "robot node crashed (exit code 3), starting again")
        wait_for(lambda: process.restarts >= 2, "another restart")
    finally:
        process.close()
    assert process.pid is None


def test_what_to_add_is_asked_at_every_start(tmp_path: Path) -> None:
    log = tmp_path / "log"
    script = f"import sys; print(*sys.argv[1:], file=open({str(log)!r}, 'a')); sys.exit(1)"
    added = iter(range(1000))
    process = NodeProcess(
        [sys.executable, "-c", script],
        last_word=Word(),
        hung_s=1,
        start_s=30,
        more=lambda: [f"--stopped={next(added)}"],
    )
    process.start()
    try:
        wait_for(lambda: process.restarts >= 2, "two starts")
    finally:
        process.close()
    assert log.read_text().splitlines()[:2] == ["--stopped=0", "--stopped=1"]


def test_one_that_waits_for_a_frozen_disk_does_not_hold_up_who_killed_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "KILL_WAIT_S", 0.2)
    with freezable(tmp_path) as disk:
        disk.freeze()
        name = str(disk.folder / "made")
        process = supervise(f"open({name!r}, 'w')", Word(), start_s=1.0)
        try:
            wait_for(lambda: process.restarts >= 1, "another start")
            assert process.fault is not None and "did not answer" in process.fault
            process.close()
        finally:
            disk.thaw()
            process.close()
        killed = process._stuck
        assert killed
        wait_for(lambda: all(each.poll() is not None for each in killed), "their end")


def test_a_signal_is_named() -> None:
    assert describe_exit(-9) == "signal 9"
    assert describe_exit(1) == "exit code 1"


def test_a_child_that_stops_speaking_is_killed_and_started_again() -> None:
    word = Word()
    process = supervise("import time; time.sleep(60)", word)
    try:
        first = wait_for(lambda: process.pid, "the child")
        assert process.fault == "the robot node is starting"
        word.at = time.monotonic()
        wait_for(lambda: process.fault is None, "the fault to be over")
        wait_for(lambda: process.pid not in (None, first), "another child")
        assert process.fault.startswith("robot node hung (no state for ")
        assert not psutil.pid_exists(first)
    finally:
        process.close()


def test_a_gateway_that_was_stopped_itself_does_not_blame_the_node() -> None:
    """SIGSTOP of the supervisor, SIGCONT: what the node said meanwhile is read only now."""
    script = (
        "import sys, threading, time\n"
        "from app.gateway.node_process import NodeProcess\n"
        "spoken = time.monotonic()\n"
        "words = threading.Event()\n"
        "def last_word():\n"
        "    return time.monotonic() if words.is_set() else spoken + 0.01\n"
        "child = [sys.executable, '-c', 'import time; time.sleep(60)']\n"
        "process = NodeProcess(child, last_word=last_word, hung_s=3.0, start_s=30)\n"
        "process.start()\n"
        "spoken = time.monotonic() + 1\n"
        "print('runs', flush=True)\n"
        "sys.stdin.readline()\n"
        "time.sleep(0.3)\n"  # the supervisor is first to run after the pause
        "words.set()\n"
        "time.sleep(0.3)\n"
        "print(process.restarts, flush=True)\n"
        "process.close()\n"
    )
    gateway = subprocess.Popen(
        [sys.executable, "-c", script],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=node_environment(),
    )
    with gateway:
        assert gateway.stdin is not None
        assert gateway.stdout is not None
        assert gateway.stdout.readline() == "runs\n"
        gateway.send_signal(signal.SIGSTOP)
        time.sleep(4.5)
        gateway.send_signal(signal.SIGCONT)
        print(file=gateway.stdin, flush=True)
        assert gateway.stdout.readline() == "0\n"


def test_a_child_that_never_speaks_is_started_again() -> None:
    process = supervise("import time; time.sleep(60)", Word(), start_s=0.3)
    try:
        wait_for(lambda: process.restarts >= 1, "a restart")
        assert process.fault == (
            "robot node did not answer within 0.3 s of its start, starting again"
        )
    finally:
        process.close()


def test_a_child_that_does_not_end_is_killed_with_all_it_started(tmp_path: Path) -> None:
    script = (
        "import signal, subprocess, sys, time, pathlib; signal.signal(signal.SIGTERM, lambda *_: 0)"
        "\nchild = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(60)'])"
        f"\npathlib.Path({str(tmp_path / 'pid')!r}).write_text(f'{{child.pid}} ')"
        "\nwhile True: time.sleep(1)"
    )
    process = supervise(script, Word())
    path = tmp_path / "pid"
    wait_for(lambda: path.exists() and path.read_text().endswith(" "), "the grandchild")
    grandchild = int(path.read_text())
    started = time.monotonic()
    process.close()
    assert time.monotonic() - started < 20
    wait_for(lambda: not psutil.pid_exists(grandchild), "the grandchild to be gone")


def test_a_program_that_is_missing_is_told() -> None:
    process = NodeProcess(["/nonexistent/node"], last_word=Word(), hung_s=1, start_s=1)
    process.start()
    try:
        wait_for(lambda: "cannot be started" in (process.fault or ""), "the fault")
    finally:
        process.close()


def test_the_child_gets_no_secrets(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FARHAND_TOKEN", "secret")
    monkeypatch.setenv("PYTHONPATH", "/elsewhere")
    environment = node_environment()
    assert "FARHAND_TOKEN" not in environment
    first, *others = environment["PYTHONPATH"].split(os.pathsep)
    assert (Path(first) / "app" / "gateway").is_dir()
    assert others == ["/elsewhere"]
