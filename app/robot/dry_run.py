"""The dry-run process: says whether a program would break a limit, while the node goes on.

Started by the node as ``python -m app.robot.dry_run --robot ID --endpoint EP --profile P``. It
answers on the key ``/dry_run``, one question at a time; whoever asks meanwhile is told that it is
busy. Its arm is made when somebody first asks. It ends when its parent or the link is gone.
"""

import argparse
import logging
import os
import signal
import sys
import threading
from typing import TYPE_CHECKING

import numpy as np
import zenoh
from pydantic import ValidationError

from app import logs
from app.config import ArmMotionSettings
from app.errors import FarhandError
from app.link.messages import DryRunReport, DryRunRequest, State, key
from app.link.reading import decode
from app.link.session import open_session
from app.robot.beside import Alive, NewestState
from app.robot.rehearsal import STEP_S, Rehearsal

if TYPE_CHECKING:
    from app.robot.sim.kinematic_arm import KinematicArm
    from app.robot.sim.rehearsed_base import RehearsedBase

_log = logging.getLogger(__name__)

NICENESS = 5
"""The control loop and the operator's frames go first; pictures, which wait for nobody, do not."""
IDLE_S = 0.5


class DryRunProcess:
    """Answers until told to stop.

    Args:
        session: Open, as a client of the node's.
        robot: The robot's id on the link.
        profile: Name or file of the robot's profile.
        settings: How fast the robot moves.
        alive: Whether there is still somebody to answer to.
    """

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        profile: str,
        settings: ArmMotionSettings,
        alive: Alive,
    ) -> None:
        self._robot, self._profile, self._settings, self._alive = robot, profile, settings, alive
        self._arm: KinematicArm | None = None
        self._base: RehearsedBase | None = None
        self._state = NewestState()
        self._lock = threading.Lock()
        self._query: zenoh.Query | None = None
        self._asked = threading.Event()
        self._key = key(robot, "dry_run")
        self._subscriber = session.declare_subscriber(
            key(robot, "state"), lambda sample: self._state.put(sample.payload.to_bytes())
        )
        self._queryable = session.declare_queryable(self._key, self._take)

    def turn(self) -> None:
        """Wait shortly for a question, and answer it."""
        if not self._asked.wait(IDLE_S) or self._query is None:
            return
        try:
            report = self._answer(self._query)
        except Exception:
            _log.exception("the dry run failed")
            report = DryRunReport(code="internal", reason="the check itself failed")
        self._reply(self._query, report)
        with self._lock:
            self._asked.clear()
            self._query = None

    def _take(self, query: zenoh.Query) -> None:
        """Called on Zenoh's threads."""
        with self._lock:
            if self._query is None:
                self._query = query
                self._asked.set()
                return
        reason = "another program is being checked; try again"
        self._reply(query, DryRunReport(code="busy", reason=reason))

    def _reply(self, query: zenoh.Query, report: DryRunReport) -> None:
        try:
            query.reply(self._key, report.encode())
        except zenoh.ZError as error:
            _log.info("answer not sent: %s", error)
        query.drop()  # type: ignore[no-untyped-call]

    def _answer(self, query: zenoh.Query) -> DryRunReport:
        payload = query.payload
        request = decode(DryRunRequest, b"" if payload is None else payload.to_bytes())
        if request is None:
            return DryRunReport(code="invalid", reason="the request cannot be read")
        _, message = self._state.wait(-1, 0.0)
        state = None if message is None else decode(State, message)
        if state is None:
            return DryRunReport(code="robot_unavailable", reason="the robot has not spoken yet")
        if state.base is not None:
            return self._drive(request, state.base, state)
        arm = self._open_arm()
        poses = arm.description.poses
        if request.start == "current":
            joints = np.array(state.joints)
        elif request.start == "home":
            joints = arm.home
        elif request.start in poses:
            joints = np.array(poses[request.start])
        else:
            names = ", ".join(sorted(poses))
            reason = f"this robot has no pose {request.start!r} to begin at; it has: {names}"
            return DryRunReport(code="unknown_pose", reason=reason)
        arm.place(joints, state.gripper, state.objects)
        return Rehearsal(arm, self._settings, self._alive).run(request.action)

    def _drive(
        self, request: DryRunRequest, base: tuple[float, float, float], state: State
    ) -> DryRunReport:
        if request.start != "current":
            reason = "a robot that drives begins where it is: from is 'current'"
            return DryRunReport(code="unknown_pose", reason=reason)
        # Imported here, as below.
        from app.robot.models import model_assets
        from app.robot.sim.rehearsed_base import RehearsedBase
        from app.robot.sim.world import STEPS_PER_SECOND

        if self._base is None:
            self._base = RehearsedBase(model_assets(self._profile), self._robot)
        self._base.place(np.array(state.joints), base, state.objects)
        rehearsal = Rehearsal(
            self._base, self._settings, self._alive, meets=self._base.meets, dt=1 / STEPS_PER_SECOND
        )
        return rehearsal.run(request.action)

    def _open_arm(self) -> "KinematicArm":
        if self._arm is None:
            # Imported here: PyBullet takes a second and memory, and most never ask.
            from app.robot.sim.kinematic_arm import KinematicArm

            self._arm = KinematicArm(self._profile, self._robot, dt=STEP_S)
        return self._arm


def main(arguments: list[str] | None = None) -> int:
    """Run the dry-run process; returns its exit code."""
    parser = argparse.ArgumentParser(prog="python -m app.robot.dry_run", description=__doc__)
    parser.add_argument("--robot", required=True, help="id of the robot on the link")
    parser.add_argument("--endpoint", required=True, help="Zenoh endpoint of the robot node")
    parser.add_argument("--profile", default="puma560", help="name or file of the robot's profile")
    parser.add_argument("--motion", default="{}", help="JSON of how the robot moves its arm")
    options = parser.parse_args(arguments)
    with logs.written_apart("%(asctime)s dry run %(levelname)s %(message)s"):
        return _run(options)


def _run(options: argparse.Namespace) -> int:
    parent = os.getppid()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    # A Ctrl-C in the terminal reaches the whole group; the node ends this process in its own time.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(NICENESS)
    try:
        settings = ArmMotionSettings.model_validate_json(options.motion)
        session = open_session(options.endpoint, listen=False)
    except ValidationError as error:
        _log.error("--motion: %s", error.errors()[0]["msg"])
        return 1
    except FarhandError as error:
        _log.error("%s", error)
        return 1
    alive = Alive(session, parent)
    try:
        process = DryRunProcess(session, options.robot, options.profile, settings, alive)
        while alive():
            process.turn()
        _log.info("the dry-run process ends: %s", alive.reason)
    finally:
        session.close()  # type: ignore[no-untyped-call]
    return 0


if __name__ == "__main__":
    sys.exit(main())
