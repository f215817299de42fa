"""Finding and reading profiles, with errors that name the file and the line."""

import difflib
import tomllib
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from app.errors import CannotStart
from app.robot.models import lines
from app.robot.models.model import (
    AtKey,
    AttachmentModel,
    CameraModel,
    GripperModel,
    JointModel,
    MobileBaseModel,
    Model,
    ObjectModel,
    WorkspaceModel,
)

FILE = "model.toml"
_PARTS = (
    Model,
    JointModel,
    GripperModel,
    MobileBaseModel,
    AttachmentModel,
    CameraModel,
    ObjectModel,
    WorkspaceModel,
)
_KEYS = sorted({name for part in _PARTS for name in part.model_fields})


class Profile:
    """A profile that was read, and where in its file each key stands.

    Args:
        name: Short: of the folder for those that come with Farhand, else of the file.
        path: The file.

    Raises:
        CannotStart: the file cannot be read, or is not right; the message begins with FILE:LINE.
    """

    def __init__(self, name: str, path: Path) -> None:
        self.name, self.path = name, path
        self._lines: dict[lines.Path, int] = {(): 1}
        try:
            text = path.read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8"
            raise CannotStart(
                f"the robot profile {path} cannot be read: {reason}", file=str(path)
            ) from error
        try:
            raw = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            line = lines.syntax_line(error)
            raise CannotStart(
                f"{path}:{line}: this is not TOML: {error}", file=str(path), line=line
            ) from error
        self._lines = lines.key_lines(text)
        try:
            self.model = Model.model_validate(raw)
        except ValidationError as error:
            raise self._wrong_of(error) from error

    @property
    def folder(self) -> Path:
        """Where the files that it names are looked for."""
        return self.path.parent

    def wrong(self, message: str, *path: str | int, more: int = 0) -> CannotStart:
        """The error for the key at ``path``: FILE:LINE, and what is wrong."""
        line = lines.line_of(self._lines, path)
        rest = f" (and {more} more)" if more else ""
        return CannotStart(
            f"{self.path}:{line}: {message}{rest}",
            file=str(self.path),
            line=line,
            key=_dotted(path),
        )

    def _wrong_of(self, error: ValidationError) -> CannotStart:
        found = [_explain(dict(one)) for one in error.errors()]
        # A key that is spelt wrongly first: it explains the one that is missing.
        message, path = min(
            found,
            key=lambda one: (
                not one[0].startswith("unknown key"),
                lines.line_of(self._lines, one[1]),
            ),
        )
        return self.wrong(message, *path, more=len(found) - 1)


def _explain(error: dict[str, Any]) -> tuple[str, lines.Path]:
    """What is wrong, in plain words, and at which key."""
    path: lines.Path = tuple(error["loc"])
    cause = error.get("ctx", {}).get("error")
    if isinstance(cause, AtKey):
        return str(cause), (*path, *cause.path)
    match error["type"]:
        case "extra_forbidden":
            near = difflib.get_close_matches(str(path[-1]), _KEYS, 1)
            hint = f"; did you mean {near[0]}?" if near else ""
            return f"unknown key {_dotted(path)}{hint}", path
        case "missing":
            return f"the key {_dotted(path)} is missing", path
    told = str(error["msg"]).removeprefix("Value error, ")
    given = repr(error["input"])
    return f"{_dotted(path)}: {told}, not {given[:80]}", path


def _dotted(path: lines.Path) -> str:
    """``joints[1].lower``, counted from 1 as people do."""
    text = ""
    for part in path:
        text += f"[{part + 1}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def model_folder(name: str) -> Path:
    """Where the files of the profile ``name`` that comes with Farhand are."""
    return Path(str(resources.files("app.robot.models"))) / name


def model_names() -> list[str]:
    """The profiles that come with Farhand."""
    return sorted(path.parent.name for path in model_folder("").glob(f"*/{FILE}"))


@lru_cache
def load_profile(name: str) -> Profile:
    """Read the profile ``name``: one that comes with Farhand, or a file.

    Raises:
        CannotStart: there is no such profile, or its file is not right.
    """
    names = model_names()
    if name in names:
        return Profile(name, model_folder(name) / FILE)
    path = Path(name).expanduser()
    if not (path.suffix == ".toml" or path.is_file()):
        raise CannotStart(
            f"there is no robot model {name!r}; there are: {', '.join(names)}; "
            "or give the path of a profile, FILE.toml",
            model=name,
        )
    path = path.absolute()
    return Profile(path.parent.name if path.name == FILE else path.stem, path)


def load_model(name: str) -> Model:
    """The model of the profile ``name``, as :func:`load_profile`."""
    return load_profile(name).model
