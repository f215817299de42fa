"""A whole system for fault injection: server, node, observer, a hand that jogs at full speed."""

import contextlib
import itertools
import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple, Self

import cv2
import psutil

from app.gestures.synthetic import FPS, Step, SyntheticOperator
from app.link.actions import JogJoint
from benchmarks.node_process import BenchNode
from benchmarks.observer import FULL_SPEED, Observer
from tests.e2e.running import TOKEN, Server, start_server, stop_server

JOGS = {1: "left", -1: "right"}
"""Gesture that jogs joint 1, by direction."""


class Clip(NamedTuple):
    """JPEGs of one showing of a gesture."""

    before: list[bytes]
    """No hand for a second, then it comes into view."""
    held: list[bytes]
    """Two seconds of the hand at rest, for showing over and over."""

    def shown(self) -> Iterator[bytes]:
        """Without end."""
        return itertools.chain(self.before, self.keep())

    def keep(self) -> Iterator[bytes]:
        """The hand at rest, without end."""
        return itertools.cycle(self.held)


@cache
def clip(gesture: str) -> Clip:
    """The drawn hand; every frame has noise and tremor of its own, as a webcam's has."""
    operator = SyntheticOperator((Step(None, 1.0), Step(gesture, 2.0)))
    frames = [
        cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tobytes()
        for frame in operator.frames()
    ]
    at_rest = round(operator.captions[0].start_s * FPS)
    return Clip(frames[:at_rest], frames[at_rest:])


class Rig:
    """A server whose gestures ``left`` and ``right`` jog joint 1 at full speed.

    Args:
        folder: For data and log; what is there stays in force over restarts.
        separate: The node runs by itself (``farhand robot``), not as the gateway's child.
        stderr: File descriptor for the server's log; a file in ``folder`` unless given.
    """

    def __init__(self, folder: Path, *, separate: bool = False, stderr: int | None = None) -> None:
        self._folder = folder
        self._stderr = stderr
        self._node = BenchNode(cameras=True) if separate else None
        try:
            self.server = self._start_server()
            self.observer = self._observe()
            with self.server.api() as api:
                ids = {each["name"]: each["id"] for each in api.get("/api/gestures").json()}
                for direction, name in JOGS.items():
                    action = JogJoint(joint=1, velocity=direction * FULL_SPEED)
                    answer = api.patch(
                        f"/api/gestures/{ids[name]}", json={"action": action.model_dump()}
                    )
                    answer.raise_for_status()
        except BaseException:
            if self._node is not None:
                self._node.__exit__()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.observer.__exit__()
        stop_server(self.server)
        if self._node is not None:
            self._node.__exit__()

    @property
    def separate(self) -> bool:
        """Whether the node outlives the gateway."""
        return self._node is not None

    @property
    def url(self) -> str:
        """Of the server."""
        return self.server.url

    def next_gesture(self) -> str:
        """What to show to move towards the middle of the joint's range."""
        return JOGS[self.observer.direction()]

    def signal_gateway(self, number: int) -> None:
        """Send a signal to the gateway alone."""
        os.kill(self.server.process.pid, number)

    def restart_gateway(self) -> None:
        """Start a gateway in place of the one that was killed, and watch its node."""
        self.server.process.wait()
        assert self.server.process.stdout is not None
        self.server.process.stdout.close()
        self.server = self._start_server()
        if not self.separate:
            self.observer.__exit__()
            self.observer = self._observe()

    def kill_everything(self) -> None:
        """SIGKILL the gateway, the node and its camera process."""
        gateway = psutil.Process(self.server.process.pid)
        for process in [gateway, *gateway.children(recursive=True)]:
            with contextlib.suppress(psutil.NoSuchProcess):
                process.kill()

    def _start_server(self) -> Server:
        if self._node is None:
            return start_server(self._folder, stderr=self._stderr)
        return start_server(
            self._folder, "--robot-endpoint", self._node.endpoint, stderr=self._stderr
        )

    def _observe(self) -> Observer:
        return Observer(self.server.endpoint() if self._node is None else self._node.endpoint)


__all__ = ["JOGS", "TOKEN", "Clip", "Rig", "clip"]
