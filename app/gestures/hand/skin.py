"""Skin: light and shade on the relief of a hand, creases, nails."""

import cv2
import numpy as np
from numpy.typing import NDArray

from app.gestures.hand.raster import Frame, Plane, Relief
from app.gestures.hand.skeleton import PALM, THUMB, Chain, Skeleton

TONES: dict[str, tuple[int, int, int]] = {
    "light": (172, 193, 233),
    "medium": (128, 160, 211),
    "tan": (97, 132, 187),
    "brown": (66, 92, 141),
    "dark": (50, 66, 101),
}
"""Colours of skin in full light, BGR."""
_PALM_LINES = (
    ((-0.175, 0.36), (-0.07, 0.33), (0.03, 0.37), (0.085, 0.455)),
    ((0.185, 0.345), (0.08, 0.335), (-0.03, 0.285), (-0.12, 0.225)),
    ((0.180, 0.350), (0.06, 0.320), (0.005, 0.19), (0.030, 0.055)),
)
"""Heart, head and life line as Bezier curves in the hand's plane."""


def paint(
    skeleton: Skeleton,
    relief: Relief,
    frame: Frame,
    tone: tuple[int, int, int],
    light: tuple[float, float, float],
) -> NDArray[np.float32]:
    """Colour the hand.

    Args:
        skeleton: For where creases and nails are.
        relief: What is seen.
        frame: The same as the relief's.
        tone: BGR in full light, 0 to 255.
        light: Direction to the light in the picture: right, down, towards the eye.

    Returns:
        BGR, 0 to 255, shape (height, width, 3); without meaning beside the hand.
    """
    unit = 1.0 / frame.pixel  # pixels of a hand's length
    inside = relief.height > -1.0
    height = np.where(inside, relief.height, np.float32(-0.08))
    height = cv2.GaussianBlur(height, (0, 0), max(0.006 * unit, 0.5))
    slope_x = cv2.Sobel(height, cv2.CV_32F, 1, 0, ksize=3) * np.float32(unit / 8)
    slope_y = cv2.Sobel(height, cv2.CV_32F, 0, 1, ksize=3) * np.float32(unit / 8)
    length = np.sqrt(slope_x * slope_x + slope_y * slope_y + 1.0)
    lx, ly, lz = np.array(light, np.float64) / np.linalg.norm(light)
    lambert = (-slope_x * np.float32(lx) - slope_y * np.float32(ly) + np.float32(lz)) / length
    # Wrapped light, as skin scatters it round into the shade.
    diffuse = np.clip((lambert + 0.45) / 1.45, 0.0, 1.0)
    around = cv2.GaussianBlur(height, (0, 0), max(0.030 * unit, 1.0))
    hollow = np.clip((around - height) * np.float32(7.0), 0.0, 0.55)
    hollow *= cv2.GaussianBlur(inside.astype(np.float32), (0, 0), max(0.01 * unit, 0.5))
    lines, nails = _marks(skeleton, relief, frame)
    shade = (0.42 + 0.62 * diffuse) * (1.0 - hollow) * (1.0 - 0.24 * lines)
    colour = np.array(tone, np.float32) * np.clip(shade, 0.0, 1.12)[..., None]
    # Blood: shaded skin turns red, not grey; finger tips and the balls of the hand are pinker.
    red = np.clip(1.0 - shade, 0.0, 1.0)[..., None]
    colour *= 1.0 + red * np.array([-0.16, -0.10, 0.10], np.float32)
    pink = np.array([232, 226, 246], np.float32) * np.clip(shade, 0, 1.1)[..., None]
    result: NDArray[np.float32] = colour + nails[..., None] * 0.38 * (pink - colour)
    return result


