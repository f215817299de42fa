"""The camera process: draws what a robot's cameras see, so that control never waits for a picture.

Started by the node as ``python -m app.robot.camera --robot ID --endpoint EP --profile PROFILE``. It
mirrors the newest State that comes over the link, draws a camera only while somebody subscribes to
it, and sends each state at most once: when states stop coming, pictures stop too, and everyone sees
from the last one's tick how old it is. It ends when its parent or the link is gone.
"""

import argparse
import logging
import os
import signal
import sys
import time
from dataclasses import dataclass
from typing import Any

import cv2
import simplejpeg
import zenoh
from pydantic import ValidationError

from app import logs
from app.errors import FarhandError, WorldError
from app.link.header import FrameHeader
from app.link.messages import State, key
from app.link.session import open_session
from app.robot.beside import Alive, NewestState, give_way
from app.robot.sim.renderer import Renderer

_log = logging.getLogger(__name__)

MAX_RATE_HZ = 30.0
"""Pictures a second of each camera, at most."""
JPEG_QUALITY = 82
NICENESS = 10
"""Control, the operator's frames and a browser beside them go first."""
IDLE_S = 0.05
"""Between two looks for viewers or for a new state."""


@dataclass
class Channel:
    """One camera's way out."""

    name: str
    publisher: zenoh.Publisher
    sequence: int = 0
    next_at: float = 0.0
    """Monotonic seconds; not before then again."""
    sent_tick: int | None = None
    """Of the last picture; None when nobody has been watching."""

    def watched(self) -> bool:
        """Whether anybody subscribes.

        Forgets what was sent when not: a new viewer gets a picture at once, even of a state that
        is old.
        """
        status: Any = self.publisher.matching_status  # typed as bool, but it is an object
        watched = bool(status.matching)
        if not watched:
            self.sent_tick = None
        return watched


class CameraProcess:
    """Draws and sends until told to stop.

    Args:
        session: Open, as a client of the node's.
        robot: The robot's id on the link.
        renderer: Draws its cameras.
    """

    def __init__(self, session: zenoh.Session, robot: str, renderer: Renderer) -> None:
        self._renderer = renderer
        self._state = NewestState()
        self._subscriber = session.declare_subscriber(
            key(robot, "state"), lambda sample: self._state.put(sample.payload.to_bytes())
        )
        self._channels = [
            Channel(
                name,
                session.declare_publisher(
                    key(robot, f"camera/{name}"),
                    congestion_control=zenoh.CongestionControl.DROP,
                    priority=zenoh.Priority.DATA_LOW,
                ),
            )
            for name in renderer.names
        ]
        self._seen = 0
        self._shown: int | None = None
        self._bad = 0

    def turn(self) -> None:
        """Wait shortly for a new state, then send each picture that is due and wanted."""
        watched = [channel for channel in self._channels if channel.watched()]
        if not watched:
            time.sleep(IDLE_S)
            return
        early = min(channel.next_at for channel in watched) - time.monotonic()
        if early > 0:
            time.sleep(early)
        self._seen, message = self._state.wait(self._seen, IDLE_S)
        state = self._decode(message) if message is not None else None
        if state is None:
            return
        for channel in watched:
            if channel.sent_tick != state.tick and channel.next_at <= time.monotonic():
                self._send(channel, state)

    def _decode(self, message: bytes) -> State | None:
        try:
            state = State.model_validate_json(message)
        except ValidationError as error:
            self._bad += 1
            if self._bad == 1:
                _log.warning("a state that cannot be read is passed over: %s", error)
            return None
        if self._shown != state.tick:
            self._renderer.update(state.joints, state.gripper, state.objects, state.base)
            self._shown = state.tick
        return state

    def _send(self, channel: Channel, state: State) -> None:
        begun = time.monotonic()
        picture = self._renderer.picture(channel.name)
        jpeg = simplejpeg.encode_jpeg(picture, quality=JPEG_QUALITY, colorspace="RGB")
        header = FrameHeader(channel.sequence, float(state.tick), state.tick)
        channel.publisher.put(header.pack() + jpeg)
        channel.sequence += 1
        channel.sent_tick = state.tick
        # Keep the beat, but never catch up after a pause.
        channel.next_at = max(channel.next_at + 1 / MAX_RATE_HZ, begun + 0.5 / MAX_RATE_HZ)


def main(arguments: list[str] | None = None) -> int:
    """Run the camera process; returns its exit code."""
    parser = argparse.ArgumentParser(prog="python -m app.robot.camera", description=__doc__)
    parser.add_argument("--robot", required=True, help="id of the robot on the link")
    parser.add_argument("--endpoint", required=True, help="Zenoh endpoint of the robot node")
    parser.add_argument("--profile", default="puma560", help="name or file of the robot's profile")
    parser.add_argument(
        "--renderer",
        choices=["auto", "software", "egl"],
        default="auto",
        help="auto takes a graphics card where there is one",
    )
    options = parser.parse_args(arguments)
    with logs.written_apart("%(asctime)s camera %(levelname)s %(message)s"):
        return _run(options)


def _run(options: argparse.Namespace) -> int:
    parent = os.getppid()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    # A Ctrl-C in the terminal is the node's business, which ends this process in its own time.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    give_way(NICENESS)
    cv2.setNumThreads(1)  # the other cores are for control and for the gateway
    try:
        renderer = open_renderer(options.profile, options.renderer)
        session = open_session(options.endpoint, listen=False)
    except FarhandError as error:
        _log.error("%s", error)
        return 1
    alive = Alive(session, parent)
    try:
        process = CameraProcess(session, options.robot, renderer)
        while alive():
            process.turn()
        _log.info("the camera process ends: %s", alive.reason)
    finally:
        session.close()  # type: ignore[no-untyped-call]
        renderer.close()
    return 0


def open_renderer(model: str, choice: str) -> Renderer:
    """A renderer as asked for; ``auto`` falls back to software drawing.

    Raises:
        CannotStart: there is no such model, or ``egl`` was asked for and does not work.
    """
    if choice == "auto":
        try:
            return Renderer(model)
        except WorldError as error:
            _log.info("drawing in software: %s", error)
            return Renderer(model, hardware=False)
    return Renderer(model, hardware=choice == "egl")


if __name__ == "__main__":
    sys.exit(main())
