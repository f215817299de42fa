"""The messages between the gateway and a robot node. JSON on the wire, one model a message.

Each class says, in ``newest_wins``, whether a newer message of its kind replaces an older one that
has not been read yet (states do; stops and lease requests never do).

Clocks: the two processes may stand on different machines, so no time of one is compared with a
time of the other. The node stamps every State with its own ``tick`` (ms, monotonic); the gateway
sends the newest tick it has seen back in each Command, and the node judges age by its own clock
alone: ``now - command.tick`` bounds the age of what the gateway knew.
"""

from typing import ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.link.actions import Action

COMMAND_TTL_MS = 250
"""Commands live this long (DESIGN: the node's own watchdog)."""

Mode = Literal["disarmed", "armed", "moving", "holding", "stopped", "faulted"]
"""``disarmed``: nothing moves until somebody arms. ``armed``: ready, standing. ``moving``.
``holding``: category S2, stands with power until no gesture has been shown for 0.5 s.
``stopped``: category S1 or S0, latched until a reset. ``faulted``: the node is in trouble."""
StopCategory = Literal["S0", "S1", "S2"]
Doubt = Literal["no_hand", "unknown_hand", "two_hands", "low_margin", "frozen", "stale_picture"]
"""Why the gateway does not trust what the operator shows, or what the operator sees."""


def key(robot: str, what: str) -> str:
    """The Zenoh key of ``what`` for a robot, such as ``farhand/puma/command``."""
    return f"farhand/{robot}/{what}"


class Message(BaseModel):
    """Base: immutable, no unknown fields, no NaN or infinity anywhere."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
    newest_wins: ClassVar[bool] = False

    def encode(self) -> bytes:
        """UTF-8 JSON."""
        return self.model_dump_json().encode()


class Command(Message):
    """What the operator's newest frame asks for. Key ``/command``, one per processed frame.

    A frame that shows no gesture is a command too (``action`` is None): it proves that the whole
    way from the webcam is alive, and lets the arm come to rest without calling it a fault.
    """

    newest_wins: ClassVar[bool] = True

    epoch: int = Field(ge=0, description="of the lease; the node drops every other")
    sequence: int = Field(ge=0, description="strictly rising within an epoch")
    tick: int = Field(ge=0, description="newest State.tick the gateway had seen, ms")
    ttl_ms: int = Field(default=COMMAND_TTL_MS, ge=1, le=COMMAND_TTL_MS)
    frame: int | None = Field(default=None, ge=0, description="sequence number of the frame")
    hold: int = Field(
        default=0,
        ge=0,
        description="number of this showing of a gesture: it rises when a gesture starts, so that "
        "an action that ended by itself does not begin again while the hand stays up",
    )
    gesture: str | None = None
    action: Action | None = None
    reason: str | None = Field(
        default=None, description="why there is no action, in plain words", max_length=300
    )
    doubt: Doubt | None = Field(
        default=None, description="hold still (S2) if anything moves; the words are in reason"
    )
    scale: float = Field(
        default=1.0, ge=0.01, le=1.0, description="part of the ordinary speed that is wanted"
    )


class StopRequest(Message):
    """Stop now. Key ``/stop``; needs no lease, and never waits behind anything."""

    category: StopCategory = "S1"
    source: str = Field(max_length=80, description="who or what asked, for the log")
    reason: str = Field(max_length=300)


class LeaseRequest(Message):
    """A question to the node on key ``/lease``; answered by its control loop.

    ``take``: become the one who drives (``takeover`` also when somebody else holds the lease; the
    arm then stops and must be armed again). ``renew``: still there (every 0.5 s; 2 s without frees
    the lease). ``release``. ``arm`` and ``disarm``: need the lease. ``reset``: leave the latched
    stop; moves nothing and leaves the robot disarmed; needs no lease. ``reset_scene``: put every
    movable thing back where it was at first; needs no lease, but an arm that is disarmed or
    stopped, and stands.
    """

    kind: Literal["take", "renew", "release", "arm", "disarm", "reset", "reset_scene"]
    holder: str = Field(max_length=80, description="name of the session that asks")
    epoch: int | None = Field(default=None, ge=0, description="of the lease held")
    takeover: bool = False


class LeaseReply(Message):
    """The node's answer to a LeaseRequest."""

    granted: bool
    epoch: int | None = None
    code: str = "ok"
    reason: str = ""


