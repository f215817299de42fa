"""The files of a profile, ready for a loader: one URDF whose meshes are found.

URDFs name their meshes ``package://...``, as ROS does. Loaders find those nowhere, and Bullet reads
only binary STL files, while many are text. So a copy is made once, in the user's cache folder: the
URDF, with what hangs on it, with plain relative paths, and beside it the meshes. The folder's name
carries a hash of what went in.
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
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from app.errors import CannotStart
from app.link.messages import Description
from app.robot.models.check import check
from app.robot.models.model import AtKey, AttachmentModel, Model
from app.robot.models.profile import Profile, load_profile
from app.robot.models.urdf import Urdf, mesh_line, parse_urdf, read_urdf
from app.scratch import ScratchFolder

_log = logging.getLogger(__name__)

_PACKAGE = re.compile(r"package://([^/]+)/(.+)")
_BESIDE = re.compile(rb"(?:^|\n)\s*(?:mtllib|map_\w+)\s+(?:-\S+\s+\S+\s+)*([^\r\n]+)")
_BESIDE_DAE = re.compile(rb"<init_from>([^<]+)</init_from>")
MESH_KINDS = (".stl", ".obj", ".dae")
_TRIANGLE = np.dtype(
    [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")], align=False
)


class ModelAssets(NamedTuple):
    """A model, and where a loader finds its URDF."""

    model: Model
    urdf_path: Path
    """Absolute. Its meshes are named relative to it: Bullet, yourdfpy and trimesh load it as is."""
    name: str
    """Of the profile, short."""
    urdf: Urdf
    """What is in it."""

    def describe(self, robot: str) -> Description:
        """What the node answers when asked what the robot ``robot`` is."""
        if self.model.base is not None:
            return self.model.describe(robot, self.name, (True, False))
        kinds = [self.urdf.joints[joint.name].kind for joint in self.model.joints]
        return self.model.describe(robot, self.name, tuple(kind == "prismatic" for kind in kinds))


@lru_cache
def model_assets(name: str) -> ModelAssets:
    """The profile ``name`` (one that comes with Farhand, or a file) with a URDF that can be loaded.

    Raises:
        CannotStart: there is no such profile, it does not fit its URDF, or a mesh is missing; the
            message begins with the profile's file and line.
    """
    profile = load_profile(name)
    model = profile.model
    try:
        path = _find(model.urdf, profile.folder, "urdf")
        root = _read(path, "urdf")
        meshes = _take_meshes(root, path, "urdf")
        for number, attached in enumerate(model.attach):
            where = ("attach", number, "urdf")
            path = _find(attached.urdf, profile.folder, *where)
            other = _read(path, *where)
            meshes |= _take_meshes(other, path, *where)
            _hang(root, other, attached, number)
        try:
            urdf = parse_urdf(root, model.urdf)
        except ValueError as error:
            raise AtKey(str(error), "urdf") from error
        check(model, urdf, root)
        _weigh_frames(root)
    except AtKey as error:
        raise profile.wrong(str(error), *error.path) from error
    return ModelAssets(model, _copy(profile, root, meshes), profile.name, urdf)


def _read(path: Path, *where: str | int) -> ElementTree.Element:
    try:
        return read_urdf(path)
    except ValueError as error:
        raise AtKey(str(error), *where) from error


def _find(name: str, folder: Path, *where: str | int) -> Path:
    """The file ``name``: beside ``folder``, absolute, or ``package://`` of a Python package."""
    package = _PACKAGE.fullmatch(name)
    if package:
        found = _in_package(package[1], package[2])
        if found is None:
            raise AtKey(
                f"the Python package {package[1]} has no file {package[2]}, or is not installed",
                *where,
            )
        return found
    path = folder / Path(name).expanduser()
    if not path.is_file():
        raise AtKey(f"there is no file {path}", *where)
    return path


def _in_package(package: str, relative: str) -> Path | None:
    try:
        spec = find_spec(package)
    except (ImportError, ValueError):
        return None
    for folder in (spec.submodule_search_locations or ()) if spec else ():
        path = Path(folder) / relative
        if path.is_file():
            return path
    return None


def _take_meshes(root: ElementTree.Element, urdf: Path, *where: str | int) -> dict[str, Path]:
    """Give every mesh of a URDF the name that it has in the copy; returns name: file.

    Raises:
        AtKey: a mesh is missing or of a kind that cannot be read; says where the URDF names it.
    """
    taken: dict[str, Path] = {}
    for mesh in root.iter("mesh"):
        name = mesh.get("filename", "")
        path = _find_mesh(name, urdf.parent)
        if path is None or path.suffix.lower() not in MESH_KINDS:
            trouble = (
                "that is not there"
                if path is None
                else f"of a kind that cannot be read; there are: {', '.join(MESH_KINDS)}"
            )
            raise AtKey(f"{urdf}:{mesh_line(urdf, name)} names a mesh {name!r} {trouble}", *where)
        # A folder each, because its materials and textures are found by name beside it.
        folder = hashlib.sha256(str(path.parent).encode()).hexdigest()[:8]
        local = f"meshes/{folder}/{path.name}"
        taken[local] = path
        mesh.set("filename", local)
    return taken


