"""Meshes as triangles with a colour, whatever kind of file they are in, and a URDF to draw from.

What is drawn needs no details that nobody sees: a copy of the URDF beside the first, made once,
holds coarse STL meshes, one a colour, and no collision shapes.
"""

import shutil
import tempfile
from copy import deepcopy
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import cv2
import numpy as np
from numpy.typing import NDArray

from app.errors import CannotStart
from app.robot.models.assets import ModelAssets, read_stl, write_stl

_SHADES = 8
"""Steps of each colour channel in which differently coloured triangles are told apart."""
_MOST_PARTS = 6
"""Colours kept of one mesh; the rest are drawn in the most frequent one."""


Colour = tuple[float, float, float]
"""RGB, 0 to 1."""


class Part(NamedTuple):
    """Triangles of one colour."""

    corners: NDArray[np.float32]
    """m before the URDF's scale, shape (n, 3, 3)"""
    colour: Colour | None
    """None: the file says none, and the URDF's material counts."""


def drawn_urdf(assets: ModelAssets, detail: float) -> Path:
    """A URDF for drawing: without details smaller than ``detail`` (m), and without collisions.

    Raises:
        CannotStart: a mesh cannot be read.
    """
    name = f"drawn-{round(detail * 10000)}"
    folder = assets.urdf_path.parent / name
    file = folder / assets.urdf_path.name
    if file.is_file():
        return file
    tree = ElementTree.parse(assets.urdf_path)
    draft = Path(tempfile.mkdtemp(prefix=f".{name}-", dir=assets.urdf_path.parent))
    for link in tree.getroot().findall("link"):
        for collision in link.findall("collision"):
            link.remove(collision)
        for visual in link.findall("visual"):
            _simplify(link, visual, assets.urdf_path.parent, draft, detail)
    tree.write(draft / file.name)
    try:
        draft.rename(folder)
    except OSError:  # another process was faster; its copy is the same
        shutil.rmtree(draft, ignore_errors=True)
    return file


def _simplify(
    link: ElementTree.Element,
    visual: ElementTree.Element,
    source: Path,
    folder: Path,
    detail: float,
) -> None:
    """Put coarse STL meshes, one a colour, in the place of a visual's mesh."""
    mesh = visual.find("geometry/mesh")
    if mesh is None:
        return
    link.remove(visual)
    scale = np.array([float(word) for word in mesh.get("scale", "1 1 1").split()], np.float32)
    for part in read_mesh(source / mesh.get("filename", "")):
        corners = coarsen(part.corners * scale, detail)
        if not len(corners):
            continue
        path = folder / f"{len(list(folder.iterdir()))}.stl"
        path.write_bytes(write_stl(corners))
        one = deepcopy(visual)
        drawn = one.find("geometry/mesh")
        assert drawn is not None
        drawn.attrib = {"filename": path.name}
        if part.colour is not None:
            for material in one.findall("material"):
                one.remove(material)
            material = ElementTree.SubElement(one, "material", name=f"colour{path.stem}")
            rgba = " ".join(f"{value:.3f}" for value in (*part.colour, 1.0))
            ElementTree.SubElement(material, "color", rgba=rgba)
        link.append(one)


def coarsen(corners: NDArray[np.float32], cell: float) -> NDArray[np.float32]:
    """A mesh (corners, shape (n, 3, 3)) without details smaller than ``cell`` (m).

    Vertex clustering (Rossignac and Borrel 1993): corners in the same cell of a grid become their
    mean, and triangles that lose a side are left out.
    """
    flat = corners.reshape(-1, 3)
    _, which, count = np.unique(
        np.floor(flat / cell + 0.5).astype(np.int32),
        axis=0,
        return_inverse=True,
        return_counts=True,
    )
    which = which.reshape(-1)
    means = np.zeros((len(count), 3))
    np.add.at(means, which, flat)
    means /= count[:, None]
    triangles = which.reshape(-1, 3)
    a, b, c = triangles.T
    kept = triangles[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(kept, axis=1), axis=0, return_index=True)
    return np.asarray(means[kept[np.sort(first)]], np.float32)


def read_mesh(path: Path) -> list[Part]:
    """The triangles of an STL, OBJ or COLLADA file, by colour.

    Raises:
        CannotStart: the file cannot be read.
    """
    kind = path.suffix.lower()
    if kind == ".stl":
        return [Part(read_stl(path), None)]
    try:
        parts = _read_obj(path) if kind == ".obj" else _read_collada(path)
    except Exception as error:  # the readers raise whatever a broken file leads them to
        raise CannotStart(f"the mesh {path} cannot be read: {error}", file=str(path)) from error
    if not parts:
        raise CannotStart(f"the mesh {path} has no triangles", file=str(path))
    return _merge(parts)


class _Material(NamedTuple):
    colour: Colour
    texture: NDArray[np.uint8] | None
    """RGB, shape (h, w, 3)"""


