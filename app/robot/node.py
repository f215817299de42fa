"""The robot node: a process that owns one arm and everything that must hold without the network.

One thread, 240 cycles a second: read what arrived, decide, move, say. Pictures are made by another
process (:mod:`app.robot.camera`), so that no cycle waits for one.

Run it with ``farhand robot`` or ``python -m app.robot.node --id puma --endpoint
unixsock-stream/PATH``.
"""

import argparse
import logging
import os
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from pydantic import ValidationError

from app import logs
from app.config import NodeSettings
from app.errors import FarhandError
from app.link.messages import StopRequest
from app.link.node_end import NodeEnd
from app.private import keep_private
from app.robot.arm import Arm
from app.robot.child import Child
from app.robot.controller import DT, Controller
from app.robot.latch import StopLatch
from app.robot.latch_lock import lock_latch
from app.robot.loop_clock import LoopClock, keep_time

log = logging.getLogger(__name__)

LINE = "%(asctime)s %(levelname)s node %(name)s: %(message)s"
"""How a line of the log looks."""
STATE_EVERY = 4
"""Cycles between two states: 60 a second."""
_PARENT_EVERY = 24
_LAST_CYCLES = 120
"""At most this long (0.5 s) the loop goes on after it was asked to end, for the arm to stop."""


class Node:
    """The control loop, and what it is connected to.

    Args:
        settings: Of this node.
        arm: The arm; closed with the node.
        end: The link; closed with the node.
    """

    def __init__(self, settings: NodeSettings, arm: Arm, end: NodeEnd) -> None:
        self._settings = settings
        self._arm = arm
        self._end = end
        self._description = arm.description.model_copy(update={"id": settings.id})
        self._latch = StopLatch(settings.latch)
        self.controller = Controller(
            arm, settings.id, settings.motion, self._latch, time.monotonic()
        )
        if settings.stopped is not None:
            # Of no account where the latch says the same.
            self.controller.safety.stop(StopRequest(source="gateway", reason=settings.stopped))
        self._clock = LoopClock(DT)
        self._ending: str | None = None
        self._cycles = 0

    def end(self, reason: str) -> None:
        """Ask the loop to stop the arm and then to end. Safe in a signal handler."""
        self._ending = self._ending or reason

    def run(self) -> None:
        """Run until :meth:`end`; then ramp to rest and brake."""
        self._clock = LoopClock(DT)
        while self._ending is None:
            self._cycle(self._clock.wait())
        log.info("ending: %s", self._ending)
        self.controller.safety.disarm(f"the robot node ends: {self._ending}")
        for _ in range(_LAST_CYCLES):
            self._cycle(self._clock.wait())
            if self.controller.braked and self.controller.standing:
                break
        self._end.publish_state(self.controller.state(time.monotonic()))

    def stop_at_once(self, reason: str) -> None:
        """The loop failed: brakes on, latched."""
        self.controller.fault = reason
        # Errors may be long, a reason may not: the stop must not fail for its text.
        self.controller.stop(StopRequest(category="S0", source="node", reason=reason[:300]))
        self._end.publish_state(
            self.controller.state(time.monotonic()).model_copy(update={"mode": "faulted"})
        )

    def close(self) -> None:
        """Let go of latch, link and arm."""
        self._latch.close()
        self._end.close()
        self._arm.close()

    def _cycle(self, now: float) -> None:
        end, controller = self._end, self.controller
        for stop in end.stop_requests():  # before everything else
            controller.stop(stop)
        for request, reply in end.lease_requests():
            reply(controller.answer(request, now))
        controller.cycle(now, end.commands())
        end.answer_descriptions(self._description)
        self._cycles += 1
        if self._cycles % STATE_EVERY == 0:
            for kind, count in end.invalid.items():
                controller.gate.dropped[f"invalid_{kind}"] = count
            end.publish_state(controller.state(now, self._clock.state()))
        if (
            self._settings.parent is not None
            and self._cycles % _PARENT_EVERY == 0
            and os.getppid() != self._settings.parent
        ):
            self.end("the process that started it is gone")


def run_node(settings: NodeSettings, arm: Arm | None = None) -> None:
    """Run a robot node until SIGTERM or SIGINT.

    Args:
        settings: Of this node.
        arm: The arm; the simulated one of ``settings.profile`` unless given.

    Raises:
        CannotStart: profile, meshes or latch file are missing or wrong, or another node has the
            latch.
        LinkFailed: the link's endpoint cannot be opened.
    """
    lock = None
    if settings.latch is not None and settings.parent is None:
        lock = lock_latch(settings.latch)  # else whoever starts us has it, over our restarts
    if arm is None:
        # Imported here: PyBullet takes a second, and greets on standard output.
        from app.robot.sim.robot import simulated

        arm = simulated(settings.profile, settings.id)
    node = Node(settings, arm, NodeEnd(settings.id, settings.endpoint))
    children = []
    if settings.cameras:
        children.append(Child(camera_command(settings), "camera process"))
    if settings.dry_runs:
        children.append(Child(dry_run_command(settings), "dry-run process"))
    before = {
        number: signal.signal(number, lambda *_: node.end("asked to end"))
        for number in (signal.SIGTERM, signal.SIGINT)
    }
    log.info("robot %s listens on %s", settings.id, settings.endpoint)
    try:
        keep_time()
        node.run()
    except Exception as error:
        node.stop_at_once(f"the control loop failed: {error}")
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for child in children:
            child.close()
        node.close()
        if lock is not None:
            lock.close()


def camera_command(settings: NodeSettings) -> list[str]:
    """The command line of the camera process."""
    return _beside("app.robot.camera", settings)


def dry_run_command(settings: NodeSettings) -> list[str]:
    """The command line of the dry-run process."""
    motion = settings.motion.model_dump_json()
    return [*_beside("app.robot.dry_run", settings), "--motion", motion]


def _beside(module: str, settings: NodeSettings) -> list[str]:
    return [
        sys.executable,
        "-m",
        module,
        "--robot",
        settings.id,
        "--endpoint",
        settings.endpoint,
        "--profile",
        settings.profile,
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m app.robot.node", description="A robot node.")
    parser.add_argument("--id", default="puma", help="name of the robot on the link")
    parser.add_argument("--profile", default="puma560", help="name or file of the robot's profile")
    parser.add_argument("--endpoint", required=True, help="unixsock-stream/PATH to listen on")
    parser.add_argument("--latch", type=Path, help="file that keeps a latched stop")
    parser.add_argument(
        "--stopped", help="begin stopped for this reason, whatever the latch's file says"
    )
    parser.add_argument("--no-cameras", action="store_true", help="start no camera process")
    parser.add_argument("--no-dry-runs", action="store_true", help="start no dry-run process")
    parser.add_argument(
        "--parent", type=int, help="process id of the one that starts it; end when that is gone"
    )
    given = parser.parse_args(arguments)
    keep_private()
    with logs.written_apart(LINE):
        try:
            settings = NodeSettings(
                id=given.id,
                profile=given.profile,
                endpoint=given.endpoint,
                latch=given.latch,
                stopped=given.stopped,
                cameras=not given.no_cameras,
                dry_runs=not given.no_dry_runs,
                parent=given.parent,
            )
            run_node(settings)
        except ValidationError as error:
            first = error.errors()[0]
            print(f"{first['loc'][0]}: {first['msg']}, not {first['input']!r}", file=sys.stderr)
            return 1
        except FarhandError as error:
            print(error.message, file=sys.stderr)
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
