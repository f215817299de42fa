"""The shadows of the arm and the objects on the table's top.

Each part's shadow is the convex hull of its outline points, projected along the light onto the
table: exact for convex parts, and near enough for the rest, at a hundredth of a shadow map's cost.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from app.robot.models import ObjectModel
from app.robot.sim.backdrop import Picture
from app.robot.sim.lens import Matrix

SHADOW_SCALE = 200
"""Pixels of the shadow's picture per metre, at most."""
_LONGEST = 480
"""Pixels of the shadow's picture along the table's longer edge, at most."""
_STRENGTH = 105
"""How dark a full shadow is, of 255."""


class Shadow:
    """Draws the darkness over the table's top.

    Args:
        table: The thing whose top catches the shadows.
        light: Direction to the light, shape (3,); its third number is positive.
    """

    def __init__(self, table: ObjectModel, light: Matrix) -> None:
        self._top = table.position[2] + table.size[2] / 2
        self._corner = np.array(table.position[:2]) - np.array(table.size[:2]) / 2
        self._scale = shadow_scale(table)
        self._shape = (round(table.size[1] * self._scale), round(table.size[0] * self._scale))
        self._lean = np.asarray(light[:2]) / light[2]

    def draw(self, parts: list[Matrix]) -> Picture:
        """The darkness (0 to 255, shape of the table at :func:`shadow_scale`) that parts throw.

        Args:
            parts: The outline points (m, shape (n, 3), base frame) of each part.
        """
        dark = np.zeros(self._shape, np.uint8)
        for points in parts:
            above = points[points[:, 2] > self._top - 0.005]
            if len(above) < 3:
                continue
            height = above[:, 2:] - self._top
            flat = (above[:, :2] - height * self._lean - self._corner) * self._scale
            hull = cv2.convexHull(np.asarray(flat * 16, dtype=np.int32))
            cv2.fillConvexPoly(dark, hull, _STRENGTH, cv2.LINE_AA, shift=4)
        return np.asarray(cv2.blur(cv2.blur(dark, (5, 5)), (5, 5)))


def shadow_scale(table: ObjectModel) -> float:
    """Pixels per metre of the shadow's picture: fewer on a floor than on a table."""
    return min(SHADOW_SCALE, _LONGEST / max(table.size[:2]))


def outline(vertices: NDArray[np.floating], directions: int = 40) -> Matrix:
    """The points of a body (shape (n, 3)) that lie farthest in evenly spread directions.

    The directions are a Fibonacci lattice on the sphere (Gonzalez 2010).
    """
    number = np.arange(directions) + 0.5
    z = 1 - 2 * number / directions
    turn = np.pi * (1 + np.sqrt(5)) * number
    r = np.sqrt(1 - z * z)
    toward = np.stack([r * np.cos(turn), r * np.sin(turn), z])
    return np.asarray(vertices[np.unique((vertices @ toward).argmax(axis=0))], dtype=np.float64)
