"""Whatever happens in whatever order: the rules of lease and stops as a state machine.

The suite plays a modest number of games, ``python -m benchmarks.safety_properties`` the full one.
"""

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from app.link.actions import Action, Home, JogJoint, Stop, TurnJoint
from app.link.messages import Command, LeaseRequest, StopRequest
from app.robot.controller import DT, tick_of
from app.robot.safety import Phase
from tests.robot.operator import JOG, Operator

HOLDERS = ("anna", "ben")
RAMP_S = 0.2 + 3 * DT
"""A stop ends so soon."""
WATCHDOG_S = 0.25 + 2 * DT
"""A command lives so long."""
WORSE = {None: 0, "S2": 0, "S1": 1, "S0": 2}
ACTIONS: tuple[Action | None, ...] = (
    JOG,
    JogJoint(joint=2, velocity=-0.8),
    None,
    None,
    TurnJoint(joint=2, angle=0.2),
    Home(),
    Stop(),
)
DOUBTED = st.sampled_from(
    ["no_hand", "unknown_hand", "two_hands", "low_margin", "frozen", "stale_picture"]
)
SECONDS = st.sampled_from([0.01, 0.05, 0.1, 0.2, 0.3, 0.6])


class AnyOrder(RuleBasedStateMachine):
    """What somebody outside knows of the arm, and what must hold in every cycle.

    - Nothing moves but armed, with the lease held and a fresh command of its epoch.
    - A latched stop stays until a reset that was granted, from whatever state it came.
    - The worst stop that was asked for is in force.
    - A command that is old, repeated, or of another epoch changes nothing.
    - No motion begins but with a showing that is new: never done before, never shown in vain.
    """

    def __init__(self) -> None:
        super().__init__()
        self.it = Operator()
        self.controller = self.it.controller
        self.safety = self.controller.safety
        self.hold = 0
        self.epochs = dict.fromkeys(HOLDERS, 0)
        self.last_valid = float("-inf")
        self.last_allowed = float("-inf")
        self.latched: str | None = None
        self.spent: set[tuple[int, int]] = set()
        """Showings (epoch, hold) that have begun a motion or were shown in vain."""
        self.steps = 0

    @initialize()
    def begin(self) -> None:
        self.check()

    # What may happen

    @rule(holder=st.sampled_from(HOLDERS), takeover=st.booleans())
    def take(self, holder: str, takeover: bool) -> None:
        before = self.controller.lease.holder
        reply = self.controller.answer(
            LeaseRequest(kind="take", holder=holder, takeover=takeover), self.it.now
        )
        assert reply.granted == (takeover or before in (None, holder))
        if reply.granted:
            assert reply.epoch is not None and reply.epoch >= max(self.epochs.values())
            self.epochs[holder] = reply.epoch
            if before not in (None, holder):
                assert not self.safety.armed
        self.check()

    @rule(
        holder=st.sampled_from(HOLDERS),
        kind=st.sampled_from(["renew", "release", "arm", "arm", "disarm"]),
    )
    def ask(self, holder: str, kind: str) -> None:
        lease = self.controller.lease
        entitled = lease.holder == holder and lease.epoch == self.epochs[holder]
        armed = self.safety.armed
        reply = self.controller.answer(
            LeaseRequest(kind=kind, holder=holder, epoch=self.epochs[holder]), self.it.now
        )
        assert not reply.granted or entitled
        if not entitled or self.latched:
            assert self.safety.armed == (armed and not self.latched)
        self.check()

    @rule()
    def reset(self) -> None:
        moving = self.it.arm.velocities.any()
        reply = self.controller.answer(LeaseRequest(kind="reset", holder="x"), self.it.now)
        if reply.granted and self.latched:
            assert not moving
            self.latched = None
            assert self.safety.phase is Phase.DISARMED
        self.check()

    @rule()
    def put_things_back(self) -> None:
        reply = self.controller.answer(LeaseRequest(kind="reset_scene", holder="x"), self.it.now)
        assert not reply.granted or not (self.safety.armed or self.it.arm.velocities.any())

    @rule(category=st.sampled_from(["S0", "S1", "S2"]))
    def stop(self, category: str) -> None:
        before = self.safety.stops
        self.controller.stop(StopRequest(category=category, source="test", reason="x"))
        assert self.safety.stops == before + 1
        assert not self.safety.may_move
        if category != "S2" and WORSE[category] > WORSE[self.latched]:
            self.latched = category
        if category == "S0":
            assert self.controller.braked
        self.check()

    @rule(
        holder=st.sampled_from(HOLDERS),
        new=st.booleans(),
        seconds=SECONDS,
        action=st.sampled_from(ACTIONS),
        scale=st.sampled_from([1.0, 1.0, 0.2, 0.05]),
    )
    def show(
        self, holder: str, new: bool, seconds: float, action: Action | None, scale: float
    ) -> None:
        self.hold += new
        self._stream(holder, seconds, action, scale=scale)

    @rule(holder=st.sampled_from(HOLDERS), doubt=DOUBTED, seconds=SECONDS)
    def doubt(self, holder: str, doubt: str, seconds: float) -> None:
        held = doubt in ("frozen", "stale_picture")
        more = {"gesture": "jog_joint"} if held else {}
        self._stream(holder, seconds, None, doubt=doubt, **more)

    @rule(
        holder=st.sampled_from(HOLDERS),
        age=st.sampled_from([251, 400, 5000, -1, -5000]),
        action=st.sampled_from(ACTIONS),
        count=st.integers(1, 5),
    )
    def show_what_is_stale(self, holder: str, age: int, action: Action | None, count: int) -> None:
        """A burst of what was delayed, or of what names the future."""
        self.hold += 1
        self.it.epoch = self.epochs[holder]
        self.it.now += DT
        tick = max(0, tick_of(self.it.now) - age)
        burst = [self.it.command(action, self.hold, tick=tick) for _ in range(count)]
        self._in_vain(burst)

    @precondition(lambda self: self.it.sequence > 0)
    @rule(holder=st.sampled_from(HOLDERS), back=st.integers(0, 3))
    def show_again_what_was_sent(self, holder: str, back: int) -> None:
        """The same sequence number, or an older one, as if the link said things twice."""
        self.it.epoch = self.epochs[holder]
        self.it.now += DT
        if self.controller.gate._epoch != self.it.epoch:
            return
        again = max(0, self.controller.gate._sequence - back)
        self._in_vain([self.it.command(JOG, self.hold + 1, sequence=again)])

    @rule(holder=st.sampled_from(HOLDERS), behind=st.integers(1, 3))
    def show_with_an_old_lease(self, holder: str, behind: int) -> None:
        self.it.epoch = max(0, self.controller.lease.epoch - behind)
        self.it.now += DT
        self.hold += 1
        self._in_vain([self.it.command(JOG, self.hold)])

    @rule(seconds=st.sampled_from([0.01, 0.1, 0.24, 0.3, 0.5, 2.1]))
    def wait(self, seconds: float) -> None:
        for _ in range(round(seconds / DT)):
            self._cycle([])

    @precondition(lambda self: self.safety.phase is Phase.DISARMED)
    @rule(seconds=SECONDS)
    def get_ready_and_move(self, seconds: float) -> None:
        self.take("anna", True)
        self.ask("anna", "arm")
        self.hold += 1
        self._stream("anna", 0.6, None)
        self.hold += 1
        self._stream("anna", seconds, JOG)

    # What must hold

    @invariant()
    def check(self) -> None:
        now, arm, safety = self.it.now, self.it.arm, self.safety
        mode = self.controller._mode()
        if safety.may_move:
            self.last_allowed = now
        if mode == "moving":
            assert safety.armed and safety.category is None
            assert self.controller.lease.holder is not None
            assert now - self.last_valid <= WATCHDOG_S + RAMP_S
        if arm.velocities.any():
            assert now - self.last_allowed <= RAMP_S
            assert now - self.last_valid <= WATCHDOG_S + RAMP_S
            assert not arm.braked
        assert (mode == "stopped") == (self.latched is not None)
        if self.latched is not None:
            assert (safety.category, safety.armed) == (self.latched, False)
        steps = [step.number for step in safety.transitions]
        assert steps == list(range(steps[0], steps[-1] + 1)) if steps else True
        assert self.steps <= (steps[-1] if steps else 0)
        self.steps = steps[-1] if steps else 0
        if steps:
            assert safety.transitions[-1].after == safety.phase.value

    # How it happens

    def _stream(self, holder: str, seconds: float, action: Action | None, **more: object) -> None:
        """Commands 30 a second."""
        self.it.epoch = self.epochs[holder]
        for count in range(max(1, round(seconds / DT))):
            commands = [self.it.command(action, self.hold, **more)] if count % 8 == 0 else []
            # The command is as old as the cycle that sees it is long.
            self._cycle(commands)

    def _cycle(self, commands: list[Command]) -> None:
        controller = self.controller
        self.it.now += DT
        allowed, held = self.safety.may_move, controller._hold
        dropped = sum(controller.gate.dropped.values())
        busy = controller.motion.busy
        controller.cycle(self.it.now, commands)
        for command in commands:
            if sum(controller.gate.dropped.values()) > dropped:
                assert controller._hold in (held, None)
                continue
            self.last_valid = self.it.now
            showing = (command.epoch, command.hold)
            if isinstance(command.action, Stop):
                stopped = self.safety.phase is Phase.STOPPED
                assert stopped or showing in self.spent
                self.latched = self.latched or ("S1" if stopped else None)
            begun = controller._hold is not None and controller._hold != held
            assert not begun or (allowed and not busy and showing not in self.spent)
            shown = command.gesture is not None or command.action is not None
            if begun or isinstance(command.action, Stop) or (shown and not allowed):
                self.spent.add(showing)
            if command.doubt is not None and held is not None and busy:
                assert controller._mode() != "moving"
            assert controller.motion.trajectory.scale == command.scale
        if not commands:
            assert controller._hold in (held, None)
        self.check()

    def _in_vain(self, commands: list[Command]) -> None:
        """Commands none of which may count."""
        controller = self.controller
        before = sum(controller.gate.dropped.values())
        held, phase = controller._hold, self.safety.phase
        for command in commands:
            controller.obey(command, self.it.now)
        assert sum(controller.gate.dropped.values()) == before + len(commands)
        assert (controller._hold, self.safety.phase) == (held, phase)
        controller.cycle(self.it.now)
        self.check()
