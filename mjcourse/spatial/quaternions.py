"""Quaternions in MuJoCo's order w, x, y, z, as rotations.

Entry points: `quat_mul`, `quat_conj`, `quat_normalize`, `quat_rotate`, `axis_angle_to_quat`,
`rotvec_to_quat` (the exponential map), `quat_to_rotvec` (the logarithm), `quat_sub`,
`angular_distance`, `quat_slerp`, `quat_integrate`.

The quaternion of a frame B seen from a frame A turns components in B into components in A, as
`body_iquat` does from the principal axes to the body and `xquat` from the body to the world.

Wherever a quaternion stands for a rotation its length does not matter: every non-zero quaternion,
however large or small, is taken for the rotation of its direction, and q and −q are the same one. A
zero quaternion is a ValueError. NaN or infinity in a quaternion gives NaN for that entry and leaves
the others alone.
"""

import numpy as np
from numpy.typing import ArrayLike

from mjcourse.spatial._arrays import (
    FloatArray,
    array,
    arrays,
    components,
    cross,
    reject,
    split_exponent,
    square_sum,
)

TINY_ANGLE = 2.0**-27
"""Below this sin x = x and tan x = x to within an eighth of an ulp."""

_CONJUGATE: FloatArray = np.array([1.0, -1.0, -1.0, -1.0])


def quat_mul(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """Hamilton's product a ⊗ b: the rotation b followed by the rotation a.

    The plain product of algebra, for quaternions of any length: nothing is normalised, and a
    product beyond the range of doubles overflows as NumPy's arithmetic does.

    Args:
        a: (..., 4).
        b: (..., 4).

    Returns:
        (..., 4), each component to within 2 ulp of the product of the lengths.

    Raises:
        ValueError: a shape that is not (..., 4), or leading shapes that do not broadcast.
    """
    a, b = arrays(("a", a, (4,)), ("b", b, (4,)))
    aw, ax, ay, az = components(a)
    bw, bx, by, bz = components(b)
    return np.stack(
        (
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ),
        axis=-1,
    )


def quat_conj(quat: ArrayLike) -> FloatArray:
    """The conjugate (w, −x, −y, −z): the inverse rotation. Exact.

    Args:
        quat: (..., 4), of any length.

    Returns:
        (..., 4).

    Raises:
        ValueError: a shape that is not (..., 4).
    """
    # Adding zero turns the negative zeros, which print badly, into zeros.
    return array("quat", quat, (4,)) * _CONJUGATE + 0.0


def quat_normalize(quat: ArrayLike) -> FloatArray:
    """The unit quaternion of the same direction and sign.

    MuJoCo's `mju_normalize4` turns a quaternion shorter than 1e-15 into the identity instead.

    Args:
        quat: (..., 4), of any length but zero, denormal and huge components included.

    Returns:
        (..., 4), each component to within 2 ulp.

    Raises:
        ValueError: a shape that is not (..., 4), or a zero quaternion.
    """
    return unit("quat", array("quat", quat, (4,)))


def quat_rotate(quat: ArrayLike, vector: ArrayLike) -> FloatArray:
    """Turn vectors: components in the turned frame become components in the fixed one.

    Args:
        quat: (..., 4), of any length but zero.
        vector: (..., 3), in any unit, below 1e307 in size.

    Returns:
        (..., 3), in the unit of `vector`, to within 6 ulp of the vector's length.

    Raises:
        ValueError: a bad shape, leading shapes that do not broadcast, or a zero quaternion.
    """
    quat, vector = arrays(("quat", quat, (4,)), ("vector", vector, (3,)))
    part = scale_to_one("quat", quat)
    axis = part[..., 1:]
    twice = cross(axis, vector) * (2.0 / square_sum(part))[..., None]
    return vector + part[..., :1] * twice + cross(axis, twice)


def axis_angle_to_quat(axis: ArrayLike, angle: ArrayLike) -> FloatArray:
    """The unit quaternion of a rotation by an angle about an axis.

    Args:
        axis: (..., 3), of any length but zero.
        angle: (...), rad, right-handed about the axis.

    Returns:
        (..., 4), (cos ½angle, sin ½angle · axis/|axis|), each component of the
        vector part to within 4 ulp of itself.

    Raises:
        ValueError: a bad shape, leading shapes that do not broadcast, or a zero axis.
    """
    axis, angle = arrays(("axis", axis, (3,)), ("angle", angle, ()))
    axis = unit("axis", axis)
    with np.errstate(invalid="ignore"):
        half, tiny = 0.5 * angle, np.abs(angle) < TINY_ANGLE
        # Half of a denormal angle would lose its last bit; half of the unit axis is exact.
        factor = np.where(tiny, angle, np.sin(half))
        vector = factor[..., None] * (np.where(tiny, 0.5, 1.0)[..., None] * axis)
        return join(np.cos(half), vector)


def scale_to_one(name: str, value: FloatArray) -> FloatArray:
    """A vector scaled by a power of two so that its largest entry is in [0.5, 1).

    NaN where it is not finite.

    Raises:
        ValueError: a zero vector, which has no direction.
    """
    reject(~value.any(axis=-1), name, "is zero and has no direction")
    part, _ = split_exponent(value)
    finite = np.isfinite(part).all(axis=-1, keepdims=True)
    return part if np.all(finite) else np.where(finite, part, np.nan)


def unit(name: str, value: FloatArray) -> FloatArray:
    """A vector divided by its length; NaN where it is not finite.

    Raises:
        ValueError: a zero vector, which has no direction.
    """
    part = scale_to_one(name, value)
    return part / np.sqrt(square_sum(part))[..., None]


def join(w: FloatArray, vector: FloatArray) -> FloatArray:
    """A quaternion of its scalar and vector parts."""
    w = np.broadcast_to(w, vector.shape[:-1])
    return np.concatenate((w[..., None], vector), axis=-1)
