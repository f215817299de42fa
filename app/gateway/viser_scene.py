"""The live 3D view: the arm from its own URDF, the things around it, moved by the robot's states.

A thread loads viser (which takes seconds, and nobody waits for it), follows the robot and updates
the scene only while somebody looks. viser's own server (:mod:`app.gateway.viser_server`) runs in a
further thread; a failure in either shows in the log and stops nothing else.
"""

import logging
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from app.errors import CannotStart
from app.gateway.robot_port import RobotPort
from app.gateway.viser_aids import SceneAids
from app.gateway.viser_cameras import CameraViews
from app.gateway.viser_rehearsal import FLOOR_M, Actor, Rehearsals
from app.gateway.viser_trail import Trail
from app.link.messages import Description, ObjectDescription, ObjectState, State

if TYPE_CHECKING:
    import viser
    from viser.extras import ViserUrdf

    from app.gateway.viser_server import Page, PrivateServer
    from app.robot.models import Model, ModelAssets

log = logging.getLogger(__name__)

PERIOD_S = 0.05
RETRY_S = 2.0
"""After the scene could not be built or updated."""
CAMERA_POSITION = (1.25, 2.45, 1.7)
CAMERA_LOOK_AT = (0.5, -0.15, 0.65)
"""m, in the robot's base frame: from its left, the table, the whole arm and, behind them, a
camera that stands in the room."""
BACKGROUND = (0.80, 0.84, 0.88)


DETAIL_M = 0.002
"""Smaller details of the meshes are not sent to the browser."""


