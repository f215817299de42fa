"""The tokens that open the server: made, kept as hashes, run out, revoked.

``DATA_DIR/tokens.json`` holds what is needed to know a token again and nothing to make one from. A
plain SHA-256 is the right hash here: a token is 256 random bits, of which nobody can try enough to
find one, so a slow hash would add nothing but a way to keep the server busy. (Slow hashes are for
passwords, which people choose.) The file is replaced as a whole and read again when it changed, so
``farhand token`` works while the server runs.
"""

import contextlib
import datetime
import errno
import fcntl
import hashlib
import hmac
import logging
import os
import secrets
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, ValidationError

from app.config import Settings
from app.errors import CannotStart, NotFound, StorageFull
from app.gateway.roles import Role

log = logging.getLogger(__name__)

TOKENS_FILE = "tokens.json"
TOKEN_BYTES = 32
"""256 bits, written in 43 characters."""
SHORT_TOKEN = 22
"""Characters; 22 of base64url are 128 bits."""
GIVEN = "given"
"""Id of the token from ``--token`` or ``FARHAND_TOKEN``, which no file holds."""
START_NAME = "printed at start"
START_LIFETIME = datetime.timedelta(days=30)
START_KEPT = 5
"""Tokens of the last so many starts stay, for each role, so that a restart signs nobody out."""

_Hash = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class Token(BaseModel):
    """What is kept of one token."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    id: str = Field(pattern=r"^[a-z0-9]{1,16}$")
    role: Role
    name: str = Field(max_length=60)
    sha256: _Hash
    cookie_sha256: _Hash
    """Of the cookie that a browser gets for the token."""
    created: AwareDatetime
    expires: AwareDatetime | None = None

    def has_expired(self, now: datetime.datetime) -> bool:
        """Whether its time is over."""
        return self.expires is not None and now >= self.expires


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    version: Literal[1] = 1
    server: str = Field(default_factory=lambda: secrets.token_hex(4), pattern=r"^[0-9a-f]{8}$")
    """Names the cookies: they do not tell ports apart, and two servers may share a machine."""
    tokens: tuple[Token, ...] = ()


class Made(NamedTuple):
    """A new token; the secret is shown once and kept nowhere."""

    secret: str
    token: Token


def sha256(text: str) -> str:
    """Hexadecimal."""
    return hashlib.sha256(text.encode("utf-8", "surrogateescape")).hexdigest()


def cookie_of(secret: str) -> str:
    """The cookie's value for a token: it proves the token, and does not give it away."""
    return hmac.new(secret.encode(), b"farhand cookie 1", hashlib.sha256).hexdigest()


def utc_now() -> datetime.datetime:
    """The time, to the second."""
    return datetime.datetime.now(datetime.UTC).replace(microsecond=0)


def _record(
    secret: str, id: str, role: Role, name: str, lifetime: datetime.timedelta | None
) -> Token:
    now = utc_now()
    return Token(
        id=id,
        role=role,
        name=name,
        sha256=sha256(secret),
        cookie_sha256=sha256(cookie_of(secret)),
        created=now,
        expires=None if lifetime is None else now + lifetime,
    )


