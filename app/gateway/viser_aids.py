"""What the 3D view shows beside the robot: where it should be, what it is near, where it may go."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.link.messages import Clearance

if TYPE_CHECKING:
    import viser
    from viser.extras import ViserUrdf

    from app.robot.models.model import WorkspaceModel

GHOST_COLOUR = (0.10, 0.45, 0.85, 0.35)
"""RGBA of the arm where it is commanded to be."""
GHOST_FROM = 0.02
"""rad; a joint farther than this from where it should be makes the ghost worth seeing. An arm that
follows well stays below."""
NEAR, TOUCHING = 0.10, 0.03
"""m; the line to the nearest thing is green, amber from here and red from here."""
GREEN, AMBER, RED = (40, 150, 70), (215, 135, 0), (205, 30, 30)
BOX_COLOUR = (90, 110, 140)


class SceneAids:
    """A translucent second arm, a line to the nearest thing, and the workspace's box.

    What is not needed is hidden, not removed, so that a change costs a few bytes. The ghost's
    meshes are sent when it is first needed: most who look never see one.

    Args:
        server: Of the scene.
        urdf: The robot that is shown, whose geometry the ghost shares.
        workspace: The box that the tool may not leave, if there is one.
        words: Links in plain words.
        root: Scene node of the robot's base.
    """

    def __init__(
        self,
        server: "viser.ViserServer",
        urdf: "ViserUrdf",
        workspace: "WorkspaceModel | None",
        words: Mapping[str, str],
        root: str = "/robot",
    ) -> None:
        self._server = server
        self._urdf = urdf
        self._words = words
        self._root = f"{root}/aids"
        self._frame = server.scene.add_frame(self._root, show_axes=False)
        self._ghost: ViserUrdf | None = None
        self._ghost_frame = server.scene.add_frame(
            f"{self._root}/ghost", show_axes=False, visible=False
        )
        self._line = server.scene.add_line_segments(
            f"{self._root}/nearest", np.zeros((1, 2, 3)), GREEN, thickness=0.006, visible=False
        )
        self._label = server.scene.add_label(f"{self._root}/distance", "", visible=False)
        if workspace is not None:
            server.scene.add_line_segments(
                f"{self._root}/workspace",
                box_edges(workspace.lower, workspace.upper),
                BOX_COLOUR,
                thickness=0.004,
            )

    @property
    def ghost_shown(self) -> bool:
        """Whether the arm is shown where it is commanded to be."""
        return bool(self._ghost_frame.visible)

    @property
    def told(self) -> str | None:
        """What stands at the nearest thing; None when nothing is near."""
        return str(self._label.text) if self._label.visible else None

    def update(
        self, actual: NDArray[np.float64], commanded: NDArray[np.float64], near: Clearance | None
    ) -> None:
        """Show one state.

        Args:
            actual: Every actuated joint of the URDF, in its order, as measured; rad or m.
            commanded: The same as commanded.
            near: The nearest thing; None: nothing near.
        """
        apart = bool(np.abs(actual - commanded).max(initial=0.0) > GHOST_FROM)
        if apart:
            if self._ghost is None:
                self._ghost = self._make_ghost()
            self._ghost.update_cfg(commanded)
        if apart != self._ghost_frame.visible:
            self._ghost_frame.visible = apart
        self._show_nearest(near)

    def remove(self) -> None:
        """Take everything out of the scene."""
        self._frame.remove()

    def _make_ghost(self) -> "ViserUrdf":
        from viser.extras import ViserUrdf

        # Each reads its own transforms right after it has set the joints, so one geometry does.
        return ViserUrdf(
            self._server,
            self._urdf._urdf,
            root_node_name=f"{self._root}/ghost",
            mesh_color_override=GHOST_COLOUR,
        )

    def _show_nearest(self, near: Clearance | None) -> None:
        shown = near is not None
        if near is not None:
            points = np.array([near.points])
            colour = RED if near.distance < TOUCHING else AMBER if near.distance < NEAR else GREEN
            self._line.points = points
            self._line.colors = np.array(colour, np.uint8)
            self._label.text = label_of(near, self._words)
            self._label.position = points[0].mean(axis=0)
        if shown != self._line.visible:
            self._line.visible = self._label.visible = shown


def label_of(near: Clearance, words: Mapping[str, str]) -> str:
    """The distance in mm and what it is to, as in ``48 mm to table``."""
    thing = words.get(near.thing, near.thing.replace("_", " "))
    return f"{near.distance * 1000:.0f} mm to {thing}"


def box_edges(
    lower: tuple[float, float, float], upper: tuple[float, float, float]
) -> NDArray[np.float64]:
    """The twelve edges of an upright box, shape (12, 2, 3), m."""
    edges = []
    for axis in range(3):
        across = [other for other in range(3) if other != axis]
        for first in (lower, upper):
            for second in (lower, upper):
                start, end = np.array(lower), np.array(upper)
                for other, side in zip(across, (first, second), strict=True):
                    start[other] = end[other] = side[other]
                edges.append((start, end))
    return np.array(edges)
