"""docs/protocol.md cannot drift from the code."""

import re
from pathlib import Path
from typing import get_args

import pytest

import app.gateway.hub
from app.config import Settings
from app.errors import FarhandError
from app.gateway import messages
from app.gateway.app import create_app
from app.gateway.errors import _HTTP_CODES
from app.gateway.http_protocol import MAX_PIPELINED
from app.gateway.jobs import KEPT_S, MOST_KEPT, MOST_RUNNING
from app.gateway.listener import KNOWN_RATE
from app.gateway.messages import _CLIENT_MESSAGE
from app.gateway.uploads import MAX_BURST, MAX_IMAGES
from app.gestures.history import MAX_BYTES, MAX_CHANGES
from app.gestures.records import MAX_GALLERIES, MAX_GESTURES
from app.gestures.setfile import ZIP_MAX_BYTES
from app.link import actions
from app.memory import KINDS, PersonSettings
from app.pipeline import STAGES
from app.pipeline.burst import KEPT, MAX_FRAMES
from app.pipeline.confusion import LIKELY, POSSIBLE
from app.pipeline.mix_ups import MOST_ASKED
from app.pipeline.types import Cause

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "protocol.md").read_text()
assert app.gateway.hub  # every error class of the gateway is loaded


def test_every_route_is_documented() -> None:
    paths = []
    for method, path in (
        (method.upper(), path)
        for path, methods in create_app(Settings(), token="x" * 32).openapi()["paths"].items()
        for method in methods
    ):
        paths.append(path)
        assert f"`{method} {path}`" in TEXT, f"{method} {path}"
    assert len(paths) >= 17


@pytest.mark.parametrize(
    "path", ["/ws/operator", "/ws/camera/{name}", "/viser/", "/viser", "/signin", "/docs"]
)
def test_every_other_path_is_documented(path: str) -> None:
    assert path in TEXT


def test_every_message_is_documented() -> None:
    for kind in messages.SERVER_MESSAGES:
        assert f"**`{kind}`**" in TEXT, kind
    for kind in messages.CLIENT_MESSAGES:
        assert f'`{{"type":"{kind}"' in TEXT, kind
    # The list that parsing uses is the list that is documented.
    schema = _CLIENT_MESSAGE.json_schema()
    assert set(schema["discriminator"]["mapping"]) == set(messages.CLIENT_MESSAGES)


def test_every_action_is_documented() -> None:
    kinds = actions.ACTION.json_schema()["discriminator"]["mapping"]
    for kind in kinds:
        assert f'`{{"type":"{kind}"' in TEXT, kind


def subclasses(kind: type[FarhandError]) -> set[type[FarhandError]]:
    return {kind}.union(*(subclasses(each) for each in kind.__subclasses__()))


def test_every_error_code_is_documented() -> None:
    codes = {kind.default_code for kind in subclasses(FarhandError)}
    codes |= set(_HTTP_CODES.values()) | {"internal"}
    for source in (ROOT / "app").rglob("*.py"):
        codes |= set(re.findall(r'\bcode="([a-z_]+)"', source.read_text()))
    missing = sorted(code for code in codes if f"`{code}`" not in TEXT)
    assert missing == []


def test_every_stage_is_documented() -> None:
    for stage in (*STAGES, "wait", "total"):
        assert f"`{stage}`" in TEXT, stage


def test_every_cause_is_documented() -> None:
    for cause in get_args(Cause):
        assert f"`{cause}`" in TEXT, cause


def test_every_kind_of_event_and_every_setting_of_a_person_is_documented() -> None:
    for kind in KINDS:
        assert f"| `{kind}` |" in TEXT, kind
    for name in PersonSettings.model_fields:
        assert f"`{name}`" in TEXT, name


def test_every_word_for_what_is_wrong_with_an_image_is_documented() -> None:
    codes = set()
    for name in ("quality", "still", "burst", "confusion"):
        source = (ROOT / "app" / "pipeline" / f"{name}.py").read_text()
        codes |= set(re.findall(r'Finding\(\s*"([a-z_]+)"', source))
        codes |= set(re.findall(r'_leave\(\w+, \w+, "([a-z_]+)"', source))
    assert len(codes) >= 15
    assert sorted(code for code in codes if f"`{code}`" not in TEXT) == []


def test_the_page_knows_the_same_messages() -> None:
    script = (ROOT / "app" / "static" / "core" / "protocol.js").read_text()
    for name, expected in (
        ("CLIENT_MESSAGES", messages.CLIENT_MESSAGES),
        ("SERVER_MESSAGES", messages.SERVER_MESSAGES),
    ):
        listed = re.search(rf"{name} = Object\.freeze\(\[(.*?)\]\)", script, re.DOTALL)
        assert listed is not None
        assert set(re.findall(r'"(\w+)"', listed[1])) == set(expected)


def test_the_limits_are_the_settings() -> None:
    settings = Settings()
    assert settings.gateway.max_message_bytes == 1 << 20
    assert settings.gateway.max_upload_bytes == 4 << 20
    assert settings.gateway.max_burst_bytes == 16 << 20
    assert settings.gateway.max_import_bytes == 16 << 20
    assert (MOST_RUNNING, KEPT_S, MOST_KEPT) == (2, 600, 20)
    assert (MAX_CHANGES, MAX_BYTES, MOST_ASKED, ZIP_MAX_BYTES) == (200, 64 << 20, 2000, 64 << 20)
    assert (MAX_IMAGES, MAX_BURST, MAX_FRAMES, KEPT) == (50, 120, 120, 8)
    assert (LIKELY, POSSIBLE) == (0.9, 0.7)
    assert (MAX_GALLERIES, MAX_GESTURES) == (100, 500)
    assert settings.gateway.max_bad_messages == 10
    assert settings.gateway.max_sessions == 32
    assert settings.gateway.max_observers == 100
    assert settings.gateway.max_frame_age_ms == 500
    assert settings.gateway.stop_confirm_ms == 300
    limits = settings.connections
    assert (limits.max_line_bytes, limits.max_head_bytes) == (8000, 32 * 1024)
    assert (limits.max_headers, MAX_PIPELINED) == (100, 16)
    assert {limits.begin_s, limits.head_s, limits.body_s, limits.idle_s, limits.unread_s} == {10.0}
    assert (limits.transfer_s, limits.keep_alive_s) == (300.0, 30)
    assert (limits.max_strangers, limits.max_per_address) == (256, 64)
    assert (limits.begins_per_s, KNOWN_RATE) == (50.0, 4.0)
    assert (limits.requests_per_s, limits.all_requests_per_s, limits.burst_s) == (20.0, 100.0, 5.0)
    assert (settings.memory.events, settings.memory.bytes) == (5000, 32 << 20)
    assert settings.gateway.picture_wait_s == 2.0
    assert settings.gateway.robot_rate_hz == 20
    assert settings.pipeline.decode.max_bytes == 256 * 1024
    assert (settings.pipeline.decode.max_width, settings.pipeline.decode.max_height) == (1280, 720)
