"""What TinyRenderer would draw slowly: the room, the floor and the table's top with its grid.

A table that fills the picture costs TinyRenderer 25 ms; warping a drawn texture costs 1 ms and
looks better. :func:`shade` then darkens the table where the arm and the objects throw a shadow,
which shows where above it the gripper is.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from app.robot.models import ObjectModel
from app.robot.sim.lens import Layer, Lens, Matrix, affine

Picture = NDArray[np.uint8]

TABLE_SCALE = 500
"""Pixels of the table's texture per metre: 2 mm each. Fewer where the longest edge would have more
than :data:`_LONGEST`."""
_LONGEST = 1200
_FLOOR_FROM = 2.0
"""m; from this edge on a table is a floor."""
_FLOOR_SCALE = 100
_FLOOR_EDGE = 6.0
"""m; the floor's texture is a square of this edge round the robot's base."""
WALL_TOP = (226, 231, 236)
WALL_LOW = (184, 192, 202)
FLOOR = (128, 134, 142)
"""RGB."""
_WALL = np.linspace(WALL_LOW, WALL_TOP, 256).astype(np.uint8)
"""From low to high, shape (256, 3)."""


class Room(NamedTuple):
    """A picture of the room, how far away its pixels are, and where in it the table's top is."""

    colour: Picture
    """RGB, shape (h, w, 3)."""
    depth: Layer
    """Depth buffer, 0 near to 1 far, shape (h, w)."""
    table: Picture
    """1 where the table's top is seen, shape (h, w)."""
    to_table: Matrix | None
    """3x3: from (column, row, 1) to m from the table's corner; None when it is not in view."""


