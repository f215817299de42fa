"""The token that a person gives, from a file or the environment, so that nobody else sees it."""

import logging
import os
import stat
from pathlib import Path

from pydantic import SecretStr

from app.config import Settings
from app.errors import CannotStart

log = logging.getLogger(__name__)

MAX_FILE = 4096
IN_ARGUMENTS = (
    "--token stands in the list of processes, where every user of this machine can read it; give "
    "it by --token-file FILE, or in the environment as FARHAND_TOKEN"
)


def with_given_token(settings: Settings) -> Settings:
    """The settings, with the token that ``token_file`` holds.

    Raises:
        CannotStart: the file cannot be read or is no token, or there are two tokens.
    """
    path = settings.token_file
    if path is None:
        return settings
    if settings.token is not None:
        raise CannotStart(
            f"two tokens are given, one itself and one in the file {path}; give one of them"
        )
    return settings.model_copy(update={"token": SecretStr(_read(path))})


def _read(path: Path) -> str:
    try:
        with path.open("rb") as file:
            if stat.S_IMODE(os.fstat(file.fileno()).st_mode) & 0o077:
                log.warning("the token in %s is open to other users (chmod go-rwx)", path)
            data = file.read(MAX_FILE + 1)
        text = data.decode("ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise CannotStart(f"the token in {path} cannot be read: {error}", path=str(path)) from error
    if len(data) > MAX_FILE or not text:
        what = "is empty" if not text else f"has more than {MAX_FILE} bytes"
        raise CannotStart(f"the file {path} is to hold one token, and {what}", path=str(path))
    return text
