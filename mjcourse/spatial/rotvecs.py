"""Rotation vectors: the exponential map of quaternions, its inverse, and what is built on them.

Entry points: `rotvec_to_quat` (the exponential map), `quat_to_rotvec` (the logarithm), `quat_sub`,
`angular_distance`, `quat_slerp`, `quat_integrate`. Conventions are those of `quaternions`.
"""

import numpy as np
from numpy.typing import ArrayLike

from mjcourse.spatial._arrays import (
    FloatArray,
    array,
    arrays,
    components,
    dot2,
    norm,
    split_exponent,
    square_sum,
)
from mjcourse.spatial.quaternions import TINY_ANGLE, join, quat_mul, scale_to_one, unit

# Rows give the components w, x, y, z of conj(a) b as sums of ±a_i b_j: the signs, every i, every j.
# Terms that cancel where a = b stand side by side, so that they cancel to exactly zero.
_SIGNS = np.array([[1, 1, 1, 1], [1, -1, 1, -1], [1, -1, 1, -1], [1, -1, 1, -1]], float)
_FROM_A = np.array([[0, 1, 2, 3], [0, 1, 3, 2], [0, 2, 1, 3], [0, 3, 2, 1]])
_FROM_B = np.array([[0, 1, 2, 3], [1, 0, 2, 3], [2, 0, 3, 1], [3, 0, 1, 2]])


def rotvec_to_quat(rotvec: ArrayLike) -> FloatArray:
    """The exponential map: the unit quaternion of a rotation vector.

    Args:
        rotvec: (..., 3), rad: the axis times the angle, of any size; angles beyond π wrap.

    Returns:
        (..., 4), (cos ½|r|, sin ½|r| · r/|r|), where w < 0 when |r| mod 4π is beyond π and below
        3π. Each component is within 3 ulp of 1 for |r| up to 1e15, and each of the vector part is
        within 4 ulp of itself for |r| up to π, down to denormals.

    Raises:
        ValueError: a shape that is not (..., 3).
    """
    rotvec = array("rotvec", rotvec, (3,))
    part, exponent = split_exponent(rotvec)
    length = np.sqrt(square_sum(part))
    with np.errstate(invalid="ignore", divide="ignore"):
        half = np.ldexp(length, exponent - 1)
        sine, cosine = np.sin(half), np.cos(half)
        wide = half > 1.5
        if np.any(wide):
            # The rounding error of a large angle is many ulp of a turn: it is carried along.
            low = np.ldexp(_length_error(part, length), exponent - 1)
            low_sine, low_cosine = np.sin(low), np.cos(low)
            sine, cosine = (
                np.where(wide, sine * low_cosine + cosine * low_sine, sine),
                np.where(wide, cosine * low_cosine - sine * low_sine, cosine),
            )
        tiny = half < TINY_ANGLE
        vector = np.where(tiny[..., None], rotvec * 0.5, part * (sine / length)[..., None])
    return join(cosine, vector)


def quat_to_rotvec(quat: ArrayLike) -> FloatArray:
    """The logarithm: the rotation vector of a quaternion, the shorter way round.

    MuJoCo's `mju_quat2Vel` divides this by a time.

    Args:
        quat: (..., 4), of any length but zero.

    Returns:
        (..., 3), rad, of length at most π, each component to within 4 ulp of itself, for the
        smallest angles too. At exactly π both signs are right; the one whose first non-zero
        component is positive is returned.

    Raises:
        ValueError: a shape that is not (..., 4), or a zero quaternion.
    """
    part = scale_to_one("quat", array("quat", quat, (4,)))
    return _log(part[..., 0], part[..., 1:])


