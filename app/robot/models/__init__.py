"""Robot models: a folder each, with a URDF and a ``model.toml``. Nothing here needs PyBullet."""

from app.robot.models.assets import ModelAssets, model_assets
from app.robot.models.model import (
    CameraModel,
    GripperModel,
    JointModel,
    Model,
    ObjectModel,
    load_model,
    model_names,
)

__all__ = [
    "CameraModel",
    "GripperModel",
    "JointModel",
    "Model",
    "ModelAssets",
    "ObjectModel",
    "load_model",
    "model_assets",
    "model_names",
]
