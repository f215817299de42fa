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


class GatewaySettings(_Section):
    """The server between the browsers and the robots."""

    allowed_hosts: tuple[str, ...] = Field(
        default=(),
        description="host names that requests may be addressed to; on loopback its own names are "
        "always allowed, elsewhere none given means any",
    )
    max_message_bytes: int = Field(
        default=1 << 20,
        ge=64 * 1024,
        le=8 << 20,
        description="bytes of one WebSocket message; a longer one closes the connection (1009)",
    )
    max_upload_bytes: int = Field(
        default=4 << 20, ge=64 * 1024, le=64 << 20, description="bytes of one upload over REST"
    )
    max_bad_messages: int = Field(
        default=10, ge=1, le=1000, description="bad messages in a row that close a session (1007)"
    )
    max_sessions: int = Field(default=32, ge=1, le=1000, description="operator sessions at once")
    max_frame_age_ms: int = Field(
        default=500,
        ge=50,
        le=10_000,
        description="a frame whose sender had seen no newer server tick than this moves nothing",
    )
    workers: int = Field(default=4, ge=1, le=64, description="threads for image work")
    robot_rate_hz: float = Field(
        default=20.0, ge=10.0, le=60.0, description="robot messages a second to every session"
    )
    detail_rate_hz: float = Field(
        default=10.0, ge=1.0, le=30.0, description="masks and templates a second to a detail view"
    )
    robot_silence_ms: int = Field(
        default=250, ge=100, le=5000, description="no state for this long is shown as a fault"
    )
    robot_hung_ms: int = Field(
        default=1500,
        ge=500,
        le=60_000,
        description="a spawned node without a state for this long is killed and started again",
    )
    robot_start_s: float = Field(
        default=30.0, ge=1.0, le=300.0, description="time a spawned node has for its first state"
    )
    ready_wait_s: float = Field(
        default=10.0, ge=0.0, le=60.0, description="wait this long for the robot when starting"
    )
    lease_timeout_ms: int = Field(
        default=1000, ge=100, le=10_000, description="wait this long for the node's answer"
    )
    stop_confirm_ms: int = Field(
        default=300, ge=50, le=5000, description="a stop not confirmed after this is reported"
    )
    picture_wait_s: float = Field(
        default=2.0, ge=0.1, le=30.0, description="wait this long for a fresh camera picture"
    )
    viser: bool = Field(default=True, description="serve the live 3D view at /viser/")


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
    tls_cert: Path | None = Field(default=None, description="certificate chain (PEM) for HTTPS")
    tls_key: Path | None = Field(default=None, description="private key (PEM) of the certificate")
    behind_proxy: bool = Field(
        default=False, description="a proxy in front serves HTTPS; allows plain HTTP off loopback"
    )
    database_url: str | None = Field(
        default=None, description="SQLAlchemy URL; default: SQLite in the data folder"
    )
    pipeline: PipelineSettings = PipelineSettings()
    robot: RobotSettings = RobotSettings()
    gateway: GatewaySettings = GatewaySettings()
