"""Rotations as quaternions in MuJoCo's order w, x, y, z, by nothing of MuJoCo's.

All take arrays with any leading shapes that fit together. Quaternions have length 1; an axis may
have any length but zero.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

Array = np.ndarray[Any, np.dtype[np.float64]]
_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


def quat_mul(a: ArrayLike, b: ArrayLike) -> Array:
    """The rotation b followed by the rotation a."""
    aw, ax, ay, az = np.moveaxis(np.asarray(a, float), -1, 0)
    bw, bx, by, bz = np.moveaxis(np.asarray(b, float), -1, 0)
    product = (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )
    return np.stack(product, axis=-1)


def quat_conj(quat: ArrayLike) -> Array:
    """The inverse rotation."""
    conjugate: Array = np.asarray(quat, float) * _CONJUGATE
    return conjugate


def axis_angle_to_quat(axis: ArrayLike, angle: ArrayLike) -> Array:
    """The rotation by an angle (rad) about an axis."""
    axis, half = np.asarray(axis, float), 0.5 * np.asarray(angle, float)[..., None]
    vector = np.sin(half) * (axis / np.linalg.norm(axis, axis=-1, keepdims=True))
    scalar = np.broadcast_to(np.cos(half), (*vector.shape[:-1], 1))
    return np.concatenate((scalar, vector), axis=-1)


def rotate(quat: ArrayLike, vector: ArrayLike) -> Array:
    """Vectors (..., 3) turned by a rotation, whose quaternion may have any length but zero."""
    quat, vector = np.asarray(quat, float), np.asarray(vector, float)
    pure = np.concatenate((np.zeros((*vector.shape[:-1], 1)), vector), axis=-1)
    product = quat_mul(quat_mul(quat, pure), quat_conj(quat))[..., 1:]
    rotated: Array = product / np.sum(quat * quat, axis=-1, keepdims=True)
    return rotated


def angular_distance(a: ArrayLike, b: ArrayLike) -> Array:
    """The angle between two rotations, rad, from 0 to π; nearly equal ones keep its digits.

    conj(a) ⊗ a has no vector part, so that of conj(a) ⊗ b is that of conj(a) ⊗ (b − a), where
    little is left to cancel.
    """
    a, b = np.asarray(a, float), np.asarray(b, float)
    b = np.where(np.sum(a * b, axis=-1, keepdims=True) < 0, -b, b)
    vector = quat_mul(quat_conj(a), b - a)[..., 1:]
    half: Array = np.arctan2(np.linalg.norm(vector, axis=-1), np.abs(np.sum(a * b, axis=-1)))
    return 2.0 * half
