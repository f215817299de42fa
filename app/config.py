"""Settings: one model per concern. Every field has a default, bounds and a description.

Values come from the command line, then from the environment (``FARHAND_PORT``,
``FARHAND_PIPELINE__CHANNEL``: two underscores go one level down), then from the defaults here.
Unknown keys are refused. Settings are passed in, never read at import.
"""

import os
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, SecretStr
from pydantic_settings import BaseSettings, SettingsConfigDict


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


Fraction = Annotated[float, Field(ge=0.0, le=1.0)]


class DecodeSettings(_Section):
    """What a webcam frame may be."""

    max_width: int = Field(default=1280, ge=64, le=4096, description="pixels")
    max_height: int = Field(default=720, ge=64, le=4096, description="pixels")
    max_bytes: int = Field(default=256 * 1024, ge=1024, le=8 << 20, description="bytes of one JPEG")


class PipelineSettings(_Section):
    """From a picture to a gesture."""

    decode: DecodeSettings = DecodeSettings()


class RobotSettings(_Section):
    """The robot node that the gateway starts."""

    id: str = Field(
        default="puma", pattern=r"^[a-z0-9-]{1,32}$", description="name of the robot on the link"
    )
    spawn: bool = Field(default=True, description="start and supervise a robot node")
    endpoint: str | None = Field(
        default=None,
        description="Zenoh endpoint of a node that runs elsewhere; used when spawn is off",
    )


def _data_dir() -> Path:
    base = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
    return Path(base) / "farhand"


class Settings(BaseSettings):
    """Everything that can be set from outside."""

    model_config = SettingsConfigDict(
        env_prefix="FARHAND_", env_nested_delimiter="__", extra="forbid", frozen=True
    )

    host: str = Field(default="127.0.0.1", description="address to listen on")
    port: int = Field(default=8000, ge=0, le=65535, description="port; 0 picks a free one")
    data_dir: Path = Field(default_factory=_data_dir, description="where everything is kept")
    token: SecretStr | None = Field(
        default=None, description="secret that opens the page and the API; made when not given"
    )
    database_url: str | None = Field(
        default=None, description="SQLAlchemy URL; default: SQLite in the data folder"
    )
    pipeline: PipelineSettings = PipelineSettings()
    robot: RobotSettings = RobotSettings()
