"""A camera's matrices, and how a plane in the world appears in its picture."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]
Layer = NDArray[np.float32]


class PlaneView(NamedTuple):
    """A plane as one camera sees it, from picture coordinates (column, row, 1)."""

    to_plane: Matrix
    """3x3 homography: the plane's own coordinates (s, t), after division by the third."""
    depth: Matrix
    """Shape (3,): the depth buffer's value is this times (column, row, 1). It is affine, as z/w of
    points on a plane is, so no division is needed."""
    ahead: Matrix
    """Shape (3,): positive, times (column, row, 1), where the plane is before the camera."""


class Lens:
    """A pinhole camera with OpenGL's matrices (column vectors), as Bullet takes them.

    Args:
        width: Pixels.
        height: Pixels.
        fov_degrees: Vertical field of view.
        near: m; nothing nearer is drawn.
        far: m; nothing farther is drawn.
        middle: Whether the renderer samples pixels in their middle, as OpenGL does. TinyRenderer
            samples pixel (column, row), counted from the top, at (2 column / width - 1,
            1 - 2 (row + 1) / height); found by comparing depths.
    """

    def __init__(
        self,
        width: int,
        height: int,
        fov_degrees: float,
        near: float,
        far: float,
        *,
        middle: bool = False,
    ) -> None:
        self.width, self.height = width, height
        f = 1.0 / math.tan(math.radians(fov_degrees) / 2)
        self._half = np.array([width / height / f, 1 / f])
        self.projection = np.array(
            [
                [f * height / width, 0.0, 0.0, 0.0],
                [0.0, f, 0.0, 0.0],
                [0.0, 0.0, (far + near) / (near - far), 2 * far * near / (near - far)],
                [0.0, 0.0, -1.0, 0.0],
            ]
        )
        right, down = (0.5, 0.5) if middle else (0.0, 1.0)
        self._to_ndc = np.array(
            [
                [2 / width, 0.0, 2 * right / width - 1],
                [0.0, -2 / height, 1 - 2 * down / height],
                [0.0, 0.0, 1.0],
            ]
        )

    def plane(self, view: Matrix, origin: Matrix, first: Matrix, second: Matrix) -> PlaneView:
        """How the plane ``origin + s first + t second`` appears with the view matrix ``view``.

        Points on the plane project to H (s, t, 1), H = P V [first second origin] (4x3). Its rows
        x, y and w are a homography G to the picture; z/w is affine in the picture, with the
        coefficients row_z G^-1.
        """
        basis = np.zeros((4, 3))
        basis[:3, 0], basis[:3, 1], basis[:3, 2], basis[3, 2] = first, second, origin, 1.0
        onto = self.projection @ view @ basis
        back = np.linalg.inv(onto[[0, 1, 3]]) @ self._to_ndc
        depth = onto[2] @ back / 2
        depth[2] += 0.5  # from -1..1 to the buffer's 0..1
        return PlaneView(back, depth, back[2])

    def rise(self, view: Matrix) -> Matrix:
        """How much the ray through (column, row, 1) rises, in m per metre ahead; 0 at the horizon.

        Returns:
            The coefficients, shape (3,).
        """
        right, above, back = view[:3, 2]  # the world's up in the camera's axes
        x, y = self._half
        ahead = np.array([0.0, 0.0, back])
        return np.asarray(right * x * self._to_ndc[0] + above * y * self._to_ndc[1] - ahead)


def look_at(eye: Matrix, target: Matrix, up: Matrix) -> Matrix:
    """The 4x4 view matrix of a camera at ``eye`` that looks at ``target``, like gluLookAt."""
    ahead = target - eye
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, up)
    right = right / np.linalg.norm(right)
    above = np.cross(right, ahead)
    view = np.eye(4)
    view[0, :3], view[1, :3], view[2, :3] = right, above, -ahead
    view[:3, 3] = -view[:3, :3] @ eye
    return view


def affine(coefficients: Matrix, columns: Layer, rows: Layer) -> Layer:
    """``a column + b row + c`` over the picture; ``columns`` (1, w), ``rows`` (h, 1)."""
    a, b, c = (np.float32(value) for value in coefficients)
    return np.asarray(a * columns + (b * rows + c))