def quat_sub(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """The rotation vector r that leads from b to a, in b's frame: b ⊗ exp(r) = a.

    MuJoCo's `mju_subQuat`. The product conj(b) ⊗ a is summed in twice the working precision, so
    that the difference of nearly equal rotations keeps its digits.

    Args:
        a: (..., 4), of any length but zero.
        b: (..., 4), of any length but zero.

    Returns:
        (..., 3), rad, of length at most π, to within 4 ulp of its length down to 1e-16 rad, and to
        1e-31 rad below.

    Raises:
        ValueError: a bad shape, leading shapes that do not broadcast, or a zero quaternion.
    """
    w, vector = _relative(a, b)
    return _log(w, -vector)


def angular_distance(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """The angle of the rotation between two rotations, by atan2 rather than arccos.

    Args:
        a: (..., 4), of any length but zero.
        b: (..., 4), of any length but zero.

    Returns:
        (...), rad, from 0 to π, to within 4 ulp down to 1e-16 rad, and to 1e-31 rad below.

    Raises:
        ValueError: a bad shape, leading shapes that do not broadcast, or a zero quaternion.
    """
    w, vector = _relative(a, b)
    half: FloatArray = np.arctan2(norm(vector), np.abs(w))
    return 2.0 * half


def quat_slerp(a: ArrayLike, b: ArrayLike, t: ArrayLike) -> FloatArray:
    """Spherical interpolation: from a towards b at a constant rate, the shorter way round.

    Source: Shoemake, "Animating rotation with quaternion curves", SIGGRAPH 1985.

    Args:
        a: (..., 4), of any length but zero: the rotation at t = 0.
        b: (..., 4), of any length but zero: the rotation at t = 1. Where it is half a turn from a,
            both ways are equally short, and the one that `quat_sub` takes is taken.
        t: (...), any real number; beyond 0 and 1 the rotation goes on at the same rate.

    Returns:
        (..., 4), of unit length, to within 4 ulp of 1 for t from 0 to 1; at t = 1 it can be −b.

    Raises:
        ValueError: a bad shape, leading shapes that do not broadcast, or a zero quaternion.
    """
    start, end, t = arrays(("a", a, (4,)), ("b", b, (4,)), ("t", t, ()))
    with np.errstate(invalid="ignore"):
        rotvec = _log(*_relative(start, end))
        return quat_mul(unit("a", start), rotvec_to_quat(t[..., None] * rotvec))


def quat_integrate(quat: ArrayLike, angvel: ArrayLike, dt: ArrayLike) -> FloatArray:
    """The orientation after turning at a constant body-frame angular velocity: q ⊗ exp(ω dt).

    Exact, whatever the time; MuJoCo's `mju_quatIntegrate`. The result is normalised, so that the
    length does not drift over many steps.

    Args:
        quat: (..., 4), of any length but zero.
        angvel: (..., 3), rad/s, in the frame that turns, as `qvel` of a free or ball joint is.
        dt: (...), s, of either sign.

    Returns:
        (..., 4), of unit length, to within 4 ulp of 1 while |ω dt| is at most π.

    Raises:
        ValueError: a bad shape, leading shapes that do not broadcast, or a zero quaternion.
    """
    start, angvel, dt = arrays(("quat", quat, (4,)), ("angvel", angvel, (3,)), ("dt", dt, ()))
    return quat_mul(unit("quat", start), rotvec_to_quat(angvel * dt[..., None]))


def _length_error(part: FloatArray, length: FloatArray) -> FloatArray:
    """The correction that gives the rounded length of a vector twice the working precision."""
    left = np.concatenate((part, -length[..., None]), axis=-1)
    right = np.concatenate((part, length[..., None]), axis=-1)
    return dot2(left, right) / (2.0 * length)


def _relative(a: ArrayLike, b: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Scalar and vector part of a positive multiple of conj(a) ⊗ b, summed by `dot2`."""
    a, b = arrays(("a", a, (4,)), ("b", b, (4,)))
    a, b = scale_to_one("a", a), scale_to_one("b", b)
    product = dot2(_SIGNS * a[..., _FROM_A], b[..., _FROM_B])
    return product[..., 0], product[..., 1:]


def _log(w: FloatArray, vector: FloatArray) -> FloatArray:
    """The rotation vector of a quaternion of length about 1, given in two parts."""
    x, y, z = components(vector)
    leading = np.where(w != 0, w, np.where(x != 0, x, np.where(y != 0, y, z)))
    sign = np.where(leading < 0, -1.0, 1.0)
    w, length = np.abs(w), norm(vector)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        tiny = length < TINY_ANGLE * w
        factor = np.where(tiny, 2.0 / w, 2.0 * np.arctan2(length, w) / length)
    rotvec: FloatArray = vector * (sign * factor)[..., None] + 0.0
    return rotvec
