"""Pictures of the robot: what its cameras would see.

Four things make them cheap enough for two cameras on one core: each camera has a world with only
what can come into its view; what never moves before a fixed camera is drawn once; the room, the
floor and the table's top are warped textures (:mod:`app.robot.sim.backdrop`); and TinyRenderer
draws the rest without shadows, which are drawn as polygons (:mod:`app.robot.sim.shadow`). The
layers are put together by their depths.
"""

import logging
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
import pybullet

from app.errors import CannotStart
from app.link.messages import ObjectState
from app.robot.models import CameraModel, ModelAssets, ObjectModel, model_assets
from app.robot.models.check import ROOM
from app.robot.sim.backdrop import Backdrop, Picture, Room, shade
from app.robot.sim.lens import Layer, Lens, Matrix, look_at
from app.robot.sim.scenery import Pose2D, Stage, frame_of, link_outlines, thing_outline
from app.robot.sim.shadow import Shadow, shadow_scale

_log = logging.getLogger(__name__)

_CLEAR = np.float32(0.999999)
"""A depth from here on is TinyRenderer's empty background."""


class Renderer:
    """Draws the pictures of all cameras of a robot.

    Args:
        model: A profile: the name of one that comes with Farhand, or a file.
        hardware: Draw with EGL on a graphics card; default: where there is one.

    Raises:
        CannotStart: there is no such model, or PyBullet lacks numpy, or EGL was asked for and
            does not work.
    """

    def __init__(self, model: str = "puma560", *, hardware: bool | None = None) -> None:
        assets = model_assets(model)
        self.model = assets.model
        self._draw_with = _Painter(has_graphics_card() if hardware is None else hardware)
        # One world for all cameras on a graphics card: two EGL worlds in a process draw into each
        # other, and a card needs none of the savings below.
        whole = self._draw_with.stage(assets, self.model.objects) if self.hardware else None
        self._views = {
            camera.name: _View(assets, camera, self._draw_with, whole)
            for camera in self.model.cameras
        }
        table = next((thing for thing in self.model.objects if thing.grid), None)
        self._shadow: Shadow | None = None
        if table is not None and self.model.cameras:
            self._shadow = Shadow(table, np.array(self.model.cameras[0].light))
        self._throws = link_outlines(assets)
        self._stage = Stage(assets, lambda link: False, ())
        self._links = [self._stage.links[name] for name in self._throws]
        self._movable = {
            thing.name: (thing_outline(thing), frame_of(thing.position, (0, 0, 0, 1)))
            for thing in self.model.objects
            if thing.mass > 0
        }
        self._darkness: Picture | None = None
        gripper = self.model.gripper
        self.update(self.model.pose(self.model.home), gripper.width if gripper else 0.0, ())

    @property
    def names(self) -> tuple[str, ...]:
        """The cameras."""
        return tuple(self._views)

    @property
    def hardware(self) -> bool:
        """Whether a graphics card draws."""
        return self._draw_with.hardware

    def update(
        self,
        joints: Iterable[float],
        gripper: float,
        objects: Iterable[ObjectState],
        base: Pose2D | None = None,
    ) -> None:
        """Show the robot with its joints at ``joints`` (rad) and its fingers ``gripper`` m apart.

        A mobile base stands at ``base`` (m, m, rad). Things that are not among ``objects`` stay
        where they were.
        """
        self._joints, self._gripper, self._base = np.array(list(joints)), gripper, base
        for thing in objects:
            if thing.name in self._movable:
                w, x, y, z = thing.orientation
                points, _ = self._movable[thing.name]
                self._movable[thing.name] = (points, frame_of(thing.position, (x, y, z, w)))
            for view in self._views.values():
                view.stage.put(thing.name, thing.position, thing.orientation)
        self._darkness = None

    def picture(self, name: str) -> Picture:
        """What the camera ``name`` sees: RGB, uint8, shape (height, width, 3).

        Raises:
            KeyError: there is no such camera.
        """
        return self._views[name].draw(self._joints, self._gripper, self._base, self._shade())

    def close(self) -> None:
        """Give the Bullet worlds back."""
        for view in self._views.values():
            view.stage.close()
        self._stage.close()

    def _shade(self) -> Picture | None:
        """The shadows of the newest state, drawn once for all cameras."""
        if self._darkness is None and self._shadow is not None:
            self._stage.pose(self._joints, self._gripper, self._base)
            frames = self._stage.frames(self._links)
            parts = list(zip(self._throws.values(), frames, strict=True))
            parts += self._movable.values()
            self._darkness = self._shadow.draw(
                [points @ frame[:3, :3].T + frame[:3, 3] for points, frame in parts]
            )
        return self._darkness


