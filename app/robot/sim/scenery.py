"""What the pictures show of a robot: worlds for drawing only, and outlines for the shadows."""

import contextlib
import math
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pybullet
from numpy.typing import NDArray

from app.robot.models import MobileBaseModel, ModelAssets, ObjectModel
from app.robot.models.assets import read_stl
from app.robot.models.meshes import drawn_urdf
from app.robot.sim.kinematics import origin_of
from app.robot.sim.lens import Matrix
from app.robot.sim.shadow import outline
from app.robot.sim.world import connect, load_robot, upright
from app.scratch import ScratchFolder

_SKIRT = 0.004
"""m; thickness of the boards that stand for the sides of a table whose top is drawn apart."""


_DETAIL = 0.006
"""m; smaller details of the meshes are not drawn: about a pixel and a half of the scene camera."""


Pose2D = tuple[float, float, float]
"""m, m, rad about Z, in the world."""


class Stage:
    """A Bullet world with visual shapes and no physics.

    Args:
        assets: The robot's model.
        links: Says, by a link's name, whether it is drawn.
        things: Objects to draw.
        prepare: Called with the new world's client before anything is loaded.
        own_shapes: Whether the renderer draws shapes given as triangles; EGL does not.
    """

    def __init__(
        self,
        assets: ModelAssets,
        links: Callable[[str], bool],
        things: Iterable[ObjectModel],
        prepare: Callable[[int], None] = lambda client: None,
        own_shapes: bool = True,
    ) -> None:
        self.client = connect()
        self._open = True
        prepare(self.client)
        self.body, self._joints, self.links = _load_visuals(self.client, assets, links)
        model = assets.model
        self._base = model.base
        self._driven = [] if model.base else [self._joints[joint.name] for joint in model.joints]
        fingers = model.gripper.fingers if model.gripper else ()
        self._fingers = [self._joints[name] for name in fingers]
        self.things = {thing.name: add_visual(self.client, thing, own_shapes) for thing in things}

    def pose(self, joints: Iterable[float], gripper: float, base: Pose2D | None = None) -> None:
        """Put the robot's joints (rad) and its fingers (m between them) somewhere.

        A mobile base stands at ``base`` (m, m, rad), with its wheels turned as far as its joints
        (m driven, rad turned) say.
        """
        if self._base is not None:
            self._roll(self._base, *joints)
            x, y, heading = base or (0.0, 0.0, 0.0)
            pybullet.resetBasePositionAndOrientation(
                self.body, (x, y, 0.0), upright(heading), physicsClientId=self.client
            )
            return
        half = gripper / 2
        for index, angle in zip(self._driven, joints, strict=True):
            pybullet.resetJointState(self.body, index, angle, physicsClientId=self.client)
        for index in self._fingers:
            pybullet.resetJointState(self.body, index, half, physicsClientId=self.client)

    def put(self, name: str, position: tuple[float, ...], orientation: tuple[float, ...]) -> None:
        """Put a thing somewhere (m; quaternion w, x, y, z). Unknown names are passed over."""
        body = self.things.get(name)
        if body is not None:
            w, x, y, z = orientation
            pybullet.resetBasePositionAndOrientation(
                body, position, (x, y, z, w), physicsClientId=self.client
            )

    def frames(self, links: list[int]) -> list[Matrix]:
        """The 4x4 frames of links, in the world; -1 is the base link."""
        states = pybullet.getLinkStates(
            self.body,
            [link for link in links if link >= 0],
            computeForwardKinematics=True,
            physicsClientId=self.client,
        )
        moved = iter(frame_of(state[4], state[5]) for state in states)
        first = (
            frame_of(
                *pybullet.getBasePositionAndOrientation(self.body, physicsClientId=self.client)
            )
            if self._base is not None
            else np.eye(4)
        )
        return [next(moved) if link >= 0 else first for link in links]

    def _roll(self, base: MobileBaseModel, driven: float, turned: float) -> None:
        """Turn the wheels as rolling without slip would have."""
        for side, names in ((-1, base.left), (1, base.right)):
            angle = (driven + side * turned * base.track / 2) / base.radius
            for name in names:
                pybullet.resetJointState(
                    self.body, self._joints[name], angle, physicsClientId=self.client
                )

    def close(self) -> None:
        """Give the world back. Closing twice does no harm."""
        if self._open:
            self._open = False
            pybullet.disconnect(self.client)


