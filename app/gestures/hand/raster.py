"""From rounded cones to an outline and a relief, seen along -z (orthographic).

For a pixel p and a cone whose ends are projected to a and b, with radii ra and rb:

    t = clamp((p - a).(b - a) / |b - a|^2, 0, 1),  r = ra + t (rb - ra),  d = |p - a - t (b - a)|
    outline:  d - r, negative inside;       relief:  z(t) + sqrt(r^2 - d^2)

Outlines of a finger and the palm are joined by the polynomial smooth minimum of I. Quilez
(iquilezles.org, "smooth minimum"), which gives the webs between fingers; fingers among themselves
by the plain minimum, so that closed fingers stay apart.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.gestures.hand.skeleton import PALM, Cone

Plane = NDArray[np.float32]
FAR = np.float32(9.0)
WEB = 0.030
"""Width of the soft transition between a finger and the palm, in hand's lengths."""
FLESH = 0.055
"""The same within the palm."""


class Frame(NamedTuple):
    """How a picture of pixels looks at the hand's plane."""

    matrix: NDArray[np.float64]
    """Pixels to hand: [x, y] = matrix @ [column, row, 1], shape (2, 3)."""
    shape: tuple[int, int]
    """Height and width in pixels."""
    pixel: float
    """Width of a pixel in hand's lengths."""


def crop(cones: tuple[Cone, ...], frame: Frame, step: int) -> tuple[Frame, tuple[int, int]]:
    """The part of a frame that the cones can touch.

    Args:
        cones: The hand.
        frame: The whole picture.
        step: The part's corners lie on multiples of this many pixels.

    Returns:
        The part, and the row and column at which it begins. At least ``step`` pixels each way.
    """
    windows = [window for cone in cones if (window := _window(cone, frame)) is not None]
    rows = [edge for window in windows for edge in (window[0].start, window[0].stop)] or [0, step]
    columns = [edge for window in windows for edge in (window[1].start, window[1].stop)] or [
        0,
        step,
    ]
    top, left = (min(edges) // step * step for edges in (rows, columns))
    bottom, right = (-(-max(edges) // step) * step for edges in (rows, columns))
    matrix = frame.matrix.copy()
    matrix[:, 2] += matrix[:, :2] @ [left, top]
    return Frame(matrix, (bottom - top, right - left), frame.pixel), (top, left)


class Relief(NamedTuple):
    """What of the hand is seen in each pixel; all float32 or int8 of the frame's shape."""

    distance: Plane
    """To the hand's outline in hand's lengths, negative inside."""
    height: Plane
    """z of the skin in hand's lengths; -9 beside the hand."""
    part: NDArray[np.int8]
    """Which part is on top."""


def rasterise(cones: tuple[Cone, ...], frame: Frame) -> Relief:
    """Draw the cones, part by part."""
    rows, columns = np.mgrid[0 : frame.shape[0], 0 : frame.shape[1]].astype(np.float32)
    (a, b, c), (d, e, f) = frame.matrix.astype(np.float32)
    x, y = a * columns + b * rows + c, d * columns + e * rows + f
    distance = np.full(frame.shape, FAR, np.float32)
    height = np.full(frame.shape, -FAR, np.float32)
    part = np.zeros(frame.shape, np.int8)
    palm: tuple[Plane, Plane] | None = None
    for number in sorted({cone.part for cone in cones}):
        own_distance = np.full(frame.shape, FAR, np.float32)
        own_height = np.full(frame.shape, -FAR, np.float32)
        for cone in (cone for cone in cones if cone.part == number):
            _add(cone, x, y, frame, own_distance, own_height, FLESH if number == PALM else 0.0)
        if palm is None:
            palm = own_distance, own_height
            distance, height = own_distance.copy(), own_height.copy()
            continue
        distance = np.minimum(distance, _soft_min(palm[0], own_distance, WEB))
        part[own_height > height] = number
        height = -_soft_min(-height, -own_height, 0.012)
    return Relief(distance, height, part)


def _add(
    cone: Cone,
    x: Plane,
    y: Plane,
    frame: Frame,
    distance: Plane,
    height: Plane,
    softness: float,
) -> None:
    """Join one cone to a part's outline and relief, in place, only near the cone."""
    window = _window(cone, frame)
    if window is None:
        return
    px, py = x[window], y[window]
    (ax, ay, az), (bx, by, bz) = cone.start, cone.end
    dx, dy, dz = bx - ax, by - ay, bz - az
    flat = dx * dx + dy * dy
    if flat > 1e-9:
        t = ((px - np.float32(ax)) * np.float32(dx) + (py - np.float32(ay)) * np.float32(dy)) * (
            np.float32(1.0 / flat)
        )
        np.clip(t, 0.0, 1.0, out=t)
    else:
        t = np.full_like(px, float(bz > az))
    ex = px - np.float32(ax) - t * np.float32(dx)
    ey = py - np.float32(ay) - t * np.float32(dy)
    squared = ex * ex + ey * ey
    radius = np.float32(cone.start_radius) + t * np.float32(cone.end_radius - cone.start_radius)
    outline = np.sqrt(squared) - radius
    # A cylinder that leans towards the eye is cut by the line of sight in a longer ellipse.
    lean = min(np.sqrt(1.0 + dz * dz / max(flat, 1e-9)), 1.6)
    dome = np.sqrt(np.maximum(radius * radius - squared, 0.0)) * np.float32(cone.depth * lean)
    relief = np.where(outline < 0, np.float32(az) + t * np.float32(dz) + dome, -FAR)
    for cx, cy, cz, r in ((ax, ay, az, cone.start_radius), (bx, by, bz, cone.end_radius)):
        if lean > 1.05:
            ball = np.float32(r * r) - (px - np.float32(cx)) ** 2 - (py - np.float32(cy)) ** 2
            inside = ball > 0
            relief[inside] = np.maximum(
                relief[inside], np.float32(cz) + np.sqrt(ball[inside]) * np.float32(cone.depth)
            )
    distance[window] = _soft_min(distance[window], outline, softness)
    height[window] = -_soft_min(-height[window], -relief, softness)


def _window(cone: Cone, frame: Frame) -> tuple[slice, slice] | None:
    """The rows and columns that a cone can touch, with room for soft transitions."""
    reach = max(cone.start_radius, cone.end_radius) + 2 * FLESH
    inverse = np.linalg.inv(np.vstack([frame.matrix, [0, 0, 1]]))[:2]
    ends = np.array([[*cone.start[:2], 1.0], [*cone.end[:2], 1.0]]) @ inverse.T
    margin = reach / frame.pixel
    low = np.maximum(np.floor(ends.min(axis=0) - margin), 0).astype(int)
    high = np.minimum(np.ceil(ends.max(axis=0) + margin) + 1, frame.shape[::-1]).astype(int)
    if np.any(low >= high):
        return None
    return slice(low[1], high[1]), slice(low[0], high[0])


def _soft_min(a: Plane, b: Plane, width: float) -> Plane:
    if width == 0.0:
        return np.minimum(a, b)
    overlap = np.maximum(np.float32(width) - np.abs(a - b), 0.0) * np.float32(1.0 / width)
    result: Plane = np.minimum(a, b) - overlap * overlap * np.float32(width / 4)
    return result