class ViserScene:
    """One robot in 3D, served on a private unix socket.

    Args:
        robot: Whose states to follow.
        profile: Name or file of its profile; default: the one of those that come with Farhand
            that it says it is.
    """

    def __init__(self, robot: RobotPort, profile: str | None = None) -> None:
        self._robot = robot
        self._profile = profile
        self._server: PrivateServer | None = None
        self.page: Page | None = None
        """viser's page; None before the server is started."""
        self.failure: str | None = None
        """Why there is no 3D view, and will be none."""
        self._ready = threading.Event()
        self._ending = threading.Event()
        self._described: Description | None = None
        self._urdf: ViserUrdf | None = None
        self._aids: SceneAids | None = None
        self._cameras: CameraViews | None = None
        self._trail: Trail | None = None
        self.rehearsals = Rehearsals()
        """Dry runs that are shown to who asked for them."""
        self._root: Any = None
        self.notice: str | None = None
        """What the view says in place of the robot."""
        self._pose_joints: Callable[[State], list[float]] = lambda state: []
        self._handles: list[Any] = []
        self._objects: dict[str, Any] = {}
        self._shown: int | None = None
        self._thread = threading.Thread(target=self._run, name="viser-scene", daemon=True)
        self._thread.start()

    def wait_socket(self, timeout_s: float) -> Path | None:
        """Wait for viser to be there: its socket, or None when there is none in time. Blocks."""
        self._ready.wait(timeout_s)
        return None if self._server is None or self._ending.is_set() else self._server.path

    @property
    def server(self) -> "PrivateServer | None":
        """The server of viser; None before it is started."""
        return self._server

    @property
    def aids(self) -> SceneAids | None:
        """What is shown beside the robot; None before the robot is."""
        return self._aids

    @property
    def cameras(self) -> CameraViews | None:
        """The robot's cameras in the scene; None before the robot is."""
        return self._cameras

    @property
    def trail(self) -> Trail | None:
        """The tool's way of the last seconds; None before the robot is."""
        return self._trail

    @property
    def shown_tick(self) -> int | None:
        """Tick of the state that the scene shows."""
        return self._shown

    @property
    def shows_robot(self) -> bool:
        """Whether the robot's shape is in the scene."""
        return self._urdf is not None

    def close(self) -> None:
        """End the thread and the server."""
        self._ending.set()
        self._thread.join(timeout=1.0)
        if self._cameras is not None:
            self._cameras.rest()
        if self._server is not None:
            self._server.stop()

    def _start(self) -> None:
        import rich

        from app.gateway.viser_server import Page, PrivateServer

        # viser prints by rich's console. Standard output is for our link alone, and may be written
        # at this very moment: so not redirected.
        rich.reconfigure(quiet=True)
        self.page = Page()
        server = PrivateServer()
        # What does not depend on the robot: ground, the first view, no panels.
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.main_panel.minimize()
        server.scene.set_up_direction("+z")
        server.scene.world_axes.visible = False
        server.initial_camera.position = CAMERA_POSITION
        server.initial_camera.look_at = CAMERA_LOOK_AT
        server.initial_camera.up = (0.0, 0.0, 1.0)
        server.initial_camera.fov = float(np.radians(45.0))
        background = np.full((2, 2, 3), [round(255 * part) for part in BACKGROUND], np.uint8)
        server.scene.set_background_image(background)
        self._server = server

    def _run(self) -> None:
        while not self._ending.wait(PERIOD_S):
            try:
                if self._server is None:
                    self._start()
                    self._ready.set()
                self._follow()
            except CannotStart as error:
                log.error("there is no 3D view: %s", error.message)
                self.failure = error.message
                self._ready.set()
                return
            except Exception:
                log.exception("the 3D view could not be updated")
                self._ending.wait(RETRY_S)

    def _follow(self) -> None:
        assert self._server is not None
        description, state = self._robot.description, self._robot.state
        if description is not None and description != self._described:
            started = time.monotonic()
            self._build(self._server, description)
            log.debug("3D scene built in %.1f s", time.monotonic() - started)
        if state is None or self._described is None or state.tick == self._shown:
            return
        watched = bool(self._server.get_clients())
        if self._cameras is not None and not watched:
            self._cameras.rest()
        # The first state is shown even when nobody looks: whoever comes next starts from there.
        if self._shown is not None and not watched:
            return
        with self._server.atomic():
            self._update(state)
            if self._cameras is not None and watched:
                self._cameras.update(time.monotonic())
        self._shown = state.tick
        if self._urdf is not None:
            pose = self._pose_joints
            actor = Actor(
                self._urdf, lambda joints: pose(state.model_copy(update={"joints": joints}))
            )
            self.rehearsals.update(self._server, actor)

    def _build(self, server: "viser.ViserServer", description: Description) -> None:
        self.rehearsals.forget_clients()
        parts: list[SceneAids | CameraViews | Trail | None]
        parts = [self._aids, self._cameras, self._trail]
        for part in parts:
            if part is not None:
                part.remove()
        self._aids = self._cameras = self._trail = None
        for handle in self._handles:
            handle.remove()
        if self._urdf is not None:
            self._urdf.remove()
            self._urdf = None
        self._handles, self._objects, self._shown = [], {}, None
        self.notice = None
        # Shadows cost software WebGL most of its time.
        server.scene.configure_default_lights(cast_shadow=False)
        self._handles.append(
            server.scene.add_grid(
                "/grid", width=6.0, height=6.0, cell_size=0.25, section_size=1.0,
                cell_color=(170, 178, 188), section_color=(140, 150, 162),
            )
        )  # fmt: skip
        assets = self._find_assets(server, description)
        if assets is not None:
            self._build_robot(server, assets)
        # States tell where movable things are; fixed ones stand where the model has them.
        places = {} if assets is None else {thing.name: thing for thing in assets.model.objects}
        for thing in description.objects:
            handle = self._objects[thing.name] = self._add(server, thing)
            if thing.name in places:
                half = places[thing.name].turn / 2
                handle.position = places[thing.name].position
                handle.wxyz = (np.cos(half), 0.0, 0.0, np.sin(half))
        self._handles += self._objects.values()
        self._described = description

    def _find_assets(
        self, server: "viser.ViserServer", description: Description
    ) -> "ModelAssets | None":
        """The robot's profile and meshes; None, and a line in the view, when they are not here."""
        from app.robot.models import model_assets

        try:
            assets = model_assets(self._profile or description.model)
        except CannotStart as error:
            log.warning("no robot in the 3D view: %s", error)
            assets = None
        joints = [joint.name for joint in description.joints]
        if assets is not None and [joint.name for joint in assets.model.joints] == joints:
            return assets
        self.notice = (
            f"The profile of {description.name} is not on this machine: give it with "
            "--robot-profile FILE to see the robot here. Everything else works."
        )
        self._handles.append(
            server.scene.add_label("/missing", self.notice, position=(0.0, 0.0, 1.0))
        )
        return None

    def _build_robot(self, server: "viser.ViserServer", assets: "ModelAssets") -> None:
        from viser.extras import ViserUrdf

        from app.robot.models.meshes import drawn_urdf

        self._root = server.scene.add_frame("/robot", show_axes=False)
        self._handles.append(self._root)
        urdf = ViserUrdf(server, drawn_urdf(assets, DETAIL_M), root_node_name="/robot")
        self._pose_joints = posed(assets.model, urdf.get_actuated_joint_names())
        self._urdf = urdf
        self._aids = SceneAids(server, urdf, assets.model.workspace, assets.model.link_words)
        self._cameras = CameraViews(server, urdf, assets.model, self._robot.watch_camera)
        self._trail = Trail(server, "/trail")

    def _add(self, server: "viser.ViserServer", thing: ObjectDescription) -> Any:
        red, green, blue, alpha = thing.colour
        colour = (round(red * 255), round(green * 255), round(blue * 255))
        name = f"/objects/{thing.name}"
        opacity = None if alpha >= 1.0 else alpha
        scene = server.scene
        if thing.shape == "box":
            return scene.add_box(name, color=colour, dimensions=thing.size, opacity=opacity)
        diameter, _, height = thing.size
        return scene.add_cylinder(
            name, radius=diameter / 2, height=height, color=colour, opacity=opacity
        )

    def _update(self, state: State) -> None:
        if self._urdf is not None and self._aids is not None:
            actual, commanded = (
                np.asarray(self._pose_joints(each))
                for each in (state, state.model_copy(update={"joints": state.commanded}))
            )
            self._urdf.update_cfg(actual)
            self._aids.update(actual, commanded, state.clearance)
            place = state.tool_position
            if state.base is not None:
                x, y, heading = state.base
                place = (x, y, FLOOR_M)
                self._root.position = (x, y, 0.0)
                self._root.wxyz = (np.cos(heading / 2), 0.0, 0.0, np.sin(heading / 2))
            if self._trail is not None:
                self._trail.update(state.tick / 1000, place)
        for thing in state.objects:
            self._place(thing)

    def _place(self, thing: ObjectState) -> None:
        handle = self._objects.get(thing.name)
        if handle is not None:
            handle.position = thing.position
            handle.wxyz = thing.orientation


def posed(model: "Model", names: Sequence[str]) -> Callable[[State], list[float]]:
    """Says, of a state, where the URDF's movable joints ``names`` are: rad, or m.

    Each finger takes half the gripper's width; a base's wheels have turned as its joints say; what
    is neither stays at zero.
    """
    arm = {joint.name: index for index, joint in enumerate(model.joints)}
    fingers = model.gripper.fingers if model.gripper else ()

    def angle(name: str, state: State) -> float:
        if model.base is not None:
            for side, wheels in ((-1, model.base.left), (1, model.base.right)):
                if name in wheels:
                    driven, turned = state.joints
                    return (driven + side * turned * model.base.track / 2) / model.base.radius
        elif name in arm:
            return state.joints[arm[name]]
        return state.gripper / 2 if name in fingers else 0.0

    return lambda state: [angle(name, state) for name in names]
