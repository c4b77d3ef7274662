"""Euler angles, in MuJoCo's `eulerseq` notation.

Entry points: `euler_to_quat`, `quat_to_euler`.

A sequence is three of the letters x, y, z, no two neighbours the same, so that all twelve
conventions are covered. Lower case turns about the axes of the moving frame (intrinsic), as MJCF's
default `xyz` does; upper case about those of the fixed frame (extrinsic).
"""

import numpy as np
from numpy.typing import ArrayLike

from mjcourse.spatial._arrays import FloatArray, array, norm
from mjcourse.spatial.quaternions import axis_angle_to_quat, quat_mul
from mjcourse.spatial.rotations import quat_to_mat

_LOCKED_WITHIN = 2.0**-50
"""A sine or cosine up to this is rounding alone: first and third angle cannot be told apart."""


def euler_to_quat(angles: ArrayLike, seq: str = "xyz") -> FloatArray:
    """The unit quaternion of three Euler angles. MuJoCo's `mju_euler2Quat`.

    Args:
        angles: (..., 3), rad, in the order of the sequence.
        seq: three of x, y, z (intrinsic) or of X, Y, Z (extrinsic), no two neighbours the same.

    Returns:
        (..., 4), each component to within 4 ulp of 1.

    Raises:
        ValueError: a shape that is not (..., 3), or no such sequence.
    """
    angles = array("angles", angles, (3,))
    first, second, third = (
        axis_angle_to_quat(np.eye(3)[axis], angles[..., k]) for k, axis in enumerate(_axes(seq))
    )
    if seq.isupper():
        return quat_mul(third, quat_mul(second, first))
    return quat_mul(first, quat_mul(second, third))


def quat_to_euler(quat: ArrayLike, seq: str = "xyz") -> FloatArray:
    """The Euler angles of a rotation.

    The first angle is taken out of the matrix before the third is read (Herter and Lott,
    "Algorithms for decomposing 3-D orthogonal matrices into primitive rotations", Computers &
    Graphics 17, 1993), so that the three together give the rotation back to 6 ulp of 1 as a
    quaternion, at gimbal lock and beside it too.

    Args:
        quat: (..., 4), of any length but zero.
        seq: three of x, y, z (intrinsic) or of X, Y, Z (extrinsic), no two neighbours the same.

    Returns:
        (..., 3), rad. The first and the third are in [−π, π]; the second is in [−π/2, π/2] where
        three different axes are named, else in [0, π]. In gimbal lock, to within 1e-15, only their
        sum or difference is determined: the first angle of an intrinsic sequence, the last of an
        extrinsic one, is then 0.

    Raises:
        ValueError: a shape that is not (..., 4), a zero quaternion, or no such sequence.
    """
    axes = _axes(seq)
    mat = quat_to_mat(quat)
    # Turning about fixed axes is turning about moving ones in the opposite order.
    angles = _intrinsic(mat, axes[::-1])[..., ::-1] if seq.isupper() else _intrinsic(mat, axes)
    return np.ascontiguousarray(angles)


def _axes(seq: str) -> tuple[int, int, int]:
    axes = tuple("xyz".find(letter) for letter in seq.lower())
    has_one_case = seq.islower() or seq.isupper()
    match axes:
        case (i, j, k) if min(axes) >= 0 and i != j != k and has_one_case:
            return i, j, k
    raise ValueError(
        f"seq must be three of x, y, z or of X, Y, Z, no two neighbours the same, got {seq!r}"
    )


def _intrinsic(m: FloatArray, axes: tuple[int, int, int]) -> FloatArray:
    """Angles of the matrix R_i(first) R_j(second) R_k(third)."""
    i, j, last = axes
    k = 3 - i - j
    s = 1.0 if (j - i) % 3 == 1 else -1.0
    # Where the second turn takes the third axis, or the first again, along and across axis i.
    sine, cosine = (
        (m[..., j, i], -s * m[..., k, i]) if last == i else (-s * m[..., j, k], m[..., k, k])
    )
    radius = norm(np.stack((sine, cosine), axis=-1))
    first = np.where(radius <= _LOCKED_WITHIN, 0.0, np.arctan2(sine + 0.0, cosine))
    if last == i:
        second = np.arctan2(radius, m[..., i, i])
    else:
        second = np.arctan2(s * m[..., i, k], norm(m[..., i, [i, j]]))
    # Row j of R_j(second) R_last(third) is row j of R_last(third).
    row = np.cos(first)[..., None] * m[..., j, :] + s * np.sin(first)[..., None] * m[..., k, :]
    third = (
        np.arctan2(-s * row[..., k] + 0.0, row[..., j])
        if last == i
        else np.arctan2(s * row[..., i] + 0.0, row[..., j])
    )
    return np.stack((first, second, third), axis=-1) + 0.0
