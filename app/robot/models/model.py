"""What a robot model is: the ``model.toml`` beside its URDF, validated."""

import tomllib
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from app.errors import CannotStart
from app.link.messages import (
    CameraDescription,
    Description,
    JointDescription,
    ObjectDescription,
    WorkspaceDescription,
)

Vector3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class JointModel(_Part):
    """One joint of the arm: its name in the URDF and its limits."""

    name: str
    lower: float = Field(description="rad")
    upper: float = Field(description="rad")
    velocity: Positive = Field(description="rad/s")
    acceleration: Positive = Field(description="rad/s^2")
    jerk: Positive = Field(description="rad/s^3")
    torque: Positive = Field(description="Nm, of the motor")
    brake: Positive = Field(description="Nm, of the brake")

    @model_validator(mode="after")
    def _has_room(self) -> Self:
        if self.lower >= self.upper:
            raise ValueError(f"{self.name}: lower {self.lower} is not below upper {self.upper}")
        return self


class GripperModel(_Part):
    """Two fingers that move against one another."""

    fingers: tuple[str, str] = Field(description="joint names in the URDF; 0 is closed")
    width: Positive = Field(description="m between the fingers when open")
    speed: Positive = Field(description="m/s, of each finger")
    force: Positive = Field(description="N, of each finger")


class CameraModel(_Part):
    """One camera: where it sits and what it looks at, in the frame of a link."""

    name: str = Field(pattern=r"^[a-z0-9_]+$")
    link: str = Field(description="URDF link that carries it")
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

    name: str
    urdf: str = Field(description="file beside the model.toml")
    base_link: str
    tool_link: str = Field(description="its origin is the tool centre point, Z points out")
    home: str = Field(description="the pose of the action ``home``, and where the arm starts")
    joints: tuple[JointModel, ...] = Field(min_length=1)
    gripper: GripperModel
    poses: dict[str, tuple[float, ...]] = Field(description="rad")
    cameras: tuple[CameraModel, ...]
    objects: tuple[ObjectModel, ...]
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
                raise ValueError(f"pose {name}: {len(pose)} numbers for {len(self.joints)} joints")
            for joint, angle in zip(self.joints, pose, strict=True):
                if not joint.lower <= angle <= joint.upper:
                    raise ValueError(
                        f"pose {name}: {joint.name} at {angle} rad is outside "
                        f"{joint.lower} to {joint.upper}"
                    )
        if self.home not in self.poses:
            raise ValueError(f"home: there is no pose {self.home}")
        for kind in (self.cameras, self.objects):
            names = [part.name for part in kind]
            if len(set(names)) != len(names):
                raise ValueError(f"the same name twice in {names}")
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

    def describe(self, robot: str) -> Description:
        """What the node answers when asked what the robot ``robot`` is."""
        return Description(
            id=robot,
            name=self.name,
            model=Path(self.urdf).stem,
            joints=tuple(
                JointDescription(**joint.model_dump(exclude={"torque", "brake"}))
                for joint in self.joints
            ),
            poses=self.poses,
            workspace=None
            if self.workspace is None
            else WorkspaceDescription(lower=self.workspace.lower, upper=self.workspace.upper),
            gripper_max=self.gripper.width,
            gripper_force=self.gripper.force,
            cameras=tuple(
                CameraDescription(
                    name=camera.name,
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


def model_names() -> list[str]:
    """The models that come with Farhand."""
    folder = Path(str(resources.files("app.robot.models")))
    return sorted(path.parent.name for path in folder.glob("*/model.toml"))


@lru_cache
def load_model(name: str) -> Model:
    """Read and check the model ``name``.

    Raises:
        CannotStart: there is no such model, or its file is not right.
    """
    if name not in model_names():
        raise CannotStart(
            f"there is no robot model {name!r}; there are: {', '.join(model_names())}", model=name
        )
    path = model_folder(name) / "model.toml"
    try:
        return Model.model_validate(tomllib.loads(path.read_text("utf-8")))
    except (ValidationError, tomllib.TOMLDecodeError) as error:
        raise CannotStart(f"{path} is not a robot model: {error}", model=name) from error


def model_folder(name: str) -> Path:
    """Where the files of the model ``name`` are."""
    return Path(str(resources.files("app.robot.models"))) / name
