"""docs/robots.md tells of every key of a profile and of every shipped one."""

from pathlib import Path

import pytest

from app.robot.models import model_names
from app.robot.models.profile import _PARTS

TEXT = (Path(__file__).parents[3] / "docs" / "robots.md").read_text()
FIELDS = sorted({name for part in _PARTS for name in part.model_fields})


@pytest.mark.parametrize("name", FIELDS)
def test_every_key_is_documented(name: str) -> None:
    rows = [line.split("|")[1] for line in TEXT.splitlines() if line.startswith("| `")]
    assert any(f"`{name}`" in row for row in rows)


@pytest.mark.parametrize("name", model_names())
def test_every_profile_is_documented(name: str) -> None:
    assert f"| `{name}` |" in TEXT
