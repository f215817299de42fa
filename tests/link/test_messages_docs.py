"""docs/protocol.md tells of every message that crosses the link."""

from pathlib import Path

import pytest

from app.link import messages

TEXT = (Path(__file__).parents[2] / "docs" / "protocol.md").read_text()
PARTS = {
    "ObjectState",
    "LoopState",
    "Clearance",
    "Transition",
    "JointDescription",
    "CameraDescription",
    "ObjectDescription",
    "WorkspaceDescription",
}
"""Not sent by themselves, only inside others."""


@pytest.mark.parametrize(
    "name",
    [kind.__name__ for kind in messages.Message.__subclasses__() if kind.__name__ not in PARTS],
)
def test_every_message_is_documented(name: str) -> None:
    assert f"`{name}`" in TEXT


@pytest.mark.parametrize(
    "what", ["command", "state", "camera/{name}", "stop", "lease", "description", "alive"]
)
def test_every_key_is_documented(what: str) -> None:
    assert f"`{messages.key('{robot}', what)}`" in TEXT
