"""What a robot profile says: one TOML file, validated by itself.

:mod:`app.robot.models.assets` then checks it against its URDF. docs/robots.md explains every key.
"""

from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from app.link.actions import MAX_JOINTS, Action
from app.link.messages import (
    CameraDescription,
    Description,
    JointDescription,
    ObjectDescription,
    WorkspaceDescription,
)

Vector3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]


class AtKey(ValueError):
    """Something in a profile is wrong, and the key that says it.

    Args:
        message: What is wrong, and what would be right.
        path: Keys from the part that is being validated to the one at fault.
    """

    def __init__(self, message: str, *path: str | int) -> None:
        super().__init__(message)
        self.path = path


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class JointModel(_Part):
    """One joint: its name in the URDF and its limits. Radians; metres where it slides.

    A mobile base has two that are not in the URDF: the first drives (m), the second turns (rad).
    """

    name: str
    lower: float = Field(description="rad or m")
    upper: float = Field(description="rad or m")
    velocity: Positive = Field(description="rad/s or m/s")
    acceleration: Positive = Field(description="rad/s^2 or m/s^2")
    jerk: Positive = Field(description="rad/s^3 or m/s^3")
    torque: Positive = Field(description="Nm or N, of the motor")
    brake: Positive = Field(description="Nm or N, of the brake")

    @model_validator(mode="after")
    def _has_room(self) -> Self:
        if self.lower >= self.upper:
            raise AtKey(f"{self.name}: lower {self.lower} is not below upper {self.upper}", "lower")
        return self


class GripperModel(_Part):
    """Two fingers that move against one another."""

    fingers: tuple[str, str] = Field(description="joint names in the URDF; 0 is closed")
    width: Positive = Field(description="m between the fingers when open")
    speed: Positive = Field(description="m/s, of each finger")
    force: Positive = Field(description="N, of each finger")


class AttachmentModel(_Part):
    """A second URDF, such as a gripper's, that hangs on a link of the first."""

    urdf: str = Field(description="file beside the profile, or package://PACKAGE/FILE")
    to: str = Field(description="link of the robot that carries it")
    xyz: Vector3 = Field(default=(0.0, 0.0, 0.0), description="m, in the frame of that link")
    rpy: Vector3 = Field(
        default=(0.0, 0.0, 0.0), description="rad about fixed X, Y, Z, as in a URDF"
    )


class MobileBaseModel(_Part):
    """A mobile base that drives and turns on wheels which do not steer (skid steering)."""

    left: tuple[str, ...] = Field(min_length=1, description="wheel joints of the left side")
    right: tuple[str, ...] = Field(min_length=1, description="wheel joints of the right side")
    radius: Positive = Field(description="m, of the wheels")
    track: Positive = Field(
        description="m between the sides as they act in a turn: wheels that slip sideways make it "
        "larger than the robot is wide"
    )


class CameraModel(_Part):
    """One camera: where it sits and what it looks at, in the frame of a link."""

    name: str = Field(
        pattern=r"^[a-z0-9_]+$",
        description="the page shows two: wrist, which rides on the robot, and scene",
    )
    title: str | None = Field(
        default=None, max_length=40, description="what the page calls it; the name unless given"
    )
    link: str = Field(description="URDF link that carries it; room: it stands still in the room")
    eye: Vector3 = Field(description="m")
    target: Vector3 = Field(description="m; a point on the optical axis")
    up: Vector3 = Field(description="direction that is up in the picture")
    fov_degrees: float = Field(gt=1, lt=170, description="vertical field of view")
    near: Positive = Field(description="m")
    far: Positive = Field(description="m")
    width: int = Field(default=320, ge=16, le=1920, description="pixels")
    height: int = Field(default=240, ge=16, le=1080, description="pixels")
    light: Vector3 = Field(description="direction to the light, base frame")
    shows: tuple[str, ...] = Field(
        default=(), description="links worth drawing; the others never come into view. Empty: all"
    )


class ObjectModel(_Part):
    """One thing in the scene: a box or an upright cylinder."""

    name: str = Field(pattern=r"^[a-z0-9_]+$")
    shape: Literal["box", "cylinder"]
    size: tuple[Positive, Positive, Positive] = Field(
        description="m; box: x, y, z edges; cylinder: diameter, diameter, height"
    )
    position: Vector3 = Field(description="m, of its middle, base frame")
    turn: float = Field(default=0.0, description="rad about Z")
    colour: tuple[float, float, float, float]
    mass: float = Field(default=0.0, ge=0, description="kg; 0: it never moves")
    friction: float = Field(default=0.6, ge=0)
    grid: bool = Field(default=False, description="pictures show a 10 cm grid on its top")


class WorkspaceModel(_Part):
    """The box that the tool may not leave, base frame."""

    lower: Vector3 = Field(description="m")
    upper: Vector3 = Field(description="m")

    @model_validator(mode="after")
    def _has_room(self) -> Self:
        if any(low >= high for low, high in zip(self.lower, self.upper, strict=True)):
            raise ValueError(f"lower {self.lower} is not below upper {self.upper}")
        return self


