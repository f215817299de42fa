"""A robot node for a benchmark: its own process on a private socket, and a way to drive it."""

import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Self

from app.link.actions import Action
from app.link.gateway_end import GatewayEnd
from app.link.messages import Command, LeaseRequest, State
from app.link.session import socket_endpoint
from benchmarks.observer import ROBOT

_SHOWN_S = 60.0


class BenchNode:
    """Starts ``farhand robot`` as a process; used with ``with``.

    Args:
        cameras: Whether the camera process runs, too.
        endpoint: What it listens on; a socket of its own unless given.
    """

    def __init__(self, *, cameras: bool, endpoint: str | None = None) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="fh-"))
        self.endpoint = endpoint or socket_endpoint(self._folder / "n.sock")
        self._log = (self._folder / "log").open("wb")
        command = [sys.executable, "-m", "app.robot.node", "--endpoint", self.endpoint]
        self._process = subprocess.Popen(
            command if cameras else [*command, "--no-cameras"],
            stdout=self._log,
            stderr=self._log,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.wait(10)
        self._log.close()
        shutil.rmtree(self._folder, ignore_errors=True)


class Driver:
    """Holds the lease and sends thirty commands a second.

    Args:
        endpoint: Of the node.
        holder: Who drives.
    """

    def __init__(self, endpoint: str, holder: str) -> None:
        self.holder = holder
        self._epoch = 0
        self._sequence = 0
        self.end = GatewayEnd(ROBOT, endpoint, timeout=30)
        while self.end.state is None:
            time.sleep(0.01)

    @property
    def state(self) -> State:
        """The newest state."""
        state = self.end.state
        assert state is not None
        return state

    def ready(self) -> None:
        """Take control, arm, and show no gesture until the robot is ready."""
        while True:
            reply = self.end.ask(LeaseRequest(kind="take", holder=self.holder), timeout=5)
            if reply.granted:
                break
            time.sleep(0.05)
        self._epoch = reply.epoch or 0
        request = LeaseRequest(kind="arm", holder=self.holder, epoch=self._epoch)
        reply = self.end.ask(request, timeout=5)
        if not reply.granted:
            raise RuntimeError(reply.reason)
        self.show(None, 0, lambda: self.state.mode == "armed")

    def show(
        self,
        action: Action | None,
        hold: int,
        until: Callable[[], bool],
        sent: Callable[[int], None] = lambda tick: None,
    ) -> None:
        """Send ``action`` until a condition holds; ``sent`` is told each command's tick after.

        Raises:
            TimeoutError: it did not hold within a minute.
        """
        give_up = time.monotonic() + _SHOWN_S
        while not until():
            if time.monotonic() > give_up:
                raise TimeoutError(f"shown for {_SHOWN_S:g} s in vain: {self.state}")
            self._sequence += 1
            state = self.state
            self.end.send(
                Command(
                    epoch=self._epoch,
                    sequence=self._sequence,
                    tick=state.tick,
                    frame=self._sequence,
                    hold=hold,
                    gesture=None if action is None else action.type,
                    action=action,
                )
            )
            sent(state.tick)
            time.sleep(1 / 30)


def free_port() -> int:
    """A TCP port of loopback on which nobody listens now."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        port: int = listener.getsockname()[1]
        return port