class ObjectState(Message):
    """Where one thing in the scene is, in the robot's base frame."""

    name: str
    position: tuple[float, float, float] = Field(description="m")
    orientation: tuple[float, float, float, float] = Field(description="quaternion w, x, y, z")


class Clearance(Message):
    """How near the arm is to something, as commanded."""

    distance: float = Field(description="m; negative when they overlap")
    link: str = Field(description="URDF link of the arm")
    thing: str = Field(description="name of the thing, or of the arm's other link")
    itself: bool = Field(description="it is the arm itself")
    points: tuple[tuple[float, float, float], tuple[float, float, float]] = Field(
        description="m, base frame: the nearest points, on the link and on the thing"
    )


class Transition(Message):
    """One step of the safety supervisor."""

    number: int = Field(ge=1, description="rises by one")
    tick: int = Field(description="ms on the node's monotonic clock")
    before: str = Field(description="phase: disarmed, holding, armed, stopped")
    after: str
    stop: StopCategory | None = None
    reason: str | None = None


class LoopState(Message):
    """How well the control loop keeps its time."""

    rate_hz: float = Field(description="over the last second")
    late_max_ms: float = Field(description="over the last second")
    cycles: int = Field(default=0, ge=0, description="that were due since the loop started")
    late: int = Field(
        default=0, ge=0, description="of these began more than 5 ms after their time, or never"
    )
    log_lines_dropped: int = Field(
        default=0, ge=0, description="by the node, which waits for nobody who reads its log"
    )


class LatchState(Message):
    """Whether what is in force of a latched stop, or of its reset, is on the disk."""

    status: Literal["none", "pending", "kept", "failed"] = Field(
        default="none",
        description="none: no stop is latched, and the disk says so, or nothing keeps one. kept: "
        "the stop in force is on the disk. pending: the newest stop or reset is not on the disk "
        "yet. failed: it could not be written; tried again every second",
    )
    reason: str | None = Field(default=None, description="in plain words", max_length=300)
    waiting_ms: int = Field(default=0, ge=0, description="ms since the disk knew what is in force")


class State(Message):
    """What the robot is and does. Key ``/state``, 60 times a second, from the control loop."""

    newest_wins: ClassVar[bool] = True

    robot: str
    tick: int = Field(ge=0, description="ms on the node's monotonic clock")
    mode: Mode
    armed: bool
    controller: str | None = Field(description="who holds the lease")
    epoch: int
    stop: StopCategory | None = Field(default=None, description="category in force")
    reason: str | None = Field(default=None, description="why it stands, in plain words")
    doubt: Doubt | None = Field(default=None, description="why it holds, when doubt is the reason")
    fault: str | None = None
    stops: int = Field(default=0, description="stop requests received; confirms a StopRequest")
    resets: int = Field(default=0, ge=0, description="latched stops left since the node started")
    latch: LatchState = LatchState()
    joints: tuple[float, ...] = Field(description="rad, measured")
    velocities: tuple[float, ...] = Field(description="rad/s, measured")
    commanded: tuple[float, ...] = Field(description="rad, where the motion generator is")
    gripper: float = Field(description="m between the fingers, measured")
    tool_position: tuple[float, float, float] = Field(description="m, base frame")
    tool_orientation: tuple[float, float, float, float] = Field(description="quaternion w, x, y, z")
    frame: int | None = Field(default=None, description="frame that caused the motion, if any")
    began: int | None = Field(
        default=None, description="tick at which that motion began; null while nothing moves"
    )
    action: Action | None = Field(default=None, description="what is being done")
    limits: tuple[str, ...] = Field(default=(), description="limits at work, in plain words")
    dropped: dict[str, int] = Field(default_factory=dict, description="commands refused, by reason")
    objects: tuple[ObjectState, ...] = ()
    loop: LoopState | None = None
    scale: float = Field(default=1.0, description="part of the ordinary speed in force")
    clearance: Clearance | None = Field(
        default=None, description="nearest thing; None: nothing near, or not looked for"
    )
    transitions: tuple[Transition, ...] = Field(
        default=(), description="the newest few steps of the safety supervisor, oldest first"
    )
    base: tuple[float, float, float] | None = Field(
        default=None, description="of a mobile base: m, m, rad about Z, in the world"
    )