class Backdrop:
    """The room behind everything, for one camera.

    Args:
        lens: The camera.
        table: The thing whose top gets a grid, if there is one.
        things: Everything that stands on the floor, for the dim places under it.
    """

    def __init__(self, lens: Lens, table: ObjectModel | None, things: list[ObjectModel]) -> None:
        self._lens = lens
        self._columns = np.arange(lens.width, dtype=np.float32)[None, :]
        self._rows = np.arange(lens.height, dtype=np.float32)[:, None]
        self._floor = _floor_texture(things)
        self._table = table
        if table is not None:
            self._top = table.position[2] + table.size[2] / 2
            self._corner = np.array(
                [
                    table.position[0] - table.size[0] / 2,
                    table.position[1] - table.size[1] / 2,
                    self._top,
                ]
            )
            self._table_scale = _table_scale(table)
            self._texture = _table_texture(table)

    def draw(self, view: Matrix) -> Room:
        """The room as seen with the 4x4 view matrix ``view``."""
        size = (self._lens.height, self._lens.width)
        colour, depth = self._wall(view), np.ones(size, np.float32)
        table, to_table = np.zeros(size, np.uint8), None
        half = _FLOOR_EDGE / 2
        self._paint(colour, depth, view, np.array([-half, -half, 0.0]), self._floor, _FLOOR_SCALE)
        eye_height = -view[:3, 2] @ view[:3, 3]
        if self._table is not None and eye_height > self._top:
            seen = self._paint(colour, depth, view, self._corner, self._texture, self._table_scale)
            if seen is not None:
                table, to_table = seen
        return Room(colour, depth, table, to_table)

    def _paint(
        self,
        colour: Picture,
        depth: Layer,
        view: Matrix,
        corner: Matrix,
        texture: Picture,
        scale: float,
    ) -> tuple[Picture, Matrix] | None:
        """Lay a level, textured rectangle over what is there, which lies behind it.

        Returns:
            Its mask and the homography from the picture to m from its corner; None when all of it
            is behind the camera.
        """
        plane = self._lens.plane(view, corner, np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
        height, width = texture.shape[:2]
        to_texture = np.diag([scale, scale, 1.0]) @ plane.to_plane
        ahead = affine(plane.ahead, self._columns, self._rows) > 0
        corners = np.linalg.inv(to_texture) @ np.array(
            [[0, width, width, 0], [0, 0, height, height], [1.0, 1, 1, 1]]
        )
        if (corners[2] <= 0).all():
            return None
        size = (self._lens.width, self._lens.height)
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        drawn = cv2.warpPerspective(
            texture, to_texture, size, flags=flags, borderMode=cv2.BORDER_REPLICATE
        )
        s = affine(to_texture[0], self._columns, self._rows)
        t = affine(to_texture[1], self._columns, self._rows)
        w = affine(to_texture[2], self._columns, self._rows)
        inside = ahead & (s >= 0) & (t >= 0) & (s <= width * w) & (t <= height * w)
        away = affine(plane.depth, self._columns, self._rows)
        mask = inside.view(np.uint8)
        cv2.copyTo(drawn, mask, colour)
        cv2.copyTo(away, mask, depth)
        return mask, plane.to_plane

    def _wall(self, view: Matrix) -> Picture:
        """A wall that grows lighter upwards from where the floor fades into it."""
        rise = affine(self._lens.rise(view), self._columns, self._rows)
        light = np.clip((rise + 0.22) * 1.3, 0.0, 1.0)  # the floor ends a little below the horizon
        return np.asarray(_WALL[(light * 255).astype(np.uint8)])


def shade(room: Room, shadow: Picture, scale: float) -> Picture:
    """The room's picture with a shadow on the table.

    Args:
        room: The room; its ``table`` says where the shadow is seen.
        shadow: Darkness over the table's top, 0 to 255, first row and column at its corner.
        scale: Pixels of ``shadow`` per metre.
    """
    if room.to_table is None:
        return room.colour.copy()
    height, width = room.table.shape
    to_shadow = np.diag([scale, scale, 1.0]) @ room.to_table
    dark = cv2.warpPerspective(
        shadow, to_shadow, (width, height), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    )
    light = 255 - dark * room.table
    return np.asarray(cv2.multiply(room.colour, cv2.merge([light] * 3), scale=1 / 255))


def _table_scale(table: ObjectModel) -> float:
    """Pixels per metre of the table's texture."""
    return min(TABLE_SCALE, _LONGEST / max(table.size[:2]))


def _table_texture(table: ObjectModel) -> Picture:
    """Wood with a line each 10 cm, on a floor 50 cm, of the base frame, and a frame round it."""
    scale = _table_scale(table)
    width, height = (round(edge * scale) for edge in table.size[:2])
    noise = np.random.default_rng(5)
    grain = cv2.resize(
        noise.normal(0.0, 1.0, (max(2, height // 3), max(2, width // 60))).astype(np.float32),
        (width, height),
        interpolation=cv2.INTER_CUBIC,
    )
    wood = np.array(table.colour[:3]) * 255
    picture = np.clip(wood * (1.04 + 0.025 * grain[:, :, None]), 0, 255).astype(np.uint8)
    left = table.position[0] - table.size[0] / 2
    low = table.position[1] - table.size[1] / 2
    line = tuple(int(value * 0.74) for value in wood)
    apart = 0.1 if max(table.size[:2]) < _FLOOR_FROM else 0.5
    farthest = round((max(map(abs, table.position[:2])) + max(table.size[:2])) / apart)
    for number in range(-farthest, farthest + 1):
        x = round((number * apart - left) * scale)
        y = round((number * apart - low) * scale)
        thick = 2 if number % (5 if apart == 0.1 else 2) == 0 else 1
        if 0 < x < width:
            cv2.line(picture, (x, 0), (x, height), line, thick, cv2.LINE_AA)
        if 0 < y < height:
            cv2.line(picture, (0, y), (width, y), line, thick, cv2.LINE_AA)
    cv2.rectangle(picture, (0, 0), (width - 1, height - 1), line, 6)
    return np.asarray(picture)


def _floor_texture(things: list[ObjectModel]) -> Picture:
    """A tiled floor that fades into the wall, darker under the robot and the table."""
    size = round(_FLOOR_EDGE * _FLOOR_SCALE)
    picture = np.empty((size, size, 3), np.float32)
    picture[:] = FLOOR
    for tile in range(0, size, _FLOOR_SCALE // 2):
        cv2.line(picture, (tile, 0), (tile, size), [value * 0.88 for value in FLOOR], 2)
        cv2.line(picture, (0, tile), (size, tile), [value * 0.88 for value in FLOOR], 2)
    dim = np.zeros((size, size), np.float32)
    middle = size // 2
    cv2.circle(dim, (middle, middle), round(0.26 * _FLOOR_SCALE), 1.0, -1)
    for thing in things:
        if thing.mass == 0:
            x, y = (middle + value * _FLOOR_SCALE for value in thing.position[:2])
            a, b = (value / 2 * _FLOOR_SCALE for value in thing.size[:2])
            cv2.rectangle(dim, (round(x - a), round(y - b)), (round(x + a), round(y + b)), 1.0, -1)
    dim = np.asarray(cv2.GaussianBlur(dim, (0, 0), 0.12 * _FLOOR_SCALE), np.float32)
    picture *= 1 - 0.55 * dim[:, :, None]
    from_middle = np.linspace(-1, 1, size, dtype=np.float32)
    away = np.hypot(from_middle[:, None], from_middle[None, :])
    fade = np.clip((away - 0.45) / 0.5, 0, 1)[:, :, None]
    faded = picture * (1 - fade) + np.array(WALL_LOW, np.float32) * fade
    return np.asarray(faded, np.uint8)
