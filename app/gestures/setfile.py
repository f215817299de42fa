"""The exchange format: a folder, or a zip of one, with ``gestures.toml`` and one-bit PNG files.

::

    format = 1

    [[gesture]]
    name = "forward"
    action = { type = "jog_cartesian", frame = "base", linear = [0.1, 0.0, 0.0] }
    samples = ["forward/01.png", "forward/02.png"]

Sample paths are relative to ``gestures.toml``, with forward slashes, and stay below it. Actions
are those of :mod:`app.link.actions`. ``active = false`` marks a gesture that is not matched. In
format 2 ``landmarks`` may name a file of 254 bytes for each sample, as the database keeps them, or
``""`` where it has none. Nothing else is allowed: what is misspelt is refused, not ignored.
"""

import json
import struct
import tomllib
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Any

from pydantic import ValidationError

from app.errors import Invalid
from app.gestures.archive import ZIP_MAX_BYTES, Archive
from app.gestures.png import PNG_MAX_BYTES, read_template
from app.gestures.records import (
    LANDMARK_BYTES,
    MAX_GESTURES,
    MAX_SAMPLES,
    NewGesture,
    checked_entry,
    clean_name,
    name_key,
)
from app.gestures.toml_limits import check_simple
from app.link.actions import ACTION, Action

FORMATS = (1, 2)
"""2 where a gesture has landmarks; older Farhands read 1 alone."""
INDEX = "gestures.toml"
INDEX_MAX_BYTES = 1 << 20

Read = Callable[[str, int], bytes]
"""Gives the bytes of a file in the set by its path; refuses more than the given number."""
Progress = Callable[[int, int], None]
"""Told how much is done, of how much; what it raises ends the work."""


def read_set(source: Path) -> list[NewGesture]:
    """Read a set of gestures from a folder or a zip file.

    Raises:
        Invalid: missing, damaged, or not exactly in the format; says where and why.
    """
    if not source.exists():
        raise Invalid(f"{source} does not exist; name a folder with {INDEX} in it, or a zip of one")
    with _plain_errors(source):
        if source.is_dir():
            return _parse(_folder_reader(source))
        if source.stat().st_size > ZIP_MAX_BYTES:
            raise Invalid(f"{source} is larger than {ZIP_MAX_BYTES >> 20} MiB")
        return _parse(_zip_reader(Archive(source.read_bytes())))


def read_zip(data: bytes, progress: Progress | None = None) -> list[NewGesture]:
    """Read a set of gestures from the bytes of a zip file.

    Args:
        data: The whole file.
        progress: Told how many gestures are read, and how many there are.

    Raises:
        Invalid: damaged, or not exactly in the format; says where and why.
    """
    with _plain_errors("the file"):
        return _parse(_zip_reader(Archive(data)), progress)


@contextmanager
def _plain_errors(source: object) -> Iterator[None]:
    try:
        yield
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, struct.error) as error:
        raise _unreadable(source, error) from error
    except (OSError, EOFError, RuntimeError, ValueError) as error:
        # What zipfile raises for passwords, impossible offsets and names in no encoding, and the
        # file system for names that are too long or files that may not be read.
        raise _unreadable(source, error) from error


def _unreadable(source: object, error: Exception) -> Invalid:
    reason = " ".join(str(error).split())
    return Invalid(f"{source} is neither a readable folder nor a readable zip file: {reason}")


def _parse(read: Read, progress: Progress | None = None) -> list[NewGesture]:
    try:
        text = read(INDEX, INDEX_MAX_BYTES).decode()
        check_simple(text)
        index = tomllib.loads(text)
    except Invalid as error:
        raise Invalid(f"{INDEX} {error.message}".replace(f"{INDEX} {INDEX}", INDEX)) from error
    except (ValueError, RecursionError) as error:
        raise Invalid(f"{INDEX} is not TOML in UTF-8: {error}") from error
    if index.get("format") not in FORMATS or isinstance(index["format"], bool):
        raise Invalid(
            f"{INDEX} has format {index.get('format')!r}; this Farhand reads formats 1 and 2"
        )
    _no_others(index, ("format", "gesture"), INDEX)
    tables = index.get("gesture", [])
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        raise Invalid(f"{INDEX}: gestures are written as [[gesture]], with two brackets")
    if len(tables) > MAX_GESTURES:
        raise Invalid(f"{INDEX} has {len(tables)} gestures; at most {MAX_GESTURES} are allowed")
    gestures: list[NewGesture] = []
    names: dict[str, str] = {}
    for number, table in enumerate(tables, start=1):
        gesture = _gesture(read, table, f"{INDEX}, gesture {number}")
        first = names.setdefault(name_key(gesture.name), gesture.name)
        if len(names) < number:
            raise Invalid(
                f"{INDEX}, gesture {number}: the name {gesture.name!r} is taken by {first!r}"
            )
        gestures.append(gesture)
        if progress is not None:
            progress(number, len(tables))
    return gestures


