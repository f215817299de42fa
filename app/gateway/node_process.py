"""Starts the robot node and keeps it running: a crash or a hang is noticed, told and mended.

The child is spawned, never forked (Zenoh's threads would not survive that), and leads a process
group of its own, so that Ctrl-C reaches the gateway alone and the gateway ends it in order. It
watches for its parent's end itself.
"""

import contextlib
import logging
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from app import logs

log = logging.getLogger(__name__)

BACK_OFF_S = (0.2, 0.5, 1.0, 2.0, 5.0)
"""Waits before the first, second, ... start in a row; the last one repeats."""
HEALTHY_S = 10.0
"""A node that ran this long starts again without having its crash held against it."""
CHECK_S = 0.05
PAUSED_S = 0.5
"""A check that comes so late was not made in time: the gateway itself was stopped or starved, and
may not have read yet what the node said meanwhile."""
STOP_WAIT_S = 1.5
"""After asking the node to end, and before killing it."""
KILL_WAIT_S = 3.0
"""One that waits inside the kernel, for a frozen disk, ends only when the disk answers."""
_SECRETS = ("FARHAND_TOKEN",)


def node_command(robot: str, endpoint: str, latch: Path, profile: str) -> list[str]:
    """The command line of a node."""
    return [
        sys.executable, "-m", "app.robot.node", "--id", robot, "--endpoint", endpoint,
        "--latch", str(latch), "--profile", profile, "--parent", str(os.getpid()),
    ]  # fmt: skip


def node_environment() -> dict[str, str]:
    """Our environment without its secrets, in which ``-m app`` is this very package."""
    environment = {name: value for name, value in os.environ.items() if name not in _SECRETS}
    root = str(Path(__file__).parents[2])
    paths = [root, *filter(None, environment.get("PYTHONPATH", "").split(os.pathsep))]
    environment["PYTHONPATH"] = os.pathsep.join(paths)
    return environment


class NodeProcess:
    """Supervises one child process from a thread of its own.

    Args:
        command: What to run.
        last_word: ``time.monotonic()`` of the newest state from the robot, or None.
        hung_s: No state for this long: killed and started again.
        start_s: Time from the start to the first state.
        more: What to add to the command, asked at every start.
    """

    def __init__(
        self,
        command: Sequence[str],
        *,
        last_word: Callable[[], float | None],
        hung_s: float,
        start_s: float,
        more: Callable[[], Sequence[str]] = lambda: (),
    ) -> None:
        self._command = list(command)
        self._more = more
        self._last_word = last_word
        self._hung_s = hung_s
        self._start_s = start_s
        self._ending = threading.Event()
        self._process: subprocess.Popen[bytes] | None = None
        self._stuck: list[subprocess.Popen[bytes]] = []
        """Killed, and not gone yet."""
        self._started_at = 0.0
        self._failures = 0
        self._fault: str | None = "the robot node is starting"
        self.restarts = 0
        self._thread = threading.Thread(target=self._run, name="node-supervisor", daemon=True)

    @property
    def fault(self) -> str | None:
        """What is wrong, in plain words; None while the node speaks."""
        if self._fault is not None and self._has_spoken():
            return None
        return self._fault

    @property
    def pid(self) -> int | None:
        """Process id of the child, if one runs."""
        process = self._process
        return process.pid if process is not None and process.poll() is None else None

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def close(self) -> None:
        """End the child, gently first, and return when it is gone."""
        self._ending.set()
        if self._thread.is_alive():
            self._thread.join()

    def _has_spoken(self) -> bool:
        """Whether the child that runs now has sent a state."""
        word = self._last_word()
        return self._process is not None and word is not None and word > self._started_at

    def _run(self) -> None:
        try:
            while not self._ending.is_set():
                self._spawn()
                trouble = self._watch()
                if trouble is None:
                    return
                if time.monotonic() - self._started_at > HEALTHY_S:
                    self._failures = 0
                wait = BACK_OFF_S[min(self._failures, len(BACK_OFF_S) - 1)]
                self._failures += 1
                self.restarts += 1
                self._fault = f"{trouble}, starting again"
                log.error("%s in %g s", self._fault, wait)
                self._ending.wait(wait)
        finally:
            self._end()

    def _spawn(self) -> None:
        self._stuck = [process for process in self._stuck if process.poll() is None]
        try:
            self._process = subprocess.Popen(
                [*self._command, *self._more()],
                stdin=subprocess.DEVNULL,
                # Standard output is for the link that `farhand serve` prints.
                stdout=logs.standard_error(),
                stderr=logs.standard_error(),
                env=node_environment(),
                start_new_session=True,
            )
        except OSError as error:
            self._process = None
            self._fault = f"the robot node cannot be started: {error}"
        self._started_at = time.monotonic()

    def _watch(self) -> str | None:
        """Wait until the child has to be started again, and say why; None when we end."""
        listening_since = checked = time.monotonic()
        while not self._ending.wait(CHECK_S):
            now = time.monotonic()
            if now - checked > PAUSED_S:
                log.warning("the gateway itself was held up for %.1f s", now - checked)
                listening_since = now
            checked = now
            process = self._process
            if process is None:
                return self._fault or "the robot node cannot be started"
            code = process.poll()
            if code is not None:
                # What it left behind, such as its camera process, is of its process group.
                self._signal(signal.SIGKILL)
                return f"robot node crashed ({describe_exit(code)})"
            if self._has_spoken():
                self._fault = None
                silence = now - max(self._last_word() or now, listening_since)
                if silence > self._hung_s:
                    self._kill()
                    return f"robot node hung (no state for {silence:.1f} s)"
            elif now - self._started_at > self._start_s:
                self._kill()
                return f"robot node did not answer within {self._start_s:g} s of its start"
        return None

    def _kill(self) -> None:
        self._signal(signal.SIGKILL)
        if self._process is not None:
            try:
                self._process.wait(KILL_WAIT_S)
            except subprocess.TimeoutExpired:
                log.error("the robot node was killed, but does not end: it waits for a disk")
                self._stuck.append(self._process)

    def _end(self) -> None:
        process = self._process
        if process is not None and process.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                process.terminate()
            try:
                process.wait(STOP_WAIT_S)
            except subprocess.TimeoutExpired:
                log.warning("the robot node did not end when asked to; killing it")
        self._kill()

    def _signal(self, number: int) -> None:
        """Signal the child's whole process group."""
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, number)


def describe_exit(code: int) -> str:
    """How a process ended, from :attr:`subprocess.Popen.returncode`."""
    return f"signal {-code}" if code < 0 else f"exit code {code}"
