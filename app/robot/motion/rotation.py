"""Unit quaternions w, x, y, z."""

import math

import numpy as np

from app.robot.arm import Vector


def turn(quaternion: Vector, rotation: Vector) -> Vector:
    """``quaternion`` turned by the rotation vector ``rotation`` (rad, base frame)."""
    angle = math.sqrt(float(rotation @ rotation))
    half = angle / 2
    # sin(x)/x near 0 is 1 - x^2/6
    scale = 0.5 * (1 - half * half / 6) if half < 1e-4 else math.sin(half) / angle
    x, y, z = scale * rotation
    a, b = np.array([math.cos(half), x, y, z]), quaternion
    result = product(a, b)
    return result / np.linalg.norm(result)


def product(a: Vector, b: Vector) -> Vector:
    """Hamilton product: first ``b``, then ``a``."""
    w, x, y, z = a
    p, q, r, s = b
    return np.array(
        [
            w * p - x * q - y * r - z * s,
            w * q + x * p + y * s - z * r,
            w * r - x * s + y * p + z * q,
            w * s + x * r - y * q + z * p,
        ]
    )


def difference(to: Vector, start: Vector) -> Vector:
    """The rotation vector (rad, base frame) that turns ``start`` into ``to``, the short way."""
    w, x, y, z = product(to, start * np.array([1.0, -1.0, -1.0, -1.0]))
    if w < 0:
        w, x, y, z = -w, -x, -y, -z
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 if sine < 1e-9 else 2 * math.atan2(sine, w) / sine
    return scale * np.array([x, y, z])


def rotate(quaternion: Vector, vector: Vector) -> Vector:
    """``vector``, given in the frame that ``quaternion`` describes, in the base frame."""
    w, axis = quaternion[0], quaternion[1:]
    t = 2 * np.cross(axis, vector)
    turned: Vector = vector + w * t + np.cross(axis, t)
    return turned
