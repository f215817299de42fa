"""Dry runs in the 3D view: the way that an action would take, shown to who asked for it alone.

A page names its 3D view by an id of its own making, which only it knows; what is to be shown there
waits until that view is open, and comes back with it after a break.
"""

import re
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple
from urllib.parse import parse_qs, urlsplit

import numpy as np
from numpy.typing import NDArray

from app.link.messages import DryRunProblem, DryRunReport

if TYPE_CHECKING:
    import viser
    from viser.extras import ViserUrdf

VIEW_ID = re.compile(r"[A-Za-z0-9_-]{16,40}")
MOST_KEPT = 16
"""Views of which the newest dry run is kept."""
EVERY_S = 0.1
"""Between two places of the ghost that goes along."""
LONGEST_S = 8.0
"""A longer way is gone along faster."""
REST_S = 1.5
"""At the end, before it is gone along again."""
ROUNDS = 3
"""How often; then the ghost stays at the end."""
FLOOR_M = 0.03
"""The way of a base is drawn this far above the floor."""
MOST_MARKS = 6
SAME_PLACE_M = 0.02
LONGEST_LABEL = 90
GHOST = (0.48, 0.20, 0.68, 0.38)
"""RGBA; another colour than the ghost of the arm that moves."""
WAY = (122, 52, 172)
BROKEN, SLOWED = (205, 30, 30), (215, 135, 0)

Joints = tuple[float, ...]
Point = tuple[float, float, float]


class Actor(NamedTuple):
    """The robot that goes along."""

    urdf: "ViserUrdf"
    """Shown already; its geometry is shared."""
    pose: Callable[[Joints], Sequence[float]]
    """From the joints of a path to those of the URDF, in its order."""


class Mark(NamedTuple):
    """A place where a limit is met."""

    place: Point
    text: str
    broken: bool
    """Otherwise it only slows."""


@dataclass(frozen=True)
class Rehearsed:
    """One dry run for one view."""

    report: DryRunReport
    still: bool
    """The ghost stands at the end, and does not go along."""


class Rehearsals:
    """What is shown to whom. :meth:`show` and :meth:`hide` may be called from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._wanted: OrderedDict[str, Rehearsed] = OrderedDict()
        self._shown: dict[int, _Shown] = {}

    @property
    def shown(self) -> int:
        """In how many views something is shown."""
        return len(self._shown)

    @property
    def kept(self) -> tuple[str, ...]:
        """Views for which something is kept, the oldest first."""
        with self._lock:
            return tuple(self._wanted)

    def show(self, view: str, report: DryRunReport, *, still: bool) -> None:
        """Show a dry run in the view ``view`` instead of what was shown there before."""
        with self._lock:
            self._wanted.pop(view, None)
            self._wanted[view] = Rehearsed(report, still)
            while len(self._wanted) > MOST_KEPT:
                self._wanted.popitem(last=False)

    def hide(self, view: str) -> None:
        """Show nothing in the view any more."""
        with self._lock:
            self._wanted.pop(view, None)

    def update(self, server: "viser.ViserServer", actor: Actor) -> None:
        """Bring every view up to date. On the scene's thread."""
        clients = server.get_clients()
        for gone in self._shown.keys() - clients.keys():
            del self._shown[gone]
        with self._lock:
            if not self._wanted and not self._shown:
                return
            wanted = dict(self._wanted)
        for number, client in clients.items():
            rehearsed = wanted.get(view_of(server, number) or "")
            shown = self._shown.get(number)
            if shown is not None and shown.rehearsed is not rehearsed:
                shown.remove()
                del self._shown[number]
                shown = None
            if rehearsed is not None and shown is None:
                shown = self._shown[number] = _Shown(client, rehearsed, actor)
            if shown is not None:
                shown.update(time.monotonic())

    def forget_clients(self) -> None:
        """The robot in the scene is another one from now on. On the scene's thread."""
        for shown in self._shown.values():
            shown.remove()
        self._shown.clear()


class _Shown:
    """One dry run in one client's scene."""

    def __init__(self, client: "viser.ClientHandle", rehearsed: Rehearsed, actor: Actor) -> None:
        self.rehearsed = rehearsed
        self._path = rehearsed.report.path
        self._actor = actor
        self._began: float | None = None
        self._next_at = 0.0
        self._at: int | None = None
        self._root = client.scene.add_frame("/dry_run", show_axes=False)
        self._ghost: ViserUrdf | None = None
        way = way_of(rehearsed.report)
        if len(way) > 1:
            client.scene.add_line_segments(
                "/dry_run/way", np.stack([way[:-1], way[1:]], axis=1), WAY, thickness=0.008
            )
            self._add_ghost(client)
            for name, place in (("start", way[0]), ("end", way[-1])):
                client.scene.add_icosphere(
                    f"/dry_run/{name}", radius=0.012, color=WAY, position=place, cast_shadow=False
                )
                client.scene.add_label(
                    f"/dry_run/{name}/words",
                    name,
                    position=(0.0, 0.0, 0.03),
                    anchor="bottom-center",
                )
        for number, mark in enumerate(marks_of(rehearsed.report)):
            add_mark(client, f"/dry_run/mark_{number}", mark)

    def update(self, now: float) -> None:
        """Let the ghost go on."""
        if self._ghost is None or now < self._next_at:
            return
        self._next_at = now + EVERY_S
        if self._began is None:
            self._began = now
        at = index_at(self._path.times, now - self._began, still=self.rehearsed.still)
        if at == self._at:
            return
        self._at = at
        self._ghost.update_cfg(np.asarray(self._actor.pose(self._path.joints[at])))
        if self._path.base:
            x, y, heading = self._path.base[at]
            self._frame.position = (x, y, 0.0)
            self._frame.wxyz = (np.cos(heading / 2), 0.0, 0.0, np.sin(heading / 2))

    def remove(self) -> None:
        """Take it out of the client's scene."""
        self._root.remove()

    def _add_ghost(self, client: "viser.ClientHandle") -> None:
        from viser.extras import ViserUrdf

        self._frame: Any = client.scene.add_frame("/dry_run/robot", show_axes=False)
        self._ghost = ViserUrdf(
            client,
            self._actor.urdf._urdf,
            root_node_name="/dry_run/robot",
            mesh_color_override=GHOST,
        )


