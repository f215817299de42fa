"""Files: where the networks for hand landmarks are. They are MediaPipe's, and not part of this.

Looked for in this order: the folder of the settings, the user's own folder (``farhand models add``
fills it), and the package ``mediapipe`` where that is installed, which is not imported for it. A
file counts only when its checksum is the known one.
"""

import contextlib
import functools
import hashlib
import os
import shutil
import zipfile
from importlib.metadata import PackageNotFoundError, distribution
from importlib.resources import files
from pathlib import Path
from typing import Literal, NamedTuple

from app.errors import CannotStart, Invalid

Kind = Literal["palm", "hand"]
Size = Literal["lite", "full"]
LOCK = "mediapipe.lock"
"""Beside this file: the wheels that carry the networks, with their hashes, as pip reads them."""


class ModelFile(NamedTuple):
    """One network: its path in the package ``mediapipe``, and its SHA-256."""

    path: str
    sha256: str

    @property
    def name(self) -> str:
        """Without folders."""
        return Path(self.path).name


MODELS: dict[tuple[Kind, Size], ModelFile] = {
    ("palm", "lite"): ModelFile(
        "mediapipe/modules/palm_detection/palm_detection_lite.tflite",
        "e9a4aaddf90dda56a87235303cf00e4c2d3fb28725f68fd88772997dac905c18",
    ),
    ("palm", "full"): ModelFile(
        "mediapipe/modules/palm_detection/palm_detection_full.tflite",
        "1b14e9422c6ad006cde6581a46c8b90dd573c07ab7f3934b5589e7cea3f89a54",
    ),
    ("hand", "lite"): ModelFile(
        "mediapipe/modules/hand_landmark/hand_landmark_lite.tflite",
        "048edd3645c9bf7397d19a9f6e3a42957d6e414c9bea6598030a2e9b624156e6",
    ),
    ("hand", "full"): ModelFile(
        "mediapipe/modules/hand_landmark/hand_landmark_full.tflite",
        "11c272b891e1a99ab034208e23937a8008388cf11ed2a9d776ed3d01d0ba00e3",
    ),
}


class Found(NamedTuple):
    """A network that is there, or not.

    Attributes:
        model: Which.
        path: None when it is nowhere.
        why_not: Files of that name that are not used, and why; empty when all is well.
    """

    model: ModelFile
    path: Path | None
    why_not: str = ""


def own_folder() -> Path:
    """Where ``farhand models add`` puts them: the user's, whatever data folder a server has."""
    base = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
    return Path(base) / "farhand" / "models"


def lock_file() -> Path:
    """The pinned wheels, for pip's ``--require-hashes -r``."""
    return Path(str(files("app.pipeline.hand_landmarks").joinpath(LOCK)))


def find(kind: Kind, size: Size, folder: Path | None = None) -> Found:
    """Look for one network; ``folder`` comes before the other places."""
    model = MODELS[kind, size]
    wrong = []
    for place in _places(folder, model):
        if not place.is_file():
            continue
        if _sha256(place, place.stat().st_mtime_ns, place.stat().st_size) == model.sha256:
            return Found(model, place)
        wrong.append(f"{place} is another file than the one pinned")
    return Found(model, None, "; ".join(wrong))


def all_found(folder: Path | None = None) -> dict[tuple[Kind, Size], Found]:
    """Every network, there or not."""
    return {key: find(*key, folder) for key in MODELS}


def path_of(kind: Kind, size: Size, folder: Path | None = None) -> Path:
    """The file of one network.

    Raises:
        CannotStart: it is not there; the message says how to get it.
    """
    found = find(kind, size, folder)
    if found.path is None:
        why = found.why_not or f"{found.model.name} is not on this machine"
        raise CannotStart(f"{why}: farhand models add brings it", model=found.model.name)
    return found.path


def take_from(source: Path, folder: Path) -> list[Path]:
    """Copy the networks out of an installed package or a wheel into a folder.

    Args:
        source: A ``.whl`` file, or the folder that holds ``mediapipe/``.
        folder: Made when it is not there.

    Returns:
        The files written.

    Raises:
        Invalid: a network is not in it, or is another file than the one pinned; nothing is written.
    """
    contents = {model: _read(source, model) for model in MODELS.values()}
    for model, data in contents.items():
        if hashlib.sha256(data).hexdigest() != model.sha256:
            raise Invalid(f"{model.path} in {source} is another file than the one pinned")
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for model, data in contents.items():
        part = folder / f".{model.name}.part"
        part.write_bytes(data)
        shutil.move(part, folder / model.name)
        written.append(folder / model.name)
    return written


def _read(source: Path, model: ModelFile) -> bytes:
    try:
        if source.is_dir():
            return (source / model.path).read_bytes()
        with zipfile.ZipFile(source) as wheel:
            return wheel.read(model.path)
    except (OSError, KeyError, zipfile.BadZipFile) as error:
        raise Invalid(f"no {model.path} in {source}: {error}") from error


def _places(folder: Path | None, model: ModelFile) -> list[Path]:
    places = [own_folder() / model.name]
    if folder is not None:
        places.insert(0, folder / model.name)
    with contextlib.suppress(PackageNotFoundError):
        places.append(Path(str(distribution("mediapipe").locate_file(model.path))))
    return places


@functools.lru_cache(maxsize=32)
def _sha256(path: Path, changed: int, size: int) -> str:
    """Of a file; time and size are for the cache."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
