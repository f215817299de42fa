"""A process beside the node, started again when it dies, without making the control loop wait."""

import contextlib
import logging
import subprocess
import threading
from collections.abc import Sequence

from app import logs

log = logging.getLogger(__name__)

_CHECK_S = 0.5
_FIRST_PAUSE_S = 1.0
_LONGEST_PAUSE_S = 15.0
_STOP_S = 2.0


class Child:
    """Runs ``command`` until :meth:`close`, watched by a thread of its own.

    Args:
        command: Program and arguments.
        name: For the log.
    """

    def __init__(self, command: Sequence[str], name: str) -> None:
        self._command = list(command)
        self._name = name
        self._process: subprocess.Popen[bytes] | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @property
    def pid(self) -> int | None:
        """Process id while it runs."""
        process = self._process
        return process.pid if process is not None and process.poll() is None else None

    def close(self) -> None:
        """End the process."""
        self._closing.set()
        self._thread.join(2 * _STOP_S + 1)

    def _run(self) -> None:
        pause = _FIRST_PAUSE_S
        while not self._closing.is_set():
            try:
                self._process = subprocess.Popen(
                    self._command,
                    stdin=subprocess.DEVNULL,
                    stdout=logs.standard_error(),
                    stderr=logs.standard_error(),
                )
            except OSError as error:
                log.error("the %s cannot be started: %s", self._name, error)
                self._closing.wait(pause)
            else:
                code = None
                lived = 0.0
                while code is None and not self._closing.is_set():
                    with contextlib.suppress(subprocess.TimeoutExpired):
                        code = self._process.wait(_CHECK_S)
                    lived += _CHECK_S
                if code is None:
                    self._end(self._process)
                    return
                if lived > 30:
                    pause = _FIRST_PAUSE_S
                log.warning("the %s ended (%s), starting again in %.0f s", self._name, code, pause)
                self._closing.wait(pause)
            pause = min(2 * pause, _LONGEST_PAUSE_S)

    @staticmethod
    def _end(process: subprocess.Popen[bytes]) -> None:
        """By the thread that started it; without that one the kernel kills who gave way."""
        process.terminate()
        try:
            process.wait(_STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
