"""Writing a set in the exchange format of setfile.py: a folder, a zip file, or a stream of one."""

import io
import json
import os
import re
import shutil
import tempfile
import unicodedata
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from app.errors import Invalid
from app.gestures.png import template_png
from app.gestures.records import NewGesture
from app.gestures.setfile import INDEX
from app.link.actions import ACTION


def write_set(gestures: Iterable[NewGesture], target: Path) -> None:
    """Write a set to a new folder, or to a zip file when ``target`` ends in ``.zip``.

    The same gestures give the same bytes. Whole or not at all: the files are written beside the
    target and put in place by one renaming.

    Raises:
        Invalid: the target exists (an empty folder may), or its parent does not.
        OSError: the disk does not take it.
    """
    zipped = target.suffix.lower() == ".zip"
    if target.exists() and (zipped or not target.is_dir() or any(target.iterdir())):
        raise Invalid(f"{target} exists already; name a new folder or zip file")
    if not target.absolute().parent.is_dir():
        raise Invalid(f"the folder {target.absolute().parent} does not exist; make it first")
    files = _files(gestures)
    staging = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.absolute().parent))
    try:
        if zipped:
            path = staging / "set.zip"
            with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
                for name, data in files.items():
                    _add(archive, name, data)
            os.replace(path, target)
        else:
            whole = staging / "set"  # of the process's own modes, other than what mkdtemp makes
            whole.mkdir()
            for name, data in files.items():
                (whole / name).parent.mkdir(exist_ok=True)
                (whole / name).write_bytes(data)
            os.replace(whole, target)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def zip_stream(gestures: Sequence[NewGesture]) -> Iterator[bytes]:
    """A set as the pieces of a zip file, one by one: what is made is not kept.

    Who stops asking ends it. The same gestures give the same bytes.
    """
    sink = _Sink()
    with zipfile.ZipFile(sink, "w", zipfile.ZIP_DEFLATED) as archive:
        index = [f"format = {_format(gestures)}\n"]
        taken: set[str] = set()
        for gesture in gestures:
            part, files = _part(gesture, taken)
            index.append(part)
            for name, data in files.items():
                _add(archive, name, data)
            yield sink.take()
        _add(archive, INDEX, "".join(index).encode())
    yield sink.take()


class _Sink(io.RawIOBase):
    """A file that is only written to: holds what nobody has taken yet."""

    def __init__(self) -> None:
        self._parts = bytearray()

    def writable(self) -> bool:
        """As files say it."""
        return True

    def write(self, data: Any) -> int:
        """Add bytes."""
        self._parts += data
        return len(data)

    def take(self) -> bytes:
        """What was written since the last time."""
        taken = bytes(self._parts)
        self._parts.clear()
        return taken


def _add(archive: zipfile.ZipFile, name: str, data: bytes) -> None:
    # A fixed time (the format's earliest) keeps equal sets equal to the byte.
    info = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
    archive.writestr(info, data)


def _format(gestures: Iterable[NewGesture]) -> int:
    """1 as long as that is enough, so that older Farhands read the set."""
    return 2 if any(gesture.landmarks for gesture in gestures) else 1


def _files(given: Iterable[NewGesture]) -> dict[str, bytes]:
    gestures = list(given)
    files: dict[str, bytes] = {}
    index = [f"format = {_format(gestures)}\n"]
    taken: set[str] = set()
    for gesture in gestures:
        part, samples = _part(gesture, taken)
        index.append(part)
        files.update(samples)
    return {INDEX: "".join(index).encode(), **files}


def _part(gesture: NewGesture, taken: set[str]) -> tuple[str, dict[str, bytes]]:
    """A gesture's part of the index, and its files; its folder is in ``taken`` afterwards."""
    folder = _slug(gesture.name, taken)
    digits = max(2, len(str(len(gesture.templates))))
    samples = [f"{folder}/{n:0{digits}}.png" for n in range(1, len(gesture.templates) + 1)]
    files = dict(zip(samples, map(template_png, gesture.templates), strict=True))
    hands: list[str] = []
    for sample, landmarks in zip(samples, gesture.landmarks, strict=bool(gesture.landmarks)):
        hands.append("" if landmarks is None else sample.removesuffix(".png") + ".hand")
        if landmarks is not None:
            files[hands[-1]] = landmarks
    action = ACTION.dump_python(gesture.action, mode="json", exclude_none=True)
    part = (
        f"\n[[gesture]]\nname = {_toml(gesture.name)}\naction = {_toml(action)}\n"
        f"{'' if gesture.active else f'active = false{chr(10)}'}"
        f"samples = {_list(samples)}\n"
    )
    if hands:
        part += f"landmarks = {_list(hands)}\n"
    return part, files


def _list(paths: Iterable[str]) -> str:
    """A list of texts in TOML, one a line."""
    return "[\n" + "".join(f"  {_toml(path)},\n" for path in paths) + "]"


def _slug(name: str, taken: set[str]) -> str:
    """A file name of a to z, 0 to 9 and hyphens that is not in ``taken``, and is then."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    base = re.sub(r"[^a-z0-9]+", "-", plain).strip("-") or "gesture"
    slug, number = base, 1
    while slug in taken:
        number += 1
        slug = f"{base}-{number}"
    taken.add(slug)
    return slug


def _toml(value: Any) -> str:
    """A value in TOML on one line. JSON's strings, numbers and words are TOML's, too."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False)
