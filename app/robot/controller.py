"""One cycle of a robot node: what arrived goes in, the arm moves on by one step.

Knows nothing of the link, of processes or of waiting; time is given to it. So the whole behaviour
of a node can be run in a test, faster than time passes.
"""

import logging
from collections.abc import Iterable

import numpy as np

from app.config import ArmMotionSettings
from app.link.actions import Stop
from app.link.messages import (
    Command,
    Doubt,
    LeaseReply,
    LeaseRequest,
    LoopState,
    Mode,
    State,
    StopRequest,
)
from app.robot.arm import Arm, Reading
from app.robot.command_gate import CommandGate
from app.robot.contact import ContactWatch
from app.robot.latch import StopLatch
from app.robot.lease import Lease
from app.robot.motion.motion import Motion
from app.robot.safety import Phase, Safety

log = logging.getLogger(__name__)

DT = 1 / 240
"""s; one cycle."""
RAMP_S = 0.2
"""Longest ramp of a stop; after it the brakes come on whatever the arm does."""
DOUBTS: dict[Doubt, str] = {
    "no_hand": "no hand is in the picture",
    "unknown_hand": "the hand shows no gesture that is known",
    "two_hands": "two hands are in the picture",
    "low_margin": "the hand is between two gestures",
    "frozen": "the webcam picture is frozen",
    "stale_picture": "the operator's picture of the robot is too old",
}
"""Why the arm holds still, in plain words, when the gateway does not trust what it sees."""
_STANDING = 0.02
"""rad/s; slower than this, a measured joint counts as standing."""


