"""Quaternions of attitudes, as MuJoCo has them: (w, x, y, z), body to world.

Entry points: `multiply`, `rotate`, `from_axis_angle`, `from_matrix`, `angle_between`, `rate_of`.
Arrays of any leading shape; the last axis holds the components.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def multiply(p: Array, q: Array) -> Array:
    """The Hamilton product p q, (…, 4)."""
    w, x, y, z = np.moveaxis(p, -1, 0)
    a, b, c, d = np.moveaxis(q, -1, 0)
    return np.stack(
        [
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        ],
        axis=-1,
    )


def conjugate(q: Array) -> Array:
    """The inverse of unit quaternions, (…, 4)."""
    turned: Array = q * np.array([1.0, -1.0, -1.0, -1.0])
    return turned


def from_axis_angle(axis: Array, angle: Array) -> Array:
    """Rotation about a unit axis (3,) by angles (…), in radians: (…, 4)."""
    half = np.asarray(angle, dtype=np.float64)[..., None] / 2
    return np.concatenate([np.cos(half), np.sin(half) * axis], axis=-1)


def from_matrix(matrix: Array) -> Array:
    """Quaternions (…, 4) of rotation matrices (…, 3, 3), each from its largest component.

    Source: S. W. Shepperd, Quaternion from rotation matrix, J. Guidance and Control 1 (1978) 223.
    """
    m = matrix
    trace = m[..., 0, 0] + m[..., 1, 1] + m[..., 2, 2]
    squares = np.stack([trace, m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]], axis=-1)
    w = np.stack([1 + trace, _d(m, 2, 1), _d(m, 0, 2), _d(m, 1, 0)], -1)
    x = np.stack([_d(m, 2, 1), 1 + 2 * m[..., 0, 0] - trace, _s(m, 0, 1), _s(m, 0, 2)], -1)
    y = np.stack([_d(m, 0, 2), _s(m, 0, 1), 1 + 2 * m[..., 1, 1] - trace, _s(m, 1, 2)], -1)
    z = np.stack([_d(m, 1, 0), _s(m, 0, 2), _s(m, 1, 2), 1 + 2 * m[..., 2, 2] - trace], -1)
    rows = np.stack([w, x, y, z], axis=-2)
    best = np.argmax(squares, axis=-1)
    chosen = np.take_along_axis(rows, best[..., None, None], axis=-2)[..., 0, :]
    unit: Array = chosen / np.linalg.norm(chosen, axis=-1, keepdims=True)
    return unit


def _d(m: Array, i: int, j: int) -> Array:
    difference: Array = m[..., i, j] - m[..., j, i]
    return difference


def _s(m: Array, i: int, j: int) -> Array:
    total: Array = m[..., i, j] + m[..., j, i]
    return total


def rotate(q: Array, v: Array) -> Array:
    """Vectors v (…, 3) turned by unit quaternions q (…, 4)."""
    zero = np.zeros_like(v[..., :1])
    return multiply(multiply(q, np.concatenate([zero, v], axis=-1)), conjugate(q))[..., 1:]


def rate_of(q: Array, omega: Array) -> Array:
    """dq/dt (…, 4) for an angular velocity (…, 3) in the body's frame, rad/s."""
    zero = np.zeros_like(omega[..., :1])
    return multiply(q, np.concatenate([zero, omega], axis=-1)) / 2


def angle_between(p: Array, q: Array) -> Array:
    """The angle of the rotation from p to q, (…) rad, 0 to π; exact also where it is tiny."""
    turn = multiply(conjugate(p), q)
    angle: Array = 2 * np.arctan2(np.linalg.norm(turn[..., 1:], axis=-1), np.abs(turn[..., 0]))
    return angle