def _read_obj(path: Path) -> list[Part]:
    """Triangles of a Wavefront OBJ file, by material; a textured one by what the texture shows."""
    points: list[list[str]] = []
    places: list[list[str]] = []
    materials: dict[str, _Material] = {}
    faces: dict[str, list[list[str]]] = {}
    current = ""
    for line in path.read_text("utf-8", "replace").splitlines():
        word, _, rest = line.strip().partition(" ")
        if word == "v":
            points.append(rest.split()[:3])
        elif word == "vt":
            places.append(rest.split()[:2])
        elif word == "f":
            corners = rest.split()
            fan = faces.setdefault(current, [])
            fan += [[corners[0], a, b] for a, b in pairwise(corners[1:])]
        elif word == "usemtl":
            current = rest.strip()
        elif word == "mtllib":
            materials |= _read_materials(path.parent / rest.strip())
    vertices, texels = np.array(points, np.float32), np.array(places, float).reshape(-1, 2)
    parts: list[Part] = []
    for name, triangles in faces.items():
        indices = [[corner.split("/") for corner in triangle] for triangle in triangles]
        # Counted from 1; from the end where negative.
        at = np.array([[int(corner[0]) for corner in triangle] for triangle in indices])
        shape = vertices[np.where(at > 0, at - 1, at)]
        material = materials.get(name)
        if material is None or material.texture is None or len(indices[0][0]) < 2:
            parts.append(Part(shape, material.colour if material else None))
            continue
        uv = np.array([[int(corner[1] or 1) for corner in triangle] for triangle in indices])
        middle = texels[np.where(uv > 0, uv - 1, uv)].mean(axis=1) % 1.0
        height, width = material.texture.shape[:2]
        rows = ((1 - middle[:, 1]) * (height - 1)).astype(int)
        shades = material.texture[rows, (middle[:, 0] * (width - 1)).astype(int)]
        parts += _by_colour(shape, shades)
    return parts


def _read_materials(path: Path) -> dict[str, _Material]:
    """The materials of an MTL file; none when it is not there."""
    materials: dict[str, _Material] = {}
    if not path.is_file():
        return materials
    name = ""
    for line in path.read_text("utf-8", "replace").splitlines():
        word, _, rest = line.strip().partition(" ")
        if word == "newmtl":
            name = rest.strip()
            materials[name] = _Material((0.8, 0.8, 0.8), None)
        elif word == "Kd" and name:
            red, green, blue = map(float, rest.split()[:3])
            materials[name] = materials[name]._replace(colour=(red, green, blue))
        elif word == "map_Kd" and name:
            picture = cv2.imread(str(path.parent / rest.split()[-1]), cv2.IMREAD_COLOR)
            if picture is not None:
                rgb = np.asarray(picture[:, :, ::-1], np.uint8)
                materials[name] = materials[name]._replace(texture=rgb)
    return materials


def _read_collada(path: Path) -> list[Part]:
    """Triangles of a COLLADA file, by material."""
    import trimesh  # here: it takes a second and more, and few robots need it

    parts: list[Part] = []
    for mesh in trimesh.load_scene(path).dump():
        if not isinstance(mesh, trimesh.Trimesh):
            continue
        corners = np.asarray(mesh.triangles, np.float32)
        material = getattr(mesh.visual, "material", None)
        colour: Colour | None = None
        if material is not None:
            red, green, blue = (np.asarray(material.main_color)[:3] / 255).tolist()
            colour = (red, green, blue)
        if len(corners):
            parts.append(Part(corners, colour))
    return parts


def _by_colour(corners: NDArray[np.float32], colours: NDArray[np.uint8]) -> list[Part]:
    """Triangles split by their colours (RGB, shape (n, 3))."""
    _, which = np.unique(colours.astype(int) * _SHADES // 256, axis=0, return_inverse=True)
    which = np.asarray(which).reshape(-1)
    parts = []
    for number in range(int(which.max()) + 1):
        chosen = which == number
        red, green, blue = (colours[chosen].mean(axis=0) / 255).tolist()
        parts.append(Part(corners[chosen], (red, green, blue)))
    return parts


def _merge(parts: list[Part]) -> list[Part]:
    """Parts of the same colour together, and only the few that hold the most triangles apart."""
    groups: dict[tuple[int, ...] | None, list[Part]] = {}
    for part in parts:
        colour = part.colour
        shade = None if colour is None else tuple(int(c * _SHADES * 0.999) for c in colour)
        groups.setdefault(shade, []).append(part)
    merged = [
        Part(np.concatenate([part.corners for part in group]), group[0].colour)
        for group in groups.values()
    ]
    merged.sort(key=lambda part: -len(part.corners))
    rest = merged[_MOST_PARTS:]
    if rest:
        first = merged[0]
        corners = np.concatenate([first.corners, *(part.corners for part in rest)])
        merged[0] = Part(corners, first.colour)
    return merged[:_MOST_PARTS]
