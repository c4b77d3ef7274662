"""Rotation matrices and skew-symmetric matrices.

Entry points: `quat_to_mat`, `mat_to_quat`, `exp_so3` and `log_so3` (rotation vectors), `skew` and
`unskew`.

A rotation matrix turns components in the frame B that it belongs to into components in the frame A
that it is seen from; its columns are B's axes in A, as those of `data.xmat` are the body's axes in
the world.
"""

import numpy as np
from numpy.typing import ArrayLike

from mjcourse.spatial._arrays import (
    BoolArray,
    FloatArray,
    array,
    components,
    cross,
    dot,
    matrix,
    reject,
    square_sum,
)
from mjcourse.spatial.quaternions import scale_to_one
from mjcourse.spatial.rotvecs import quat_to_rotvec, rotvec_to_quat

ORTHONORMAL_WITHIN = 1e-5
"""How far from orthonormal the columns of a rotation may be: single precision passes."""


def quat_to_mat(quat: ArrayLike) -> FloatArray:
    """The rotation matrix of a quaternion.

    Args:
        quat: (..., 4), of any length but zero.

    Returns:
        (..., 3, 3), each entry to within 4 ulp of 1, the columns orthonormal to 5 ulp. The entries
        off the diagonal keep the digits of small angles.

    Raises:
        ValueError: a shape that is not (..., 4), or a zero quaternion.
    """
    part = scale_to_one("quat", array("quat", quat, (4,)))
    w, x, y, z = components(part)
    ww, xx, yy, zz = components(part * part)
    rows = (
        ((ww + xx) - (yy + zz), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), (ww + yy) - (xx + zz), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), (ww + zz) - (xx + yy)),
    )
    return matrix(rows) / ((ww + xx) + (yy + zz))[..., None, None]


def mat_to_quat(mat: ArrayLike) -> FloatArray:
    """The unit quaternion of a rotation matrix.

    The matrix gives 4 q qᵀ; the column with the largest diagonal entry is taken and normalised, so
    that nothing is lost at any angle. Source: Shepperd, "Quaternion from rotation matrix", J.
    Guidance and Control 1 (1978).

    Args:
        mat: (..., 3, 3), orthonormal to 1e-5, of determinant +1.

    Returns:
        (..., 4), w ≥ 0, and at w = 0 the first non-zero component positive; each component to
        within 3 ulp of 1, the vector part of a small rotation to within 3 ulp of itself. NaN where
        the matrix has a NaN.

    Raises:
        ValueError: a shape that is not (..., 3, 3), or a matrix that is not a rotation.
    """
    m = array("mat", mat, (3, 3))
    _require_rotation(m)
    (a, b, c), (d, e, f), (g, h, i) = (
        components(row) for row in components(np.swapaxes(m, -1, -2))
    )
    wx, wy, wz = h - f, c - g, d - b
    xy, xz, yz = d + b, c + g, h + f
    table = matrix(
        (
            (1.0 + a + e + i, wx, wy, wz),
            (wx, 1.0 + a - e - i, xy, xz),
            (wy, xy, 1.0 - a + e - i, yz),
            (wz, xz, yz, 1.0 - a - e + i),
        )
    )
    best = np.argmax(np.diagonal(table, axis1=-2, axis2=-1), axis=-1)
    column = np.take_along_axis(table, best[..., None, None], axis=-2)[..., 0, :]
    return _upper(column / np.sqrt(square_sum(column))[..., None])


def exp_so3(rotvec: ArrayLike) -> FloatArray:
    """The exponential map to matrices: the rotation by |r| about r.

    Rodrigues' formula, by way of the quaternion.

    Args:
        rotvec: (..., 3), rad, of any size.

    Returns:
        (..., 3, 3), each entry to within 5 ulp of 1 for |r| up to 1e15.

    Raises:
        ValueError: a shape that is not (..., 3).
    """
    return quat_to_mat(rotvec_to_quat(array("rotvec", rotvec, (3,))))


def log_so3(mat: ArrayLike) -> FloatArray:
    """The logarithm of a rotation matrix: its rotation vector, the shorter way round.

    Args:
        mat: (..., 3, 3), orthonormal to 1e-5, of determinant +1.

    Returns:
        (..., 3), rad, of length at most π, to within 8 ulp of 1, near π as well; a small rotation
        to within 8 ulp of itself. At exactly π both signs are right; the one whose first non-zero
        component is positive is returned.

    Raises:
        ValueError: a shape that is not (..., 3, 3), or a matrix that is not a rotation.
    """
    return quat_to_rotvec(mat_to_quat(mat))


def skew(vector: ArrayLike) -> FloatArray:
    """The skew-symmetric matrix [v]× of a cross product: [v]× u = v × u. Exact.

    Args:
        vector: (..., 3).

    Returns:
        (..., 3, 3), in the unit of `vector`.

    Raises:
        ValueError: a shape that is not (..., 3).
    """
    x, y, z = components(array("vector", vector, (3,)))
    zero = np.zeros_like(x)
    return matrix(((zero, zero - z, y), (z, zero, zero - x), (zero - y, x, zero)))


def unskew(mat: ArrayLike) -> FloatArray:
    """The vector of the skew-symmetric part of a matrix; exactly v for `skew(v)`.

    Args:
        mat: (..., 3, 3).

    Returns:
        (..., 3), in the unit of `mat`.

    Raises:
        ValueError: a shape that is not (..., 3, 3).
    """
    m = array("mat", mat, (3, 3))
    pairs = (
        (m[..., 2, 1], m[..., 1, 2]),
        (m[..., 0, 2], m[..., 2, 0]),
        (m[..., 1, 0], m[..., 0, 1]),
    )
    return np.stack([up - 0.5 * (up + down) for up, down in pairs], axis=-1)


def _upper(quat: FloatArray) -> FloatArray:
    """The one of q and −q whose first non-zero component is positive."""
    first = np.take_along_axis(quat, (quat != 0).argmax(axis=-1)[..., None], axis=-1)
    return np.where(first < 0, -quat, quat) + 0.0


def _require_rotation(m: FloatArray) -> None:
    """Raise a ValueError at the first matrix that is no rotation; one with a NaN passes."""
    x, y, z = (m[..., :, k] for k in range(3))
    with np.errstate(invalid="ignore", over="ignore"):
        lengths = (np.abs(square_sum(column) - 1.0) for column in (x, y, z))
        angles = (np.abs(dot(a, b)) for a, b in ((x, y), (y, z), (z, x)))
        worst: BoolArray = np.stack((*lengths, *angles)).max(axis=0) > ORTHONORMAL_WITHIN
        reject(
            worst,
            "mat",
            f"is not a rotation: its columns are not orthonormal to {ORTHONORMAL_WITHIN:g}",
        )
        reject(
            dot(cross(x, y), z) < 0, "mat", "is a reflection, not a rotation: its determinant is -1"
        )
