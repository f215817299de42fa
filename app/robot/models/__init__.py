"""Robot profiles: a TOML file with its URDF. Nothing here needs PyBullet."""

from app.robot.models.assets import ModelAssets, model_assets
from app.robot.models.model import (
    CameraModel,
    GripperModel,
    JointModel,
    MobileBaseModel,
    Model,
    ObjectModel,
)
from app.robot.models.profile import load_model, load_profile, model_folder, model_names

__all__ = [
    "CameraModel",
    "GripperModel",
    "JointModel",
    "MobileBaseModel",
    "Model",
    "ModelAssets",
    "ObjectModel",
    "load_model",
    "load_profile",
    "model_assets",
    "model_folder",
    "model_names",
]