class TokenStore:
    """All tokens of one server.

    Looking one up compares hashes of what was sent, by way of a dict: whatever its timing tells is
    about a hash that a guesser cannot steer.

    Args:
        path: The file; need not exist.
        given: An operator's token that no file holds.
        now: The time in UTC.
    """

    def __init__(
        self,
        path: Path,
        given: str | None = None,
        now: Callable[[], datetime.datetime] = utc_now,
    ) -> None:
        self._path = path
        self._now = now
        self._given = None
        if given is not None:
            self._given = _record(given, GIVEN, "operator", "given when started", None)
        self._stamp: tuple[int, ...] | None = ()
        self._tokens: dict[str, Token] = {}
        self._cookies: dict[str, Token] = {}
        self._ids: dict[str, Token] = {}

    @classmethod
    def from_settings(cls, settings: Settings, given: str | None = None) -> "TokenStore":
        """The store of a server with these settings; ``given`` in place of the settings' token.

        Raises:
            CannotStart: the token given is empty or cannot be sent, or the file cannot be read.
        """
        if given is None and settings.token is not None:
            given = settings.token.get_secret_value()
        if given is not None:
            if not given or not given.isascii() or not given.isprintable() or " " in given:
                raise CannotStart("the token must be printable ASCII without spaces, and not empty")
            if len(given) < SHORT_TOKEN:
                log.warning(
                    "the token is short; %d characters or more resist guessing", SHORT_TOKEN
                )
        store = cls(settings.data_dir / TOKENS_FILE, given)
        store.list()
        return store

    @property
    def server(self) -> str:
        """Eight characters that name this server's cookies."""
        try:
            return self._read().server
        except FileNotFoundError:
            return sha256(str(self._path.absolute()))[:8]

    def by_secret(self, secret: str) -> Token | None:
        """The token that is this secret, unless it has run out or was revoked."""
        return self._alive(self._current(self._tokens).get(sha256(secret)))

    def by_cookie(self, value: str) -> Token | None:
        """The token that this cookie was made for."""
        return self._alive(self._current(self._cookies).get(sha256(value)))

    def by_id(self, id: str) -> Token | None:
        """The token with this id, if it still opens anything."""
        return self._alive(self._current(self._ids).get(id))

    def is_alive(self, id: str) -> bool:
        """Whether a token still opens anything."""
        return self.by_id(id) is not None

    def list(self) -> tuple[Token, ...]:
        """Tokens of the file, also those that have run out.

        Raises:
            CannotStart: the file cannot be read.
        """
        with self._usable():
            try:
                return self._read().tokens
            except FileNotFoundError:
                return ()

    def make(
        self,
        role: Role,
        name: str,
        lifetime: datetime.timedelta | None = None,
        *,
        keep: int | None = None,
    ) -> Made:
        """Make a token; with ``keep`` only the newest so many of this name and role stay.

        Raises:
            CannotStart: the file cannot be read or written.
        """
        secret = secrets.token_urlsafe(TOKEN_BYTES)
        token = _record(secret, secrets.token_hex(4), role, name, lifetime)

        def change(tokens: tuple[Token, ...]) -> tuple[Token, ...]:
            now = self._now()
            kept = [each for each in tokens if not each.has_expired(now)]
            if keep is not None:
                alike = [each for each in kept if (each.role, each.name) == (role, name)]
                old = alike[: max(0, len(alike) - keep + 1)]
                kept = [each for each in kept if each not in old]
            return (*kept, token)

        self._change(change)
        return Made(secret, token)

    def revoke(self, id: str) -> Token:
        """Take a token back; what it opened is closed within a second.

        Raises:
            NotFound: there is none with this id.
            CannotStart: the file cannot be read or written.
        """
        found: list[Token] = []

        def change(tokens: tuple[Token, ...]) -> tuple[Token, ...]:
            found.extend(each for each in tokens if each.id == id)
            if not found:
                raise NotFound(f"there is no token {id[:40]!r}; see farhand token list", id=id[:40])
            return tuple(each for each in tokens if each.id != id)

        self._change(change)
        return found[0]

    def _alive(self, token: Token | None) -> Token | None:
        return None if token is None or token.has_expired(self._now()) else token

    def _current(self, index: dict[str, Token]) -> dict[str, Token]:
        """``index``, after reading the file again if it changed."""
        try:
            found = self._path.stat()
            stamp: tuple[int, ...] | None = (found.st_mtime_ns, found.st_size, found.st_ino)
        except OSError:
            stamp = None
        if stamp != self._stamp:
            self._stamp = stamp
            tokens: tuple[Token, ...] = ()
            if stamp is not None:
                try:
                    tokens = self._read().tokens
                except (OSError, ValueError):
                    # In doubt nobody comes in.
                    log.exception("%s cannot be read: its tokens open nothing", self._path)
            self._fill((*tokens, self._given) if self._given is not None else tokens)
        return index

    def _fill(self, tokens: tuple[Token, ...]) -> None:
        for index, key in (
            (self._tokens, "sha256"),
            (self._cookies, "cookie_sha256"),
            (self._ids, "id"),
        ):
            index.clear()
            index.update((getattr(token, key), token) for token in tokens)

    def _read(self) -> _File:
        return _File.model_validate_json(self._path.read_bytes())

    def _change(self, change: Callable[[tuple[Token, ...]], tuple[Token, ...]]) -> None:
        """Replace the file as a whole; of several at once, one after another."""
        with self._usable():
            self._path.parent.mkdir(parents=True, exist_ok=True)
            lock = os.open(
                self._path.with_suffix(".lock"), os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600
            )
            try:
                fcntl.flock(lock, fcntl.LOCK_EX)
                try:
                    before = self._read()
                except FileNotFoundError:
                    before = _File()
                after = before.model_copy(update={"tokens": change(before.tokens)})
                new = self._path.with_suffix(f".{secrets.token_hex(4)}")
                handle = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
                try:
                    with os.fdopen(handle, "w") as file:
                        file.write(after.model_dump_json(indent=1) + "\n")
                        file.flush()
                        os.fsync(file.fileno())
                    new.replace(self._path)
                finally:
                    new.unlink(missing_ok=True)
            finally:
                os.close(lock)

    @contextlib.contextmanager
    def _usable(self) -> Iterator[None]:
        try:
            yield
        except (OSError, ValidationError) as error:
            if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
                raise StorageFull(
                    f"the disk that holds the tokens in {self._path} is full; nothing was changed: "
                    "free some space and try again"
                ) from error
            what = "is damaged" if isinstance(error, ValidationError) else f"({error})"
            raise CannotStart(
                f"the tokens in {self._path} cannot be used: the file {what}; "
                "delete it to have new ones made, or choose another --data-dir",
                path=str(self._path),
            ) from error