class Model(_Part):
    """Everything about a robot that its URDF does not say."""

    name: str = Field(min_length=1, max_length=80, description="what people call it")
    urdf: str = Field(
        description="file beside the profile, an absolute path, or package://PACKAGE/FILE of a "
        "Python package"
    )
    attach: tuple[AttachmentModel, ...] = Field(
        default=(), description="further URDFs that hang on this one"
    )
    base_link: str = Field(description="the URDF's first link; everything is given in its frame")
    tool_link: str = Field(description="its origin is the tool centre point, Z points out")
    home: str = Field(description="the pose of the action ``home``, and where the arm starts")
    joints: tuple[JointModel, ...] = Field(
        min_length=1,
        max_length=MAX_JOINTS,
        description="all that move between base_link and tool_link, from the base on",
    )
    gripper: GripperModel | None = Field(default=None, description="none: it cannot grip")
    base: MobileBaseModel | None = Field(
        default=None, description="of a robot that drives; its joints are then two, see JointModel"
    )
    poses: dict[str, tuple[float, ...]] = Field(description="rad or m, one number a joint")
    cameras: tuple[CameraModel, ...] = ()
    objects: tuple[ObjectModel, ...] = ()
    starter: dict[str, Action] = Field(
        default_factory=dict,
        description="what gestures of the starter set do with this robot, where not the usual; "
        "only a new gesture database takes it",
    )
    workspace: WorkspaceModel | None = Field(default=None, description="none: not bounded")
    never_touch: tuple[tuple[str, str], ...] = Field(
        default=(),
        description="pairs of links whose distance means nothing, because they cannot meet or are "
        "joined; neighbours in the chain are always left out",
    )

    link_words: dict[str, str] = Field(
        default={}, description="links in plain words, such as forearm, for messages to people"
    )

    @model_validator(mode="after")
    def _poses_fit(self) -> Self:
        for name, pose in self.poses.items():
            if len(pose) != len(self.joints):
                raise AtKey(
                    f"pose {name}: {len(pose)} numbers for {len(self.joints)} joints", "poses", name
                )
            for joint, angle in zip(self.joints, pose, strict=True):
                if not joint.lower <= angle <= joint.upper:
                    raise AtKey(
                        f"pose {name}: {joint.name} at {angle} rad is outside "
                        f"{joint.lower} to {joint.upper}",
                        "poses",
                        name,
                    )
        if self.home not in self.poses:
            raise AtKey(f"home: there is no pose {self.home}", "home")
        return self

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        for key, names in (
            ("joints", [joint.name for joint in self.joints]),
            ("cameras", [camera.name for camera in self.cameras]),
            ("objects", [thing.name for thing in self.objects]),
        ):
            for number, name in enumerate(names):
                if name in names[:number]:
                    raise AtKey(f"{key}: the same name twice, {name}", key, number, "name")
        return self

    @model_validator(mode="after")
    def _base_fits(self) -> Self:
        if self.base is None:
            return self
        if len(self.joints) != 2:
            raise AtKey(
                f"a robot that drives has two joints, one that drives and one that turns, not "
                f"{len(self.joints)}",
                "joints",
            )
        if self.gripper is not None:
            raise AtKey("a robot that drives has no gripper yet", "gripper")
        return self

    def pose(self, name: str) -> NDArray[np.float64]:
        """The joint angles (rad, shape (n,)) of a named pose.

        Raises:
            KeyError: there is no such pose.
        """
        return np.array(self.poses[name])

    def camera(self, name: str) -> CameraModel:
        """The camera ``name``.

        Raises:
            KeyError: there is no such camera.
        """
        return {camera.name: camera for camera in self.cameras}[name]

    def describe(self, robot: str, profile: str, slides: tuple[bool, ...]) -> Description:
        """What the node answers when asked what the robot ``robot`` is.

        Args:
            robot: Its id.
            profile: Short name of the profile.
            slides: Of each joint: whether it slides, and does not turn.
        """
        return Description(
            id=robot,
            name=self.name,
            model=profile,
            joints=tuple(
                JointDescription(
                    **joint.model_dump(exclude={"torque", "brake"}),
                    unit="m" if slides_ else "rad",
                )
                for joint, slides_ in zip(self.joints, slides, strict=True)
            ),
            poses=self.poses,
            workspace=None
            if self.workspace is None
            else WorkspaceDescription(lower=self.workspace.lower, upper=self.workspace.upper),
            gripper_max=0.0 if self.gripper is None else self.gripper.width,
            gripper_force=None if self.gripper is None else self.gripper.force,
            drives=self.base is not None,
            cameras=tuple(
                CameraDescription(
                    name=camera.name,
                    title=camera.title,
                    width=camera.width,
                    height=camera.height,
                    fov_degrees=camera.fov_degrees,
                )
                for camera in self.cameras
            ),
            objects=tuple(
                ObjectDescription(
                    name=thing.name,
                    shape=thing.shape,
                    size=thing.size,
                    colour=thing.colour,
                    fixed=thing.mass == 0,
                )
                for thing in self.objects
            ),
        )