def _marks(skeleton: Skeleton, relief: Relief, frame: Frame) -> tuple[Plane, Plane]:
    """Creases and nails, 0 to 1, each only where its own part of the hand is on top."""
    inverse = np.linalg.inv(np.vstack([frame.matrix, [0, 0, 1]]))[:2]
    unit = 1.0 / frame.pixel

    def pixels(points: NDArray[np.float64]) -> NDArray[np.int32]:
        mapped = np.column_stack([points[:, :2], np.ones(len(points))]) @ inverse.T
        return np.round(mapped * 16).astype(np.int32)  # 4 bits of fraction, for OpenCV's shift

    lines = np.zeros(frame.shape, np.float32)
    nails = np.zeros(frame.shape, np.float32)
    thick = max(round(0.006 * unit), 1)
    layer = np.zeros(frame.shape, np.uint8)
    for palm_line in _PALM_LINES:
        cv2.polylines(layer, [pixels(_bezier(palm_line))], False, 170, thick, cv2.LINE_AA, 4)
    lines = np.maximum(lines, np.where(relief.part == PALM, layer, 0) / np.float32(255))
    for chain in skeleton.chains:
        layer = np.zeros(frame.shape, np.uint8)
        for curve in _creases(chain):
            cv2.polylines(layer, [pixels(curve)], False, 200, thick, cv2.LINE_AA, 4)
        own = relief.part == chain.part
        lines = np.maximum(lines, np.where(own, layer, 0) / np.float32(255))
        nail = _nail(chain)
        if nail is not None:
            layer = np.zeros(frame.shape, np.uint8)
            cv2.fillPoly(layer, [pixels(nail)], 255, cv2.LINE_AA, 4)
            nails = np.maximum(nails, np.where(own, layer, 0) / np.float32(255))
    blur = max(0.0035 * unit, 0.5)
    return _soft(lines, blur), _soft(nails, blur)


def _soft(plane: NDArray[np.float32], sigma: float) -> Plane:
    return np.asarray(cv2.GaussianBlur(plane, (0, 0), sigma), np.float32)


def _bezier(curve: tuple[tuple[float, float], ...]) -> NDArray[np.float64]:
    t = np.linspace(0.0, 1.0, 24)[:, None]
    a, b, c, d = (np.array(point) for point in curve)
    points = (1 - t) ** 3 * a + 3 * (1 - t) ** 2 * t * b + 3 * (1 - t) * t**2 * c + t**3 * d
    return np.asarray(points, np.float64)


def _creases(chain: Chain) -> list[NDArray[np.float64]]:
    """Lines across a digit at its joints, where its palm side is seen."""
    curves = []
    for joint in (1, 2):
        if chain.bend[joint] > 1.1 or (chain.part == THUMB and joint == 1):
            continue
        along = chain.joints[joint] - chain.joints[joint - 1]
        long = float(np.hypot(along[0], along[1]))
        if long < 1e-6:
            continue
        forward = along[:2] / long
        across = np.array([-forward[1], forward[0]]) * chain.radii[joint] * 0.72
        bow = np.linspace(-1.0, 1.0, 7)[:, None]
        for shift in (0.0, 0.016) if joint == 1 else (0.0,):
            middle = chain.joints[joint][:2] - forward * shift
            curves.append(middle + across * bow - forward * 0.008 * (1 - bow**2))
    return curves


def _nail(chain: Chain) -> NDArray[np.float64] | None:
    """The outline of the nail, where the back of a digit's end faces the eye."""
    seen = chain.bend[2] > (0.9 if chain.part == THUMB else 2.2)
    along = chain.joints[3] - chain.joints[2]
    long = float(np.hypot(along[0], along[1]))
    if not seen or long < 0.35 * float(np.linalg.norm(along)):
        return None
    forward = along[:2] / long
    across = np.array([-forward[1], forward[0]])
    turn = np.linspace(0.0, 2 * np.pi, 24)[:, None]
    middle = chain.joints[3][:2] + forward * chain.radii[3] * 0.10
    width, reach = chain.radii[3] * 0.58, chain.radii[3] * 0.78 * long / np.linalg.norm(along)
    return np.asarray(middle + across * np.cos(turn) * width + forward * np.sin(turn) * reach)