class JointDescription(Message):
    """One joint and its limits."""

    name: str
    lower: float = Field(description="rad, or m: see unit")
    upper: float = Field(description="rad")
    velocity: float = Field(description="rad/s")
    acceleration: float = Field(description="rad/s^2")
    jerk: float = Field(description="rad/s^3")
    unit: Literal["rad", "m"] = Field(default="rad", description="m: it slides, or drives")


class CameraDescription(Message):
    """One camera of the robot."""

    name: str
    title: str | None = Field(default=None, description="what to call it; None: by its name")
    width: int
    height: int
    fov_degrees: float = Field(description="vertical field of view")


class ObjectDescription(Message):
    """One thing in the scene, as a box (``size``) or, with one number, an upright cylinder."""

    name: str
    shape: Literal["box", "cylinder"]
    size: tuple[float, float, float] = Field(
        description="m; box: x, y, z edges; cylinder: diameter, diameter, height"
    )
    colour: tuple[float, float, float, float] = Field(description="RGBA, 0 to 1")
    fixed: bool = False


class WorkspaceDescription(Message):
    """The box that the tool may not leave."""

    lower: tuple[float, float, float] = Field(description="m, base frame")
    upper: tuple[float, float, float] = Field(description="m, base frame")


class Description(Message):
    """What a robot is. Key ``/description``, answered on request."""

    id: str
    name: str
    model: str = Field(description="short name of its profile")
    joints: tuple[JointDescription, ...]
    poses: dict[str, tuple[float, ...]] = Field(description="named joint positions, rad")
    gripper_max: float = Field(description="m; 0: it has no gripper")
    gripper_force: float | None = Field(default=None, description="N of each finger, at most")
    workspace: WorkspaceDescription | None = None
    drives: bool = Field(
        default=False, description="a mobile base: its two joints drive (m) and turn (rad)"
    )
    cameras: tuple[CameraDescription, ...]
    objects: tuple[ObjectDescription, ...] = ()


class DryRunRequest(Message):
    """Would this action break a limit? Key ``/dry_run``; answered by a process beside the node."""

    action: Action
    start: str = Field(
        default="current",
        max_length=40,
        description="where the arm begins: ``current``, ``home``, or the name of a pose",
    )


class DryRunProblem(Message):
    """One limit that the action meets."""

    step: int | None = Field(description="of a sequence, counted from 1")
    time_s: float = Field(description="s from the beginning")
    kind: str = Field(
        description="such as joint_limit; slowed means that the arm does all that is asked, but "
        "for a while more slowly"
    )
    message: str


class DryRunPath(Message):
    """Where the robot would go, thinned: lists of one length."""

    times: tuple[float, ...] = Field(default=(), description="s")
    joints: tuple[tuple[float, ...], ...] = Field(default=(), description="rad")
    tool: tuple[tuple[float, float, float], ...] = Field(
        default=(), description="m, base frame; the tool centre point"
    )
    base: tuple[tuple[float, float, float], ...] = Field(
        default=(),
        description="of a mobile base: m, m, rad about Z, in the room; empty of an arm",
    )


class DryRunReport(Message):
    """The answer to a DryRunRequest. Nothing has moved."""

    code: str = Field(default="ok", description="``ok``: checked; otherwise why not, as a word")
    reason: str = Field(default="", description="why it was not checked, in plain words")
    ok: bool = Field(default=False, description="no problem but ``slowed``")
    duration_s: float = 0.0
    problems: tuple[DryRunProblem, ...] = ()
    path: DryRunPath = DryRunPath()
