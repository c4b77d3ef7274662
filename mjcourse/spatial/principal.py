"""Principal moments and axes of inertia, and what a body can have for an inertia.

Entry points: `principal_axes`, `is_physical_inertia`.

The eigenvalue problem is solved by Jacobi's method with a quaternion that gathers the rotations:
the axes are a rotation by construction, nearly equal moments need no care, and the same input gives
the same bits on every machine.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mjcourse.spatial._arrays import (
    BoolArray,
    FloatArray,
    IndexArray,
    array,
    components,
    reject,
    split_exponent,
    symmetric,
)
from mjcourse.spatial.rotations import quat_to_mat

SYMMETRIC_WITHIN = 1e-9
"""How far from symmetric a tensor may be, relative to its largest entry."""

_SWEEPS = 30
"""Several times what Jacobi's method needs: it converges cubically in the end."""

_SIGN_SHARE = 0.37
"""The first entry of an axis that has at least this share of its largest is made positive.

A number that no simple geometry has keeps the choice clear of rounding.
"""


@dataclass(frozen=True, slots=True)
class _State:
    """A symmetric matrix on its way to being diagonal, one array of shape (...) per entry."""

    diagonal: tuple[FloatArray, ...]
    """a_kk."""
    off_diagonal: tuple[FloatArray, ...]
    """a_pq, listed by the axis k that is neither p nor q: p = k + 1, q = k + 2 (mod 3)."""
    quat: tuple[FloatArray, ...]
    """The rotation gathered so far: w, x, y, z."""


def principal_axes(inertia: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Principal moments, ascending, and the rotation whose columns are the principal axes.

    MuJoCo orders `body_inertia` otherwise (descending, or as the axes of a single geom come): match
    axes by their moments, never by position. Axes of equal moments are any that span their plane.
    Each of the first two axes has its first large component positive, the third makes the frame
    right-handed; `mat_to_quat` turns the axes into a quaternion.

    Args:
        inertia: (..., 3, 3), kg m², symmetric to 1e-9 of its largest entry; the symmetric part is
            used.

    Returns:
        Moments (..., 3), kg m², and axes (..., 3, 3), of determinant +1. The moments are within 4
        ulp of the largest one, the axes orthonormal to 5 ulp, and axes · diag(moments) · axesᵀ is
        the tensor to within 8 ulp of its largest entry. Where the tensor is graded along its own
        axes, as a thin rod's, the small moments keep their digits. NaN where the tensor has a NaN.

    Raises:
        ValueError: a shape that is not (..., 3, 3), or a tensor that is not symmetric.
    """
    matrix = array("inertia", inertia, (3, 3))
    part, exponent = split_exponent(matrix, axes=2)
    finite = np.isfinite(part).all(axis=(-1, -2), keepdims=True)
    part = np.where(finite, part, np.nan)
    uneven = np.abs(part - np.swapaxes(part, -1, -2)).max(axis=(-1, -2)) > SYMMETRIC_WITHIN
    reject(uneven, "inertia", f"is not symmetric to {SYMMETRIC_WITHIN:g} of its largest entry")
    state = _diagonalize(symmetric(part))
    moments = np.stack(state.diagonal, axis=-1)
    order = np.argsort(moments, axis=-1, kind="stable")
    axes = np.take_along_axis(
        quat_to_mat(np.stack(state.quat, axis=-1)), order[..., None, :], axis=-1
    )
    ascending = np.take_along_axis(moments, order, axis=-1)
    return np.ldexp(ascending, exponent[..., None]), _right_handed(axes, order)


def is_physical_inertia(inertia: ArrayLike, *, rtol: float = 1e-12) -> BoolArray:
    """Whether some distribution of mass has these moments.

    None is negative, and A + B ≥ C for every order of the three.

    MuJoCo's compiler asks the same, without a tolerance and with every moment positive. A + B = C
    is a body flat in one plane, a zero moment a rod without thickness; both pass.

    Args:
        inertia: (..., 3, 3), kg m², about the centre of mass, symmetric to 1e-9 of its largest
            entry.
        rtol: how much of the largest moment may be missing; more for tensors written with few
            digits.

    Returns:
        (...), False where the tensor has a NaN.

    Raises:
        ValueError: a shape that is not (..., 3, 3), or a tensor that is not symmetric.
    """
    moments, _ = principal_axes(inertia)
    part, _ = split_exponent(moments)
    a, b, c = components(part)
    slack = rtol * np.abs(c)
    return np.asarray((a >= -slack) & (a + b >= c - slack))[()]


def _diagonalize(matrix: FloatArray) -> _State:
    """Jacobi's method: turn in the three planes in turn until nothing is left off the diagonal."""
    unit = np.where(np.isnan(matrix[..., 0, 0]), np.nan, 1.0)
    zero = np.zeros_like(unit)
    state = _State(
        diagonal=tuple(matrix[..., k, k] for k in range(3)),
        off_diagonal=tuple(matrix[..., (k + 1) % 3, (k + 2) % 3] for k in range(3)),
        quat=(unit, zero, zero, zero),
    )
    for _ in range(_SWEEPS):
        if not any(np.any(np.abs(entry) > 0) for entry in state.off_diagonal):
            break
        for k in range(3):
            state = _rotate_out(state, k)
    return state


def _rotate_out(state: _State, k: int) -> _State:
    """Turn about axis k so that a_pq becomes zero.

    Source: Golub and Van Loan, "Matrix Computations", 4th edition, section 8.5.
    """
    p, q = (k + 1) % 3, (k + 2) % 3
    app, aqq, apq = state.diagonal[p], state.diagonal[q], state.off_diagonal[k]
    akp, akq = state.off_diagonal[q], state.off_diagonal[p]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        tau = (aqq - app) / (2.0 * apq)
        tangent = np.copysign(1.0, tau) / (np.abs(tau) + np.sqrt(1.0 + tau * tau))
    tangent = np.where(apq != 0, tangent, 0.0)
    cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
    sine = tangent * cosine
    half_cosine = np.sqrt(0.5 * (1.0 + cosine))
    half_sine = -0.5 * sine / half_cosine
    w, qk, qp, qq = (state.quat[n] for n in (0, 1 + k, 1 + p, 1 + q))
    diagonal = {k: state.diagonal[k], p: app - tangent * apq, q: aqq + tangent * apq}
    off_diagonal = {
        k: np.zeros_like(apq),
        q: cosine * akp - sine * akq,
        p: sine * akp + cosine * akq,
    }
    vector = {
        k: qk * half_cosine + w * half_sine,
        p: qp * half_cosine + qq * half_sine,
        q: qq * half_cosine - qp * half_sine,
    }
    return _State(
        diagonal=tuple(diagonal[n] for n in range(3)),
        off_diagonal=tuple(off_diagonal[n] for n in range(3)),
        quat=(w * half_cosine - qk * half_sine, *(vector[n] for n in range(3))),
    )


def _right_handed(axes: FloatArray, order: IndexArray) -> FloatArray:
    """Give the columns their signs. They are a rotation's columns in a new order."""
    large = np.abs(axes) >= _SIGN_SHARE * np.abs(axes).max(axis=-2, keepdims=True)
    first = np.take_along_axis(axes, large.argmax(axis=-2)[..., None, :], axis=-2)
    signs = np.where(first[..., 0, :] < 0, -1.0, 1.0)
    odd = (order[..., 1] - order[..., 0]) % 3 == 2
    signs[..., 2] = np.where(odd, -1.0, 1.0) * signs[..., 0] * signs[..., 1]
    return axes * signs[..., None, :] + 0.0