class Controller:
    """Decides, 240 times a second, what one arm does.

    Args:
        arm: The arm.
        robot: Its id.
        settings: How fast it moves.
        latch: Where a latched stop is kept.
        now: s; the node's monotonic clock.

    Raises:
        CannotStart: the arm's limits make no sense.
    """

    def __init__(
        self, arm: Arm, robot: str, settings: ArmMotionSettings, latch: StopLatch, now: float
    ) -> None:
        self.arm = arm
        self.robot = robot
        self.lease = Lease(first_epoch=tick_of(now))
        self.safety = Safety(latch, tick_of(now))
        self.gate = CommandGate()
        self.motion = Motion(arm, settings, DT)
        self.fault: str | None = None
        self.braked = False
        self.reading: Reading = arm.read()
        self._following_error = settings.following_error
        self._contact = ContactWatch(
            settings.clearance.contact_force, arm.description.gripper_force or 0.0
        )
        self._fresh_until = -1.0
        self._hold: int | None = None
        """The showing of a gesture whose action is being done."""
        self._ended = -1
        """The newest showing that is over."""
        self._frame: int | None = None
        self._began = 0
        self._note: str | None = None
        self._stopping_since = now
        self._brake(engaged=True)

    def stop(self, stop: StopRequest) -> None:
        """Take a stop request in: S0 brakes within this very call."""
        self.safety.request(stop)
        self._settle()

    def answer(self, request: LeaseRequest, now: float) -> LeaseReply:
        """Answer a request for the lease, or to arm, disarm or reset."""
        self.safety.tick = tick_of(now)
        reply = self._answer(request, now)
        self._settle()  # at once: what comes next in this cycle may allow motion again
        if request.kind != "renew" or not reply.granted:
            log.info(
                "%s by %s: %s %s", request.kind, request.holder, reply.code, reply.reason or ""
            )
        return reply

    def obey(self, command: Command, now: float) -> None:
        """Take a command in, if it counts."""
        epoch = None if self.lease.holder is None else self.lease.epoch
        if not self.gate.admit(command, epoch, tick_of(now)):
            return
        self.lease.seen(now)
        self._fresh_until = (command.tick + command.ttl_ms) / 1000
        self.motion.trajectory.scale = command.scale
        shown = command.gesture is not None or command.action is not None
        self.safety.saw(now, gesture=shown)
        if command.doubt is not None and command.action is None:
            self._distrust(command.doubt)
        if isinstance(command.action, Stop):
            if command.hold > self._ended:
                self._ended = command.hold
                reason = f"the gesture {command.gesture or 'stop'!r} was shown"
                self.stop(StopRequest(source=self.lease.holder or "", reason=reason[:300]))
        elif shown and not self.safety.may_move:
            # Whatever is shown now moves nothing later: arming begins no motion.
            self._ended = max(self._ended, command.hold)
        elif command.action is None:
            self._let_go()
            self._note = None
        elif command.hold == self._hold:
            if command.action != self.motion.action and self.motion.doing:
                self._let_go()
                self._note = "the action changed while its gesture was held: show it again"
        elif command.hold > self._ended:
            self._begin(command, now)

    def cycle(self, now: float, commands: Iterable[Command] = ()) -> None:
        """Let 1/240 s pass."""
        self.safety.tick = tick_of(now)
        for command in commands:
            self.obey(command, now)
        if (gone := self.lease.expire(now)) is not None:
            self.safety.lease_gone(f"{gone} has not been heard of: control is free")
        if now > self._fresh_until:
            self.safety.silence()
            if self._hold is not None and self.motion.busy:
                self.safety.hold("no command in time: the picture or the link failed")
        self._settle()
        doing = self.motion.doing
        self.motion.step(self.reading)
        if doing and not self.motion.doing and self.motion.gave_up is not None:
            self._note = self.motion.gave_up
        if self.motion.wants_stop:
            self.motion.wants_stop = False
            self.stop(StopRequest(source="sequence", reason="the sequence says stop"))
        self._apply(now)
        self.arm.step()
        self.reading = self.arm.read()
        self._watch_arm()

    @property
    def standing(self) -> bool:
        """The arm stands, as measured."""
        return bool(np.abs(self.reading.velocities).max() < _STANDING)

    def state(self, now: float, loop: LoopState | None = None) -> State:
        """What the robot is and does."""
        reading, motion, safety = self.reading, self.motion, self.safety
        return State(
            robot=self.robot,
            tick=tick_of(now),
            mode=self._mode(),
            armed=safety.armed,
            controller=self.lease.holder,
            epoch=self.lease.epoch,
            stop=safety.category,
            reason=self._note if safety.may_move else safety.reason,
            fault=self.fault,
            stops=safety.stops,
            resets=safety.resets,
            latch=safety.latch,
            joints=tuple(reading.joints.tolist()),
            velocities=tuple(reading.velocities.tolist()),
            commanded=tuple(motion.trajectory.position.tolist()),
            gripper=reading.gripper,
            tool_position=tuple(reading.tool.position.tolist()),
            tool_orientation=tuple(reading.tool.orientation.tolist()),
            frame=self._frame if motion.busy else None,
            began=self._began if motion.busy else None,
            action=motion.action,
            limits=motion.limits,
            clearance=motion.guard.clearance,
            dropped=dict(self.gate.dropped),
            doubt=self._doubt,
            scale=motion.trajectory.scale,
            transitions=tuple(safety.transitions),
            objects=reading.objects,
            loop=loop,
            base=reading.base,
        )

    def _answer(self, request: LeaseRequest, now: float) -> LeaseReply:
        lease, holder, epoch = self.lease, request.holder, request.epoch
        match request.kind:
            case "take":
                before = (lease.epoch, lease.holder)
                reply = lease.take(holder, now, takeover=request.takeover)
                if lease.epoch != before[0]:
                    self.safety.lease_gone(f"{holder} took control from {before[1]}: arm again")
                    self._ended = -1
                    self._hold = None
                return reply
            case "renew":
                return lease.renew(holder, epoch, now)
            case "release":
                reply = lease.release(holder, epoch)
                if reply.granted:
                    self.safety.lease_gone(f"{holder} gave control back")
                return reply
            case "arm":
                reply = lease.renew(holder, epoch, now)
                if reply.granted:
                    reply = self.safety.arm()
                return reply
            case "disarm":
                reply = lease.renew(holder, epoch, now)
                if reply.granted:
                    self.safety.disarm(f"disarmed by {holder}")
                return reply
            case "reset":
                reply = self.safety.reset(at_rest=self.braked and self.standing)
                if reply.granted:
                    self.fault = None
                return reply
            case "reset_scene":
                return self._reset_scene()

    def _reset_scene(self) -> LeaseReply:
        """Nobody's arm may be about to move when things jump back to where they began."""
        if self.safety.armed:
            return LeaseReply(
                granted=False, code="armed", reason="the robot is armed: disarm it first"
            )
        if not (self.braked and self.standing):
            return LeaseReply(granted=False, code="moving", reason="the arm has not come to rest")
        self.arm.reset_scene()
        return LeaseReply(granted=True)

    def _distrust(self, doubt: Doubt) -> None:
        """S2 if an action is under way: who shows nothing that is sure, or sees nothing, waits.

        What has ended by itself, or was let go before, comes to rest without it.
        """
        if self._hold is not None and self.motion.busy:
            self.safety.hold(DOUBTS[doubt])

    def _begin(self, command: Command, now: float) -> None:
        """A new showing of a gesture."""
        assert command.action is not None
        self._let_go()
        if (refusal := self.motion.refusal(command.action)) is not None:
            self._ended = command.hold
            self._note = refusal
            log.info("refused: %s", refusal)
            return
        if self.motion.busy:
            return  # still coming to rest; the command after this one will be in time
        self.motion.begin(command.action)
        self._hold, self._frame, self._note = command.hold, command.frame, None
        self._began = tick_of(now)

    def _let_go(self) -> None:
        """The showing of a gesture is over, if there was one."""
        if self._hold is not None:
            self._ended = max(self._ended, self._hold)
            self._hold = None
            self.motion.release()

    def _settle(self) -> None:
        """Where the arm may not move, bring it to rest; with S0, now."""
        if self.safety.may_move:
            return
        if self._hold is not None:
            self._ended = max(self._ended, self._hold)
            self._hold = None
        if self.motion.busy:
            self.motion.halt()
        if self.safety.category == "S0" and not self.braked:
            self._brake(engaged=True)

    def _apply(self, now: float) -> None:
        """Give the arm its next target, and its brakes what the phase asks for."""
        phase, category = self.safety.phase, self.safety.category
        power = self.safety.armed or (phase is Phase.DISARMED and category == "S2")
        if power or not self.motion.busy:
            self._stopping_since = now
        if power == self.braked:
            late = now - self._stopping_since > RAMP_S + 0.05
            if power or not self.motion.busy or late:
                self._brake(engaged=not power)
        if self.braked:
            self.motion.reset(self.reading.joints)
        else:
            self.arm.move(self.motion.trajectory.position, self.motion.trajectory.velocity)

    def _brake(self, *, engaged: bool) -> None:
        self.motion.reset(self.reading.joints)
        self.arm.brake(engaged)
        self.braked = engaged
        self._contact.released(self.reading.contacts)
        log.info("brakes %s", "on" if engaged else "off")

    def _watch_arm(self) -> None:
        """An arm that has hit something, or does not follow: S1."""
        if self.braked or self.safety.phase is Phase.STOPPED:
            return
        touched = self._contact.collision(self.reading.contacts, self.motion.guard.plain)
        if touched is not None:
            self.fault = f"collision: {touched}"
            self.safety.stop(StopRequest(source="arm", reason=self.fault))
            return
        error = self.reading.joints - self.motion.trajectory.position
        worst = int(np.abs(error).argmax())
        if not abs(error[worst]) <= self._following_error:  # also NaN
            joint = self.arm.description.joints[worst]
            what = "robot" if self.arm.description.drives else "arm"
            self.fault = (
                f"{joint.name} is {abs(error[worst]):.2f} {joint.unit} away from where it should "
                f"be: is the {what} blocked?"
            )
            self.safety.stop(StopRequest(source="arm", reason=self.fault))

    @property
    def _doubt(self) -> Doubt | None:
        """The doubt for which the arm holds, if it is for one."""
        if self.safety.phase is not Phase.HOLDING:
            return None
        return next((doubt for doubt, why in DOUBTS.items() if why == self.safety.reason), None)

    def _mode(self) -> Mode:
        match self.safety.phase:
            case Phase.ARMED:
                return "moving" if self.motion.busy else "armed"
            case Phase.HOLDING:
                return "holding"
            case Phase.STOPPED:
                return "stopped"
            case Phase.DISARMED:
                return "disarmed"


def tick_of(now: float) -> int:
    """The node's tick (ms) at ``now`` (s)."""
    return int(now * 1000)
