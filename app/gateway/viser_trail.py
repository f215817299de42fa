"""The tool's way of the last seconds, as a line in the 3D view that fades with age."""

from collections import deque
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import viser

LASTS_S = 4.0
EVERY_S = 0.1
"""Between two points, and so between two messages to the browsers."""
MOST_POINTS = round(LASTS_S / EVERY_S) + 1
APART_M = 0.002
"""A tool that stands leaves no points."""
THICK_M = 0.006
NEW, OLD = (0, 105, 190), (196, 208, 222)
"""RGB of the newest end and of the oldest, which is nearly the background's."""

Point = tuple[float, float, float]


class Trail:
    """Follows one point; costs nothing while it stands.

    Args:
        server: Of the scene.
        name: Scene node, in whose parent's frame the points are.
    """

    def __init__(self, server: "viser.ViserServer", name: str) -> None:
        self._points: deque[tuple[float, Point]] = deque(maxlen=MOST_POINTS)
        self._drawn_at = -np.inf
        self._line = server.scene.add_line_segments(
            name, np.zeros((1, 2, 3), np.float32), NEW, thickness=THICK_M, visible=False
        )

    @property
    def points(self) -> list[Point]:
        """What is shown, the oldest first, m."""
        return [point for _, point in self._points]

    def update(self, now_s: float, point: Point) -> None:
        """Go on to ``point`` (m); ``now_s`` is on the robot's clock."""
        if 0 <= now_s - self._drawn_at < EVERY_S:
            return
        if self._points and now_s < self._points[-1][0]:  # another robot, another clock
            self._points.clear()
        before = len(self._points)
        while self._points and now_s - self._points[0][0] > LASTS_S:
            self._points.popleft()
        gone = before - len(self._points)
        moved = not self._points or distance(self._points[-1][1], point) > APART_M
        if moved:
            self._points.append((now_s, point))
        if moved or gone:
            self._drawn_at = now_s
            self._draw()

    def remove(self) -> None:
        """Take it out of the scene."""
        self._line.remove()

    def _draw(self) -> None:
        shown = len(self._points) > 1
        if shown:
            points = np.array(self.points, np.float32)
            self._line.points = np.stack([points[:-1], points[1:]], axis=1)
            self._line.colors = fading(len(points))
        if shown != self._line.visible:
            self._line.visible = shown


def distance(first: Point, second: Point) -> float:
    """How far two points are apart, m."""
    return float(np.linalg.norm(np.subtract(first, second)))


def fading(count: int) -> NDArray[np.uint8]:
    """Colours of the segments between ``count`` points, shape (count - 1, 2, 3), RGB."""
    part = np.linspace(0.0, 1.0, count)[:, None]
    colours = (np.array(OLD) + part * np.subtract(NEW, OLD)).round().astype(np.uint8)
    return np.stack([colours[:-1], colours[1:]], axis=1)
