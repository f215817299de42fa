"""Tokens: made, kept as hashes, run out, revoked, by several processes at once."""

import datetime
import json
import os
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from pydantic import SecretStr

from app.config import Settings
from app.errors import CannotStart, NotFound
from app.gateway.tokens import GIVEN, TokenStore, cookie_of, utc_now

DAY = datetime.timedelta(days=1)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "data" / "tokens.json"


def test_a_token_is_long_and_only_its_hashes_are_kept(path: Path) -> None:
    secret, token = TokenStore(path).make("observer", "Anna")
    assert len(secret) == 43
    text = path.read_text()
    assert secret not in text
    assert cookie_of(secret) not in text
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    store = TokenStore(path)
    assert store.by_secret(secret) == token
    assert store.by_cookie(cookie_of(secret)) == token
    assert (token.role, token.name, token.expires) == ("observer", "Anna", None)
    # Neither hash is good for anything by itself.
    for value in (token.sha256, token.cookie_sha256, "", secret[:-1], cookie_of(secret)):
        assert store.by_secret(value) is None
    for value in (token.sha256, token.cookie_sha256, "", secret):
        assert store.by_cookie(value) is None


def test_another_process_makes_and_revokes_while_we_run(path: Path) -> None:
    here, there = TokenStore(path), TokenStore(path)
    assert here.by_secret("x") is None
    secret, token = there.make("operator", "tablet")
    assert here.by_secret(secret) == token
    there.revoke(token.id)
    assert here.by_secret(secret) is None
    assert not here.is_alive(token.id)
    path.unlink()
    assert here.list() == ()


def test_a_token_ends_when_its_time_is_over(path: Path) -> None:
    now = [utc_now()]
    store = TokenStore(path, now=lambda: now[0])
    secret, token = store.make("operator", "", DAY)
    now[0] += DAY - datetime.timedelta(seconds=2)
    assert store.is_alive(token.id)
    now[0] += datetime.timedelta(seconds=4)
    assert not store.is_alive(token.id)
    assert store.by_secret(secret) is None
    assert store.by_cookie(cookie_of(secret)) is None
    # It is listed until something else is made.
    assert store.list() == (token,)
    store.make("operator", "")
    assert token not in store.list()


def test_only_the_newest_of_one_name_stay(path: Path) -> None:
    store = TokenStore(path)
    other = store.make("observer", "start").token
    ids = [store.make("operator", "start", keep=2).token.id for _ in range(4)]
    assert [token.id for token in store.list()] == [other.id, *ids[2:]]


def test_the_given_token_is_an_operators_and_is_not_written(path: Path) -> None:
    store = TokenStore(path, "secret")
    token = store.by_secret("secret")
    assert token is not None
    assert (token.id, token.role) == (GIVEN, "operator")
    assert store.by_cookie(cookie_of("secret")) == token
    assert not path.parent.exists()
    # Tokens of the file open as well.
    assert TokenStore(path).make("observer", "").token == store.list()[0]


@pytest.mark.parametrize("token", ["", "two words", "grün", "tab\t"])
def test_a_token_that_cannot_be_sent_is_refused(tmp_path: Path, token: str) -> None:
    with pytest.raises(CannotStart, match="printable ASCII without spaces"):
        TokenStore.from_settings(Settings(data_dir=tmp_path, token=SecretStr(token)))


def test_a_short_token_is_warned_of(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    TokenStore.from_settings(Settings(data_dir=tmp_path), "abc")
    assert "the token is short" in caplog.text
    assert "abc" not in caplog.text


@pytest.mark.parametrize(
    "content", [b"", b"{", b"[]", b'{"version": 2}', b"\xff\xfe", b'{"version":1,"tokens":[{}]}']
)
def test_a_damaged_file_opens_nothing(path: Path, content: bytes) -> None:
    store = TokenStore(path, "given")
    secret = store.make("operator", "").secret
    assert store.by_secret(secret) is not None
    path.write_bytes(content)
    assert store.by_secret(secret) is None
    # The one given at the start still does.
    assert store.by_secret("given") is not None
    with pytest.raises(CannotStart, match="damaged; delete it"):
        TokenStore.from_settings(Settings(data_dir=path.parent))
    with pytest.raises(CannotStart, match="damaged"):
        store.make("operator", "")
    assert path.read_bytes() == content


def test_a_data_folder_that_cannot_be_made_is_one_clear_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    store = TokenStore(tmp_path / "file" / "data" / "tokens.json")
    with pytest.raises(CannotStart, match="choose another --data-dir"):
        store.make("operator", "")


def test_revoking_what_is_not_there_is_told(path: Path) -> None:
    with pytest.raises(NotFound, match="there is no token 'nobody'"):
        TokenStore(path).revoke("nobody")


def test_many_at_once_lose_none(path: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        made = list(pool.map(lambda n: TokenStore(path).make("observer", str(n)), range(40)))
    store = TokenStore(path)
    assert len(store.list()) == 40
    assert all(store.by_secret(each.secret) == each.token for each in made)
    # Nothing is left beside the file and its lock.
    assert sorted(os.listdir(path.parent)) == ["tokens.json", "tokens.lock"]


def test_the_servers_name_stays(path: Path) -> None:
    before = TokenStore(path).server
    assert before == TokenStore(path).server
    TokenStore(path).make("operator", "")
    name = TokenStore(path).server
    TokenStore(path).make("operator", "")
    assert TokenStore(path).server == name == json.loads(path.read_text())["server"]
