"""Array helpers that all routines of `spatial` share.

Entry points: `array` and `arrays`, which check shapes; `split_exponent` and `norm`, which
neither overflow nor underflow; `dot2`, a dot product with twice the working precision.

Vectors and matrices lie in the last one or two axes; every axis before them is leading, and leading
axes broadcast.
"""

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray: TypeAlias = NDArray[np.float64]
BoolArray: TypeAlias = NDArray[np.bool_]
IntArray: TypeAlias = NDArray[np.int32]
IndexArray: TypeAlias = NDArray[np.intp]

_SPLITTER = 2.0**27 + 1.0
"""Dekker's constant for a 53-bit significand."""


def array(name: str, value: ArrayLike, core: tuple[int, ...]) -> FloatArray:
    """Read an argument as doubles of shape `(..., *core)`.

    Raises:
        ValueError: another shape, or a ragged sequence.
        TypeError: not real numbers.
    """
    try:
        raw = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name} must have shape {_shape(core)}, got a ragged sequence") from error
    if raw.dtype.kind not in "biuf":
        raise TypeError(f"{name} must hold real numbers, got dtype {raw.dtype}")
    if raw.ndim < len(core) or raw.shape[raw.ndim - len(core) :] != core:
        raise ValueError(f"{name} must have shape {_shape(core)}, got {raw.shape}")
    return raw.astype(np.float64, copy=False)


def _shape(core: tuple[int, ...]) -> str:
    return f"({', '.join(('...', *map(str, core)))})"


def arrays(*arguments: tuple[str, ArrayLike, tuple[int, ...]]) -> tuple[FloatArray, ...]:
    """Read arguments like `array`, whose leading shapes must broadcast.

    Raises:
        ValueError: another shape, a ragged sequence, or leading shapes that do not broadcast.
        TypeError: not real numbers.
    """
    values = tuple(array(*argument) for argument in arguments)
    pairs = zip(values, arguments, strict=True)
    shapes = [value.shape[: value.ndim - len(core)] for value, (_, _, core) in pairs]
    try:
        np.broadcast_shapes(*shapes)
    except ValueError:
        names = (name for name, _, _ in arguments)
        text = ", ".join(f"{name} {shape}" for name, shape in zip(names, shapes, strict=True))
        raise ValueError(f"leading shapes do not broadcast: {text}") from None
    return values


def reject(bad: BoolArray | np.bool_, subject: str, complaint: str) -> None:
    """Raise a ValueError that names the first bad entry, if there is one."""
    if np.any(bad):
        place = f" at index {tuple(map(int, np.argwhere(bad)[0]))}" if np.ndim(bad) else ""
        raise ValueError(f"{subject}{place} {complaint}")


def split_exponent(value: FloatArray, axes: int = 1) -> tuple[FloatArray, IntArray]:
    """Split a vector or matrix into a part of size about 1 and a power of two.

    value = part · 2^exponent, where the largest entry of the part is in [0.5, 1). Exact, but for
    entries that are less than 2^-1022 of the largest. Zero, NaN and infinity get exponent 0.

    Args:
        value: (..., *core).
        axes: how many axes `core` has.
    """
    core = tuple(range(-axes, 0))
    largest = np.abs(value).max(axis=core)
    _, exponent = np.frexp(largest)
    exponent = np.where(np.isfinite(largest), exponent, np.int32(0))
    return np.ldexp(value, -np.expand_dims(exponent, core)), exponent


def components(value: FloatArray) -> tuple[FloatArray, ...]:
    """The entries along the last axis, each of shape (...)."""
    return tuple(value[..., k] for k in range(value.shape[-1]))


def square_sum(value: FloatArray) -> FloatArray:
    """The sum of squares over the last axis, added from left to right."""
    first, *rest = components(value)
    total = first * first
    for entry in rest:
        total = total + entry * entry
    return total


def norm(value: FloatArray) -> FloatArray:
    """The Euclidean norm over the last axis, to 2.5 ulp over the whole range of doubles."""
    part, exponent = split_exponent(value)
    return np.ldexp(np.sqrt(square_sum(part)), exponent)


def dot(a: FloatArray, b: FloatArray) -> FloatArray:
    """The inner product over the last axis."""
    products = components(a * b)
    total = products[0]
    for entry in products[1:]:
        total = total + entry
    return total


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """The cross product of 3-vectors."""
    ax, ay, az = components(a)
    bx, by, bz = components(b)
    return np.stack((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx), axis=-1)


def matrix(rows: tuple[tuple[FloatArray, ...], ...]) -> FloatArray:
    """A matrix of its entries, each of shape (...)."""
    flat = np.stack([entry for row in rows for entry in row], axis=-1)
    return flat.reshape(*flat.shape[:-1], len(rows), len(rows[0]))


def symmetric(value: FloatArray) -> FloatArray:
    """The symmetric part of a matrix; exactly the matrix where it is symmetric."""
    return 0.5 * (value + np.swapaxes(value, -1, -2))


def _two_sum(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sum and rounding error, a + b = sum + error exactly (Knuth, 1969)."""
    total = a + b
    shadow = total - a
    return total, (a - (total - shadow)) + (b - shadow)


def _split(a: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two halves of 26 bits each, a = high + low exactly (Dekker, 1971)."""
    shifted = _SPLITTER * a
    high = shifted - (shifted - a)
    return high, a - high


def _two_product(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Product and rounding error, a · b = product + error but for underflow (Dekker, 1971)."""
    product = a * b
    ah, al = _split(a)
    bh, bl = _split(b)
    return product, al * bl - (((product - ah * bh) - al * bh) - ah * bl)


def dot2(a: FloatArray, b: FloatArray) -> FloatArray:
    """The inner product over the last axis, as if computed in twice the working precision.

    Algorithm Dot2 of Ogita, Rump and Oishi, "Accurate sum and dot product", SIAM J. Sci. Comput. 26
    (2005). The entries must be well below 2^996 in size.
    """
    products, errors = _two_product(a, b)
    total = products[..., 0]
    correction = errors[..., 0]
    for k in range(1, products.shape[-1]):
        total, error = _two_sum(total, products[..., k])
        correction = correction + (error + errors[..., k])
    return total + correction