def view_of(server: "viser.ViserServer", client: int) -> str | None:
    """The id that a page gave its 3D view, which the proxy passes on; None without one.

    viser tells nobody how a client has addressed it, so this looks at its connection.
    """
    connections = server._websock_server._live_connections
    connection = next((each for key, each in connections.items() if int(key) == client), None)
    if connection is None or connection.request is None:
        return None
    given = parse_qs(urlsplit(connection.request.path).query).get("view")
    return given[0] if given else None


def way_of(report: DryRunReport) -> NDArray[np.float32]:
    """The line to draw, shape (n, 3), m in the room: the tool's, or a base's on the floor."""
    path = report.path
    if path.base:
        points = np.array([(x, y, FLOOR_M) for x, y, _ in path.base], np.float32)
    else:
        points = np.array(path.tool, np.float32).reshape(-1, 3)
    if len(points) < 2:
        return points
    far = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-4
    return np.asarray(points[np.concatenate([[True], far])])


def marks_of(report: DryRunReport) -> list[Mark]:
    """Where limits are met, those that are broken first; at most :data:`MOST_MARKS`.

    What is met in one place is told by one mark.
    """
    path = report.path
    if not path.times:
        return []
    marks: list[Mark] = []
    for problem in sorted(report.problems, key=lambda each: each.kind == "slowed"):
        place = place_at(report, problem.time_s)
        text = words_of(problem)
        broken = problem.kind != "slowed"
        for number, mark in enumerate(marks):
            if np.linalg.norm(np.subtract(mark.place, place)) < SAME_PLACE_M:
                together = f"{mark.text}; {text}"[:LONGEST_LABEL]
                marks[number] = Mark(mark.place, together, mark.broken or broken)
                break
        else:
            if len(marks) < MOST_MARKS:
                marks.append(Mark(place, text[:LONGEST_LABEL], broken))
    return marks


def place_at(report: DryRunReport, time_s: float) -> Point:
    """Where the tool, or the base on its floor, would be at a time (s): m, in the room."""
    path = report.path
    track = np.array(path.tool if not path.base else [(x, y, FLOOR_M) for x, y, _ in path.base])
    x, y, z = (float(np.interp(time_s, path.times, track[:, axis])) for axis in range(3))
    return x, y, z


def words_of(problem: DryRunProblem) -> str:
    """As in ``! Step 2: joint 5 would pass its limit``."""
    sign = "slower" if problem.kind == "slowed" else "!"
    step = "" if problem.step is None else f" Step {problem.step}:"
    return f"{sign}{step} {problem.message}"


def index_at(times: Sequence[float], since_s: float, *, still: bool) -> int:
    """Which point of a path the ghost is at ``since_s`` after it began to go along."""
    last = len(times) - 1
    lasts = min(times[-1], LONGEST_S)
    if still or lasts <= 0 or since_s >= ROUNDS * (lasts + REST_S) - REST_S:
        return last
    part = since_s % (lasts + REST_S) / lasts
    return int(np.searchsorted(np.asarray(times), min(part, 1.0) * times[-1], side="right")) - 1


def add_mark(client: "viser.ClientHandle", name: str, mark: Mark) -> None:
    """A pyramid on its point where a limit is broken, a small cube where it only slows, and why."""
    colour = BROKEN if mark.broken else SLOWED
    if mark.broken:
        corners = np.array(
            [(0, 0, 0), (1, 1, 2.2), (-1, 1, 2.2), (-1, -1, 2.2), (1, -1, 2.2)], np.float32
        )
        faces = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1), (1, 3, 2), (1, 4, 3)])
        client.scene.add_mesh_simple(
            name, corners * 0.02, faces, color=colour, flat_shading=True, side="double",
            position=mark.place, cast_shadow=False,
        )  # fmt: skip
    else:
        client.scene.add_box(
            name, color=colour, dimensions=(0.02, 0.02, 0.02), position=mark.place,
            cast_shadow=False,
        )  # fmt: skip
    client.scene.add_label(
        f"{name}/words", mark.text, position=(0.0, 0.0, 0.06), anchor="bottom-center"
    )
