"""The token that a person gives, and who else sees it."""

import logging
from pathlib import Path

import pytest
from pydantic import SecretStr

from app.config import Settings
from app.errors import CannotStart
from app.gateway.given_token import with_given_token


def given(path: Path, token: str | None = None) -> str | None:
    secret = None if token is None else SecretStr(token)
    found = with_given_token(Settings(token=secret, token_file=path)).token
    return None if found is None else found.get_secret_value()


def test_it_comes_from_a_file_that_others_cannot_read(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "token"
    path.write_text("a-token-of-mine-0123456789\n")
    path.chmod(0o600)
    assert given(path) == "a-token-of-mine-0123456789"
    assert not caplog.records
    path.chmod(0o644)
    with caplog.at_level(logging.WARNING):
        assert given(path) == "a-token-of-mine-0123456789"
    assert "is open to other users (chmod go-rwx)" in caplog.text
    assert "a-token-of-mine" not in caplog.text
    assert with_given_token(Settings()).token is None


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"", "is empty"),
        (b" \n", "is empty"),
        (b"x" * 5000, "more than 4096 bytes"),
        (b"\xff", "cannot be read"),
        (None, "cannot be read"),
    ],
)
def test_a_file_that_holds_none_is_told(tmp_path: Path, content: bytes | None, why: str) -> None:
    path = tmp_path / "token"
    if content is not None:
        path.write_bytes(content)
        path.chmod(0o600)
    with pytest.raises(CannotStart, match=why):
        given(path)


def test_two_tokens_are_one_too_many(tmp_path: Path) -> None:
    with pytest.raises(CannotStart, match="two tokens"):
        given(tmp_path / "token", "another")