def _find_mesh(name: str, folder: Path) -> Path | None:
    """A mesh of a URDF in ``folder``.

    ``package://NAME/REST`` is looked for in the Python package NAME, then as NAME/REST and as REST
    in the URDF's folder and in those above it, where a ROS package keeps it.
    """
    package = _PACKAGE.fullmatch(name)
    if package is None:
        path = folder / name.removeprefix("file://")
        return path if path.is_file() else None
    found = _in_package(package[1], package[2])
    if found is not None:
        return found
    for above in (folder, *folder.parents[:4]):
        for path in (above / package[1] / package[2], above / package[2]):
            if path.is_file():
                return path
    return None


def _hang(
    root: ElementTree.Element, other: ElementTree.Element, attached: AttachmentModel, number: int
) -> None:
    """Add the URDF ``other`` to ``root``, fixed to a link."""
    where = ("attach", number)
    links = [link.get("name") for link in root.findall("link")]
    if attached.to not in links:
        raise AtKey(f"there is no link {attached.to!r} in the URDF", *where, "to")
    try:
        first = parse_urdf(other, attached.urdf).root
    except ValueError as error:
        raise AtKey(f"{attached.urdf} cannot be attached: {error}", *where, "urdf") from error
    for kind in ("link", "joint"):
        names = {element.get("name") for element in root.findall(kind)}
        for element in other.findall(kind):
            if element.get("name") in names:
                raise AtKey(
                    f"{attached.urdf} has a {kind} {element.get('name')!r}, as the robot has",
                    *where,
                    "urdf",
                )
    root.extend(other)
    joint = ElementTree.SubElement(root, "joint", name=f"attach_{number + 1}", type="fixed")
    ElementTree.SubElement(joint, "parent", link=attached.to)
    ElementTree.SubElement(joint, "child", link=first)
    xyz, rpy = (" ".join(map(str, numbers)) for numbers in (attached.xyz, attached.rpy))
    ElementTree.SubElement(joint, "origin", xyz=xyz, rpy=rpy)


def _weigh_frames(root: ElementTree.Element) -> None:
    """Give links without a mass next to none: Bullet would take them for a kilogram each."""
    for link in root.findall("link"):
        if link.find("inertial") is None:
            inertial = ElementTree.SubElement(link, "inertial")
            ElementTree.SubElement(inertial, "mass", value="0.001")
            same = dict.fromkeys(("ixx", "iyy", "izz"), "0.000001")
            ElementTree.SubElement(inertial, "inertia", same, ixy="0", ixz="0", iyz="0")


def _copy(profile: Profile, root: ElementTree.Element, meshes: dict[str, Path]) -> Path:
    """Where the loadable copy is; made when it is not there yet."""
    urdf = ElementTree.tostring(root, "utf-8")
    digest = hashlib.sha256(urdf)
    for path in meshes.values():
        digest.update(path.read_bytes())
    file = f"{profile.name}.urdf"
    folder = _cache_folder() / f"{profile.name}-{digest.hexdigest()[:16]}"
    if not (folder / file).is_file():
        folder = _build(folder, file, urdf, meshes)
    return folder / file


def _cache_folder() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "farhand" / "models"


def _build(folder: Path, file: str, urdf: bytes, meshes: dict[str, Path]) -> Path:
    """Write the copy beside ``folder`` and move it there whole; returns where it is."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=".new-", dir=folder.parent))
    except OSError as error:
        # A home folder that cannot be written (a container): keep it for this process only.
        scratch = ScratchFolder()
        atexit.register(scratch.close)
        draft = scratch.path
        _log.info("the model is kept in %s: %s", draft, error)
        folder = draft
    for name, path in meshes.items():
        target = draft / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix.lower() == ".stl":
            target.write_bytes(write_stl(read_stl(path)))
        else:
            _copy_with_materials(path, target.parent)
    (draft / file).write_bytes(urdf)
    if draft != folder:
        try:
            draft.rename(folder)
        except OSError:  # another process was faster; its copy is the same
            shutil.rmtree(draft, ignore_errors=True)
    return folder


def _copy_with_materials(path: Path, folder: Path) -> None:
    """Copy a file and, as far as they lie beside it, the materials and textures that it names."""
    raw = path.read_bytes()
    (folder / path.name).write_bytes(raw)
    pattern = _BESIDE_DAE if path.suffix.lower() == ".dae" else _BESIDE
    for match in pattern.finditer(raw):
        beside = path.parent / match[1].decode("utf-8", "replace").strip()
        inside = beside.resolve().is_relative_to(path.parent.resolve())
        if inside and beside.is_file() and not (folder / beside.name).exists():
            _copy_with_materials(beside, folder)


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