def add_visual(client: int, thing: ObjectModel, own_shapes: bool = True) -> int:
    """Put one thing into a world for pictures; returns its body id.

    Of a thing with a grid only the sides: its top is drawn by the backdrop.
    """
    if thing.grid:
        x, y, z = (edge / 2 for edge in thing.size)
        thin = _SKIRT / 2
        sides = [(x - thin, 0.0), (thin - x, 0.0), (0.0, y - thin), (0.0, thin - y)]
        shapes = pybullet.createVisualShapeArray(
            shapeTypes=[pybullet.GEOM_BOX] * 4,
            halfExtents=[[thin, y, z], [thin, y, z], [x, thin, z], [x, thin, z]],
            rgbaColors=[thing.colour] * 4,
            visualFramePositions=[[dx, dy, -0.001] for dx, dy in sides],
            physicsClientId=client,
        )
    elif thing.shape == "box":
        shapes = pybullet.createVisualShape(
            pybullet.GEOM_BOX,
            halfExtents=[edge / 2 for edge in thing.size],
            rgbaColor=thing.colour,
            physicsClientId=client,
        )
    elif not own_shapes:
        shapes = pybullet.createVisualShape(
            pybullet.GEOM_CYLINDER,
            radius=thing.size[0] / 2,
            length=thing.size[2],
            rgbaColor=thing.colour,
            physicsClientId=client,
        )
    else:
        # Bullet's own cylinder is drawn with round edges; this one is cut clean.
        corners, normals = _cylinder_triangles(thing.size[0] / 2, thing.size[2])
        shapes = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            vertices=corners.tolist(),
            normals=normals.tolist(),
            indices=list(range(len(corners))),
            rgbaColor=thing.colour,
            physicsClientId=client,
        )
    return int(
        pybullet.createMultiBody(
            0,
            -1,
            shapes,
            basePosition=thing.position,
            baseOrientation=upright(thing.turn),
            physicsClientId=client,
        )
    )


def frame_of(position: Sequence[float], quaternion: Sequence[float]) -> Matrix:
    """A 4x4 frame from Bullet's position and quaternion x, y, z, w."""
    frame = np.eye(4)
    frame[:3, :3] = np.array(pybullet.getMatrixFromQuaternion(quaternion)).reshape(3, 3)
    frame[:3, 3] = position
    return frame


def link_outlines(assets: ModelAssets) -> dict[str, Matrix]:
    """Outline points (m, shape (n, 3)) of each link's visual shapes, in the link's frame."""
    drawn = drawn_urdf(assets, _DETAIL)
    root = ElementTree.parse(drawn).getroot()
    result = {}
    for link in root.findall("link"):
        points = [_visual_points(visual, drawn) for visual in link.findall("visual")]
        if points:
            result[link.get("name", "")] = outline(np.concatenate(points))
    return result


def thing_outline(thing: ObjectModel) -> Matrix:
    """Outline points (m, shape (n, 3)) of a thing, in its own frame."""
    if thing.shape == "box":
        return _box(np.array(thing.size))
    return _cylinder(thing.size[0] / 2, thing.size[2])


def _load_visuals(
    client: int, assets: ModelAssets, links: Callable[[str], bool]
) -> tuple[int, dict[str, int], dict[str, int]]:
    """Load the robot without collision shapes, and without the visuals of links not drawn."""
    drawn = drawn_urdf(assets, _DETAIL)
    tree = ElementTree.parse(drawn)
    for link in tree.getroot().findall("link"):
        if not links(link.get("name", "")):
            for visual in link.findall("visual"):
                link.remove(visual)
    for mesh in tree.getroot().iter("mesh"):
        mesh.set("filename", str(drawn.parent / mesh.get("filename", "")))
    with contextlib.closing(ScratchFolder()) as folder:
        path = folder.path / "visuals.urdf"
        tree.write(path)
        return load_robot(client, path)


def _visual_points(visual: ElementTree.Element, urdf: Path) -> Matrix:
    frame = origin_of(visual)
    box, cylinder = visual.find("geometry/box"), visual.find("geometry/cylinder")
    mesh = visual.find("geometry/mesh")
    if box is not None:
        points = _box(np.array([float(word) for word in box.get("size", "").split()]))
    elif cylinder is not None:
        points = _cylinder(float(cylinder.get("radius", 0)), float(cylinder.get("length", 0)))
    elif mesh is not None:
        points = read_stl(urdf.parent / mesh.get("filename", "")).reshape(-1, 3).astype(float)
    else:
        points = np.zeros((1, 3))
    return np.asarray(points @ frame[:3, :3].T + frame[:3, 3])


def _box(size: NDArray[np.float64]) -> Matrix:
    signs = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T
    return np.asarray(signs * size)


def _cylinder(radius: float, length: float) -> Matrix:
    turn = np.linspace(0, 2 * math.pi, 16, endpoint=False)
    ring = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.full(16, length / 2)], 1)
    return np.concatenate([ring, ring * [1, 1, -1]])


def _cylinder_triangles(radius: float, length: float, sides: int = 24) -> tuple[Matrix, Matrix]:
    """Corners and normals (shape (n, 3)), three a triangle: a round side and two flat ends."""
    turn = np.linspace(0, 2 * math.pi, sides + 1)
    out = np.stack([np.cos(turn), np.sin(turn), np.zeros(sides + 1)], 1)
    half, up = np.array([0.0, 0.0, length / 2]), np.array([0.0, 0.0, 1.0])
    corners: list[Matrix] = []
    normals: list[Matrix] = []
    for a, b in pairwise(out):
        p, q = a * radius, b * radius
        corners += [p - half, q - half, q + half, p - half, q + half, p + half]
        normals += [a, b, b, a, b, a]
        corners += [p + half, q + half, half, q - half, p - half, -half]
        normals += [up, up, up, -up, -up, -up]
    return np.array(corners), np.array(normals)
