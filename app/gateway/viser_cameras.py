"""The robot's cameras in the 3D view: where each one is, and what it sees, in its frustum."""

import contextlib
import logging
from collections.abc import Callable
from typing import TYPE_CHECKING

import cv2
import numpy as np
import simplejpeg
from numpy.typing import NDArray

from app.errors import FarhandError
from app.gateway.robot_port import Watch
from app.link.header import FrameHeader
from app.robot.models.check import ROOM

if TYPE_CHECKING:
    import viser
    from viser.extras import ViserUrdf

    from app.robot.models import CameraModel, Model

log = logging.getLogger(__name__)

EVERY_S = 0.4
"""Between two pictures of a camera."""
SIZE = (128, 96)
"""Pixels; a frustum is a few centimetres of the scene."""
QUALITY = 60
COLOUR = (60, 66, 74)
STANDS, RIDES = 0.16, 0.09
"""How large a frustum is that stands in the room, and one that rides on the robot."""
RETRY_S = 2.0
"""After a camera could not be watched."""

Picture = NDArray[np.uint8]
WatchCamera = Callable[[str, Callable[[FrameHeader, bytes], None]], Watch]


class CameraViews:
    """A frustum for each camera, with pictures while somebody looks.

    Each hangs below the scene node of the link that carries it, and so moves without a message of
    its own. The cameras are watched only between :meth:`update` and :meth:`rest`.

    Args:
        server: Of the scene.
        urdf: The robot that is shown.
        model: Its profile.
        watch: Has a function called, on other threads, with each picture of a camera.
        root: Scene node of the robot's base.
    """

    def __init__(
        self,
        server: "viser.ViserServer",
        urdf: "ViserUrdf",
        model: "Model",
        watch: WatchCamera,
        root: str = "/robot",
    ) -> None:
        self._watch = watch
        self._cameras = {
            camera.name: _View(
                server,
                camera,
                parent_of(urdf, camera.link, root),
                STANDS if camera.link in (ROOM, model.base_link) else RIDES,
            )
            for camera in model.cameras
        }

    @property
    def watching(self) -> bool:
        """Whether any camera is watched."""
        return any(view.watch is not None for view in self._cameras.values())

    @property
    def shown(self) -> dict[str, int]:
        """How many pictures each camera has shown."""
        return {name: view.shown for name, view in self._cameras.items()}

    def update(self, now: float) -> None:
        """Somebody looks: show what is new. ``now`` is monotonic, s."""
        for name, view in self._cameras.items():
            if view.watch is None and now >= view.retry_at:
                view.retry_at = now + RETRY_S
                try:
                    view.watch = self._watch(name, view.take)
                except FarhandError as error:
                    log.debug("camera %s is not in the 3D view: %s", name, error.message)
            view.show(now)

    def rest(self) -> None:
        """Nobody looks any more: let the cameras rest."""
        for view in self._cameras.values():
            watch, view.watch = view.watch, None
            if watch is not None:
                with contextlib.suppress(FarhandError):
                    watch.close()

    def remove(self) -> None:
        """Take everything out of the scene."""
        self.rest()
        for view in self._cameras.values():
            view.handle.remove()


class _View:
    """One camera."""

    def __init__(
        self, server: "viser.ViserServer", camera: "CameraModel", parent: str, scale: float
    ) -> None:
        self.watch: Watch | None = None
        self.retry_at = 0.0
        self.shown = 0
        self._newest: bytes | None = None
        self._next_at = 0.0
        self.handle = server.scene.add_camera_frustum(
            f"{parent}/camera_{camera.name}",
            fov=float(np.radians(camera.fov_degrees)),
            aspect=camera.width / camera.height,
            scale=scale,
            thickness=0.004,
            color=COLOUR,
            format="jpeg",
            jpeg_quality=QUALITY,
            wxyz=orientation_of(camera),
            position=camera.eye,
            cast_shadow=False,
            receive_shadow=False,
        )

    def take(self, header: FrameHeader, jpeg: bytes) -> None:
        """Called on a thread of the link, with each picture; the newest one counts."""
        self._newest = jpeg

    def show(self, now: float) -> None:
        newest = self._newest
        if newest is None or now < self._next_at:
            return
        self._newest, self._next_at = None, now + EVERY_S
        picture = small(newest)
        if picture is not None:
            self.handle.image = picture
            self.shown += 1


def small(jpeg: bytes) -> Picture | None:
    """A camera's picture, RGB, shape (height, width, 3), at most :data:`SIZE`; None: not a JPEG."""
    try:
        # Decoding at a half or a quarter costs that much less.
        picture = simplejpeg.decode_jpeg(jpeg, "RGB", min_width=SIZE[0], min_height=SIZE[1])
    except (ValueError, RuntimeError) as error:
        log.debug("a picture cannot be shown in 3D: %s", error)
        return None
    height, width = picture.shape[:2]
    part = min(1.0, SIZE[0] / width, SIZE[1] / height)
    size = (max(1, round(width * part)), max(1, round(height * part)))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)


def orientation_of(camera: "CameraModel") -> tuple[float, float, float, float]:
    """How a camera is turned in its link's frame: quaternion w, x, y, z (OpenCV's axes)."""
    from viser.transforms import SO3

    ahead = np.subtract(camera.target, camera.eye)
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, camera.up)
    right = right / np.linalg.norm(right)
    turn = np.stack([right, np.cross(ahead, right), ahead], axis=1)
    w, x, y, z = SO3.from_matrix(turn).wxyz.tolist()
    return w, x, y, z


def parent_of(urdf: "ViserUrdf", link: str, root: str) -> str:
    """The scene node that moves with a link of the URDF; of the room, which does not move."""
    if link == ROOM:
        return ""  # the scene's own root
    graph = urdf._urdf.scene.graph
    names = [link]
    while names[-1] != graph.base_frame:
        names.append(graph.transforms.parents[names[-1]])
    return "/".join([f"{root}/visual", *reversed(names[:-1])])