class _View:
    """One camera, and the world it looks at: its own, or ``whole`` with everything in it."""

    def __init__(
        self,
        assets: ModelAssets,
        camera: CameraModel,
        painter: "_Painter",
        whole: Stage | None,
    ) -> None:
        model = assets.model
        self._camera, self._painter = camera, painter
        self._lens = self._painter.lens(camera)
        fixed = [thing for thing in model.objects if thing.mass == 0]
        loose = [thing for thing in model.objects if thing.mass > 0]
        table = next((thing for thing in model.objects if thing.grid), None)
        self._backdrop = Backdrop(self._lens, table, fixed)
        self._shadow_scale = shadow_scale(table) if table else 1.0
        self._still: Room | None = None
        self._view = np.eye(4)
        # What never moves before a camera that does not move: things, and a robot's first link.
        in_room = camera.link == ROOM
        still_link = None if model.base else model.base_link
        stands_still = (in_room or camera.link == still_link) and whole is None
        if stands_still:
            self._view = self._looks_from(np.eye(4))
            stage = Stage(assets, lambda link: link == still_link, fixed)
            self._still = self._draw_still(stage, table, fixed)
            stage.close()
        self.stage = whole or Stage(
            assets,
            lambda link: (
                (not camera.shows or link in camera.shows)
                and not (stands_still and link == still_link)
            ),
            loose if stands_still else fixed + loose,
        )
        self._link = None if in_room else self.stage.links[camera.link]

    def draw(
        self, joints: Matrix, gripper: float, base: Pose2D | None, darkness: Picture | None
    ) -> Picture:
        self.stage.pose(joints, gripper, base)
        if self._still is not None:
            room = self._still
        else:
            carrier = np.eye(4) if self._link is None else self.stage.frames([self._link])[0]
            self._view = self._looks_from(carrier)
            room = self._backdrop.draw(self._view)
        colour = (
            room.colour.copy() if darkness is None else shade(room, darkness, self._shadow_scale)
        )
        room = room._replace(colour=colour)
        return self._painter.add(
            room, self.stage, self._lens, self._view, self._camera.light
        ).colour

    def _draw_still(
        self, stage: Stage, table: ObjectModel | None, fixed: list[ObjectModel]
    ) -> Room:
        """What never moves, drawn once: at twice the size, so that its edges come out smooth."""
        camera = self._camera
        fine = self._painter.lens(camera, 2)
        room = Backdrop(fine, table, fixed).draw(self._view)
        room = self._painter.add(room, stage, fine, self._view, camera.light)
        size = (camera.width, camera.height)
        # Every second column and row are sampled at the very places of the small picture's pixels.
        return Room(
            np.asarray(cv2.resize(room.colour, size, interpolation=cv2.INTER_AREA), np.uint8),
            np.ascontiguousarray(room.depth[1::2, ::2]),
            np.ascontiguousarray(room.table[1::2, ::2]),
            self._backdrop.draw(self._view).to_table,
        )

    def _looks_from(self, carrier: Matrix) -> Matrix:
        turn, place = carrier[:3, :3], carrier[:3, 3]
        return look_at(
            turn @ np.array(self._camera.eye) + place,
            turn @ np.array(self._camera.target) + place,
            turn @ np.array(self._camera.up),
        )


class _Painter:
    """Draws a stage over a room, with TinyRenderer or with a graphics card."""

    def __init__(self, hardware: bool) -> None:
        self.hardware = hardware
        self._with = pybullet.ER_BULLET_HARDWARE_OPENGL if hardware else pybullet.ER_TINY_RENDERER

    def lens(self, camera: CameraModel, times: int = 1) -> Lens:
        """The camera's lens, for a picture ``times`` as large."""
        return Lens(
            camera.width * times,
            camera.height * times,
            camera.fov_degrees,
            camera.near,
            camera.far,
            middle=self.hardware,
        )

    def stage(self, assets: ModelAssets, things: Iterable[ObjectModel]) -> Stage:
        """A world with everything in it, drawn by the graphics card."""
        return Stage(assets, lambda link: True, things, self._load_egl, own_shapes=False)

    def _load_egl(self, client: int) -> None:
        plugin = find_spec("eglRenderer")
        loaded = -1
        if plugin is not None and plugin.origin is not None:
            loaded = pybullet.loadPlugin(
                plugin.origin, "_eglRendererPlugin", physicsClientId=client
            )
        if loaded < 0:
            raise CannotStart("PyBullet's EGL renderer cannot be loaded; use the software one")

    def add(
        self,
        room: Room,
        stage: Stage,
        lens: Lens,
        view: Matrix,
        light: tuple[float, float, float],
    ) -> Room:
        """The room with the stage's shapes before it."""
        _, _, pixels, away, _ = pybullet.getCameraImage(
            lens.width,
            lens.height,
            view.T.ravel().tolist(),
            lens.projection.T.ravel().tolist(),
            lightDirection=light,
            shadow=0,
            renderer=self._with,
            flags=pybullet.ER_NO_SEGMENTATION_MASK,
            physicsClientId=stage.client,
        )
        depth: Layer = np.reshape(away, (lens.height, lens.width))
        near = (depth < room.depth) & (depth < _CLEAR)
        mask = near.view(np.uint8)
        drawn = cv2.cvtColor(
            np.reshape(pixels, (lens.height, lens.width, 4)).astype(np.uint8, copy=False),
            cv2.COLOR_RGBA2RGB,
        )
        colour, behind = room.colour.copy(), room.depth.copy()
        cv2.copyTo(drawn, mask, colour)
        cv2.copyTo(depth, mask, behind)
        return Room(colour, behind, room.table & (mask ^ np.uint8(1)), room.to_table)


def has_graphics_card() -> bool:
    """Whether this machine shows a graphics card that EGL could use."""
    return Path("/dev/nvidia0").exists() or any(Path("/dev/dri").glob("renderD*"))