def _gesture(read: Read, table: dict[str, Any], where: str) -> NewGesture:
    name, samples = table.get("name"), table.get("samples")
    if not isinstance(name, str):
        raise Invalid(f"{where}: name is missing, or is not a text")
    try:
        name = clean_name(name)
    except Invalid as error:
        raise Invalid(f"{where}: {error.message}") from error
    where = f"{where} ({name})"
    _no_others(table, ("name", "action", "active", "samples", "landmarks"), where)
    active = table.get("active", True)
    if not isinstance(active, bool):
        raise Invalid(f"{where}: active is true or false, not {active!r}")
    if not isinstance(samples, list) or not all(isinstance(path, str) for path in samples):
        raise Invalid(f"{where}: samples is missing, or is not a list of paths")
    if len(samples) > MAX_SAMPLES:
        raise Invalid(f"{where}: {len(samples)} samples given; a gesture may have {MAX_SAMPLES}")
    action = _action(table.get("action"), where)
    templates = []
    for path in samples:
        try:
            templates.append(read_template(read(_safe(path), PNG_MAX_BYTES)))
        except Invalid as error:
            raise Invalid(f"{where}: sample {path!r} {error.message}") from error
    hands = _landmarks(read, table.get("landmarks", []), where)
    entry = NewGesture(name, action, tuple(templates), active, hands)
    try:
        return checked_entry(entry)
    except Invalid as error:
        raise Invalid(f"{where}: {error.message}") from error


def _landmarks(read: Read, paths: Any, where: str) -> tuple[bytes | None, ...]:
    """What the files of a gesture's landmarks hold; an empty path stands for none."""
    if not isinstance(paths, list) or not all(isinstance(path, str) for path in paths):
        raise Invalid(f"{where}: landmarks is not a list of paths")
    hands: list[bytes | None] = []
    for path in paths:
        try:
            hands.append(read(_safe(path), LANDMARK_BYTES) if path else None)
        except Invalid as error:
            raise Invalid(f"{where}: landmarks {path!r} {error.message}") from error
    return tuple(hands)


def _action(value: Any, where: str) -> Action:
    try:
        # By way of JSON, so that the file obeys exactly the rules of the REST interface.
        return ACTION.validate_json(json.dumps(value, allow_nan=False), strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        raise Invalid(
            f"{where}: bad action: {place}: {first['msg']}".replace(": :", ":")
        ) from error
    except (TypeError, ValueError) as error:
        raise Invalid(f"{where}: bad action: {error}") from error


def _no_others(table: dict[str, Any], allowed: tuple[str, ...], where: str) -> None:
    others = sorted(set(table) - set(allowed))
    if others:
        raise Invalid(f"{where}: unknown key {others[0]!r}; allowed are {', '.join(allowed)}")


def _safe(path: str) -> str:
    """The path itself, once it is known to lead to a place below the set's folder."""
    parts = PurePosixPath(path).parts
    plain = path and path == "/".join(parts) and not path.startswith("/") and path.isprintable()
    if not plain or ".." in parts or any(sign in path for sign in '\\:*?"<>|'):
        raise Invalid("is not a plain path below the set's folder, such as 'forward/01.png'")
    return path


def _folder_reader(folder: Path) -> Read:
    root = folder.resolve()

    def read(path: str, limit: int) -> bytes:
        file = (root / path).resolve()
        if not file.is_relative_to(root):
            raise Invalid("leads out of the set's folder")
        if not file.is_file():
            raise Invalid(_missing(path, folder))
        with file.open("rb") as stream:
            return _limited(stream.read(limit + 1), limit)

    return read


def _zip_reader(archive: Archive) -> Read:
    # The set may lie in one folder inside the zip, as file managers pack it.
    tops = [name for name in archive.names if PurePosixPath(name).name == INDEX]
    prefix = min(tops, key=len)[: -len(INDEX)] if tops else ""

    def read(path: str, limit: int) -> bytes:
        try:
            return archive.read(prefix + path, limit)
        except KeyError:
            raise Invalid(_missing(path, "the zip file")) from None

    return read


def _missing(path: str, place: object) -> str:
    return f"{INDEX} is missing in {place}" if path == INDEX else f"is missing in {place}"


def _limited(data: bytes, limit: int) -> bytes:
    if len(data) > limit:
        raise Invalid(f"is larger than {limit} bytes")
    return data
