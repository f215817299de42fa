"""The files of a model, ready for a loader: a URDF whose meshes are found.

The URDF in this package names its meshes ``package://rtbdata/...``, as ROS does. Loaders find those
nowhere, and Bullet reads only binary STL files, while most of rtb-data's are text. So a copy is
made once, in the user's cache folder: the URDF with plain relative paths, and the meshes written
anew. The folder's name carries a hash of what went in.
"""

import atexit
import hashlib
import logging
import os
import re
import shutil
import tempfile
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.errors import CannotStart
from app.robot.models.model import Model, load_model, model_folder

_log = logging.getLogger(__name__)

_MESH = re.compile(r'"package://([^/"]+)/([^"]+)"')
_TRIANGLE = np.dtype(
    [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")], align=False
)


class ModelAssets(NamedTuple):
    """A model, and where a loader finds its URDF."""

    model: Model
    urdf_path: Path
    """Absolute. Its meshes are named relative to it: Bullet, yourdfpy and trimesh load it as is."""


@lru_cache
def model_assets(name: str) -> ModelAssets:
    """The model ``name`` with a URDF that can be loaded.

    Raises:
        CannotStart: there is no such model, or the package with its meshes is not installed.
    """
    model = load_model(name)
    urdf = (model_folder(name) / model.urdf).read_text("utf-8")
    meshes = {match[0]: _find_mesh(match[1], match[2]) for match in _MESH.finditer(urdf)}
    digest = hashlib.sha256(urdf.encode())
    for path in meshes.values():
        digest.update(path.read_bytes())
    folder = _cache_folder() / f"{name}-{digest.hexdigest()[:16]}"
    if not (folder / model.urdf).is_file():
        folder = _build(folder, model.urdf, urdf, meshes)
    return ModelAssets(model, folder / model.urdf)


def _find_mesh(package: str, relative: str) -> Path:
    spec = find_spec(package)
    for folder in (spec.submodule_search_locations or ()) if spec else ():
        path = Path(folder) / relative
        if path.is_file():
            return path
    raise CannotStart(
        f"the mesh {relative} of the Python package {package} is missing; "
        "install Farhand anew with all its dependencies (pip install rtb-data)",
        package=package,
        file=relative,
    )


def _cache_folder() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "farhand" / "models"


def _build(folder: Path, file: str, urdf: str, meshes: dict[str, Path]) -> Path:
    """Write the copy beside ``folder`` and move it there whole; returns where it is."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=".new-", dir=folder.parent))
    except OSError as error:
        # A home folder that cannot be written (a container): keep it for this process only.
        draft = Path(tempfile.mkdtemp(prefix="farhand-model-"))
        atexit.register(shutil.rmtree, draft, ignore_errors=True)
        _log.info("the model is kept in %s: %s", draft, error)
        folder = draft
    (draft / "meshes").mkdir()
    for name, path in meshes.items():
        mesh = f"meshes/{path.stem}.stl"
        (draft / mesh).write_bytes(write_stl(read_stl(path)))
        urdf = urdf.replace(name, f'"{mesh}"')
    (draft / file).write_text(urdf, "utf-8")
    if draft != folder:
        try:
            draft.rename(folder)
        except OSError:  # another process was faster; its copy is the same
            shutil.rmtree(draft, ignore_errors=True)
    return folder


def read_stl(path: Path) -> NDArray[np.float32]:
    """The corners (shape (n, 3, 3)) of the triangles of an STL file, text or binary.

    Raises:
        CannotStart: the file is not an STL file.
    """
    raw = path.read_bytes()
    count = int.from_bytes(raw[80:84], "little")
    if count and len(raw) == 84 + count * _TRIANGLE.itemsize:
        return np.asarray(np.frombuffer(raw, _TRIANGLE, count, 84)["corners"])
    numbers = [line.split()[1:] for line in raw.split(b"\n") if b"vertex" in line]
    try:
        corners = np.array(numbers, dtype=np.float32).reshape(-1, 3, 3)
    except ValueError:
        corners = np.empty((0, 3, 3), np.float32)
    if not len(corners):
        raise CannotStart(f"{path} is not an STL file", file=str(path))
    return corners


def write_stl(corners: NDArray[np.float32]) -> bytes:
    """Triangles (shape (n, 3, 3)) as a binary STL file that every reader accepts.

    The header is zeros (one that begins with ``solid`` reads as text); triangles without an area
    are left out.
    """
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    keep = length > 1e-12
    triangles = np.zeros(int(keep.sum()), _TRIANGLE)
    triangles["corners"] = corners[keep]
    triangles["normal"] = normals[keep] / length[keep, None]
    return bytes(80) + len(triangles).to_bytes(4, "little") + bytes(triangles.tobytes())
