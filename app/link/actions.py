"""Actions: what a gesture makes the robot do.

One discriminated union, the same over REST, in the gesture database, in the exchange format and
on the link to the robot node. Bounds here only keep out nonsense; the robot node clips every
motion to the limits of its own arm and reports what it really did.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, model_validator

from app.link.numbers import Real, Whole

MAX_JOINT_SPEED = 4.3
"""rad/s; the fastest joint of the PUMA 560 (joint 5) turns at 241 degrees/s."""
MAX_LINEAR_SPEED = 1.0
"""m/s, per axis."""
MAX_ANGULAR_SPEED = 3.15
"""rad/s, per axis."""
MAX_JOINTS = 16
"""Joints that a robot may have; what it really has, it says in its description."""
MAX_STEPS = 32
"""Steps written in one sequence."""
MAX_DONE_STEPS = 256
"""Steps of one sequence after its repeats are counted out."""
MAX_REPEATS = 100
MAX_OFFSET = 1.0
"""m, per axis, of one straight move."""


class _Action(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


Duration = Annotated[
    Real | None,
    Field(
        default=None,
        gt=0,
        le=60,
        description="s; how long to move. Only inside a sequence, where it is required.",
    ),
]
LinearSpeed = Annotated[Real, Field(ge=-MAX_LINEAR_SPEED, le=MAX_LINEAR_SPEED)]
AngularSpeed = Annotated[Real, Field(ge=-MAX_ANGULAR_SPEED, le=MAX_ANGULAR_SPEED)]
Offset = Annotated[Real, Field(ge=-MAX_OFFSET, le=MAX_OFFSET)]
Turn = Annotated[Real, Field(ge=-3.1, le=3.1)]


class JogJoint(_Action):
    """Turn one joint at a constant speed while the gesture is held."""

    type: Literal["jog_joint"] = "jog_joint"
    joint: Whole = Field(ge=1, le=MAX_JOINTS, description="1 is the joint at the base.")
    velocity: Real = Field(ge=-MAX_JOINT_SPEED, le=MAX_JOINT_SPEED, description="rad/s")
    duration: Duration = None


class JogCartesian(_Action):
    """Move the tool in a straight line, or turn it, while the gesture is held."""

    type: Literal["jog_cartesian"] = "jog_cartesian"
    frame: Literal["base", "tool"] = "base"
    linear: tuple[LinearSpeed, LinearSpeed, LinearSpeed] = Field(
        default=(0.0, 0.0, 0.0), description="m/s along x, y, z of the frame"
    )
    angular: tuple[AngularSpeed, AngularSpeed, AngularSpeed] = Field(
        default=(0.0, 0.0, 0.0), description="rad/s about x, y, z of the frame"
    )
    duration: Duration = None


class TurnJoint(_Action):
    """Turn one joint by an exact angle. Ends there; letting go before stops it on the way."""

    type: Literal["turn_joint"] = "turn_joint"
    joint: Whole = Field(ge=1, le=MAX_JOINTS, description="1 is the joint at the base.")
    angle: Real = Field(ge=-6.3, le=6.3, description="rad, relative to where the joint is")


class MoveLinear(_Action):
    """Move the tool by an exact way in a straight line, turning it evenly as it goes.

    Ends there; letting go before stops it on the way.
    """

    type: Literal["move_linear"] = "move_linear"
    frame: Literal["base", "tool"] = "base"
    offset: tuple[Offset, Offset, Offset] = Field(
        default=(0.0, 0.0, 0.0), description="m along x, y, z of the frame"
    )
    rotation: tuple[Turn, Turn, Turn] = Field(
        default=(0.0, 0.0, 0.0), description="rotation vector in rad, in the frame"
    )
    speed: Real | None = Field(
        default=None, gt=0, le=MAX_LINEAR_SPEED, description="m/s; the robot's own unless given"
    )


class Pose(_Action):
    """Go to a named pose of the robot. Ends there; letting go before stops it on the way."""

    type: Literal["pose"] = "pose"
    name: str = Field(min_length=1, max_length=40, pattern=r"^[a-z0-9_-]+$")


class Gripper(_Action):
    """Open or close the gripper to a width."""

    type: Literal["gripper"] = "gripper"
    width: Real = Field(ge=0.0, le=0.2, description="m between the fingers; 0 is closed")
    force: Real | None = Field(
        default=None, gt=0, le=200, description="N of each finger; the robot's own unless given"
    )


class Home(_Action):
    """Go to the robot's home pose. Ends there; letting go before stops it on the way."""

    type: Literal["home"] = "home"


class Stop(_Action):
    """The latched stop (category S1). Needs no lease and no armed robot."""

    type: Literal["stop"] = "stop"


class Wait(_Action):
    """Stand still for a while. Only inside a sequence."""

    type: Literal["wait"] = "wait"
    duration: Real = Field(gt=0, le=60, description="s")


_SimpleStep = Annotated[
    JogJoint | JogCartesian | TurnJoint | MoveLinear | Pose | Gripper | Home | Wait | Stop,
    Field(discriminator="type"),
]


class Repeat(_Action):
    """Do some steps several times over. Only inside a sequence, and not in another repeat."""

    type: Literal["repeat"] = "repeat"
    times: Whole = Field(ge=1, le=MAX_REPEATS)
    steps: tuple[_SimpleStep, ...] = Field(min_length=1, max_length=MAX_STEPS)


Step = Annotated[
    JogJoint | JogCartesian | TurnJoint | MoveLinear | Pose | Gripper | Home | Wait | Repeat | Stop,
    Field(discriminator="type"),
]


class Sequence(_Action):
    """Actions one after another, for as long as the gesture is held."""

    type: Literal["sequence"] = "sequence"
    steps: tuple[Step, ...] = Field(min_length=1, max_length=MAX_STEPS)

    @model_validator(mode="after")
    def _jogs_end(self) -> "Sequence":
        done = 0
        for number, step in enumerate(self.steps, start=1):
            inner = step.steps if isinstance(step, Repeat) else (step,)
            done += len(inner) * (step.times if isinstance(step, Repeat) else 1)
            for each in inner:
                if isinstance(each, JogJoint | JogCartesian) and each.duration is None:
                    raise ValueError(f"step {number} ({each.type}) needs a duration in seconds")
        if done > MAX_DONE_STEPS:
            raise ValueError(
                f"the sequence has {done} steps with its repeats; at most {MAX_DONE_STEPS} may be"
            )
        return self


Action = Annotated[
    JogJoint | JogCartesian | TurnJoint | MoveLinear | Pose | Gripper | Home | Stop | Sequence,
    Field(discriminator="type"),
]
HeldAction = Annotated[
    JogJoint | JogCartesian | TurnJoint | MoveLinear | Pose | Gripper | Home | Sequence,
    Field(discriminator="type"),
]
"""Those that a held key may do: all but the stop, which waits for nothing."""
ACTION: TypeAdapter[Action] = TypeAdapter(Action)
"""Validates and serialises any action: ``ACTION.validate_json(b'{"type": "home"}')``."""
