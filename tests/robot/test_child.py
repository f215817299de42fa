import logging
import os
import signal
import sys
import time

import pytest

from app.robot import child as module
from app.robot.child import Child

SLEEPER = [sys.executable, "-c", "import time; time.sleep(60)"]


def wait_for_pid(child: Child, other_than: int | None = None) -> int:
    deadline = time.monotonic() + 20
    while time.monotonic() < deadline:
        if (pid := child.pid) is not None and pid != other_than:
            return pid
        time.sleep(0.01)
    raise AssertionError("no process")


def test_it_is_started_again_when_it_dies(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(module, "_FIRST_PAUSE_S", 0.1)
    child = Child(SLEEPER, "sleeper")
    try:
        first = wait_for_pid(child)
        with caplog.at_level(logging.WARNING):
            os.kill(first, signal.SIGKILL)
            wait_for_pid(child, other_than=first)
        assert "the sleeper ended (-9), starting again" in caplog.text
    finally:
        child.close()
    assert child.pid is None


def test_a_program_that_is_not_there_is_logged_and_tried_again(
    caplog: pytest.LogCaptureFixture,
) -> None:
    child = Child(["/nowhere/program"], "camera process")
    deadline = time.monotonic() + 10
    while not caplog.text and time.monotonic() < deadline:
        time.sleep(0.01)
    child.close()
    assert "the camera process cannot be started" in caplog.text
    assert child.pid is None
