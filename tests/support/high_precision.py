"""Exact answers to sixty digits, and errors in units of the last place.

Every reference takes doubles, reads them as the exact numbers that they are, and follows the
textbook formula.
"""

from collections.abc import Iterable, Mapping, Sequence

import mpmath
import numpy as np
from numpy.typing import ArrayLike

mpmath.mp.dps = 60

ULP = mpmath.mpf(2) ** -52
DENORMAL = mpmath.mpf(2) ** -1074

Vector = list[mpmath.mpf]


def exact(value: ArrayLike) -> Vector:
    return [mpmath.mpf(float(entry)) for entry in np.ravel(np.asarray(value))]


def length(vector: Sequence[mpmath.mpf]) -> mpmath.mpf:
    return mpmath.sqrt(sum(entry * entry for entry in vector))


def unit(vector: Sequence[mpmath.mpf]) -> Vector:
    size = length(vector)
    return [entry / size for entry in vector]


def conj(q: Sequence[mpmath.mpf]) -> Vector:
    return [q[0], -q[1], -q[2], -q[3]]


def mul(p: Sequence[mpmath.mpf], q: Sequence[mpmath.mpf]) -> Vector:
    a, b, c, d = p
    e, f, g, h = q
    return [
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    ]


def exp(rotvec: Sequence[mpmath.mpf]) -> Vector:
    angle = length(rotvec)
    if angle == 0:
        return [mpmath.mpf(1), mpmath.mpf(0), mpmath.mpf(0), mpmath.mpf(0)]
    share = mpmath.sin(angle / 2) / angle
    return [mpmath.cos(angle / 2), *(share * entry for entry in rotvec)]


def log(q: Sequence[mpmath.mpf]) -> Vector:
    """The rotation vector, of length at most π; at π the first non-zero component is positive."""
    leading = next(entry for entry in q if entry)
    w, *vector = q if leading > 0 else [-entry for entry in q]
    size = length(vector)
    if size == 0:
        return [mpmath.mpf(0)] * 3
    share = 2 * mpmath.atan2(size, w) / size
    return [share * entry for entry in vector]


def matrix(q: Sequence[mpmath.mpf]) -> Vector:
    w, x, y, z = unit(q)
    return [
        1 - 2 * (y * y + z * z),
        2 * (x * y - w * z),
        2 * (x * z + w * y),
        2 * (x * y + w * z),
        1 - 2 * (x * x + z * z),
        2 * (y * z - w * x),
        2 * (x * z - w * y),
        2 * (y * z + w * x),
        1 - 2 * (x * x + y * y),
    ]


def matmul(a: Sequence[mpmath.mpf], b: Sequence[mpmath.mpf], n: int = 3) -> Vector:
    """The product of two n × n matrices, row by row."""
    cells = [(i, j) for i in range(n) for j in range(n)]
    return [sum(a[n * i + k] * b[n * k + j] for k in range(n)) for i, j in cells]


def transpose(a: Sequence[mpmath.mpf], n: int = 3) -> Vector:
    return [a[n * j + i] for i in range(n) for j in range(n)]


def rotate(q: Sequence[mpmath.mpf], vector: Sequence[mpmath.mpf]) -> Vector:
    rows = matrix(q)
    return [sum(rows[3 * i + j] * vector[j] for j in range(3)) for i in range(3)]


def ulps_of(size: mpmath.mpf, actual: ArrayLike, expected: Iterable[mpmath.mpf]) -> float:
    pairs = zip(exact(actual), expected, strict=True)
    return _largest(abs(g - w) / (ULP * size) for g, w in pairs)


def entry_ulps(actual: ArrayLike, expected: Iterable[mpmath.mpf]) -> float:
    """The largest error, each in ulp of its entry, or in denormal steps if those are larger."""
    pairs = zip(exact(actual), expected, strict=True)
    return _largest(abs(g - w) / max(ULP * abs(w), DENORMAL) for g, w in pairs)


def _largest(errors: Iterable[mpmath.mpf]) -> float:
    """Return the largest error, or nan if there is one, which `max` alone may skip."""
    return float(max(errors, key=lambda error: (mpmath.isnan(error), error)))


def errors_over(limit: float, errors: Mapping[object, float]) -> list[str]:
    """Return a message for each case whose error, in ulp, is over the limit or not a number."""
    assert errors, "no case was looked at"
    return [
        f"{case}: {error:.4g} ulp, over {limit}"
        for case, error in errors.items()
        if not error <= limit
    ]


def same_up_to_sign(actual: ArrayLike, expected: Sequence[mpmath.mpf]) -> Vector:
    """Return the one of q and −q that is nearer."""
    agree = sum(g * w for g, w in zip(exact(actual), expected, strict=True))
    return list(expected) if agree >= 0 else [-entry for entry in expected]


def _next(value: float, toward: float) -> float:
    return float(np.nextafter(value, toward))


PI = float(np.pi)

SMALL_ANGLES = (5e-324, 1.5e-323, 1e-320, 2.3e-308, 1e-300, 1e-160, 1e-30, 1e-16, 1e-8)
"""Down to the smallest double; the first three are denormal."""

THRESHOLDS = tuple(
    at
    for base in (2.0**-27, 2.0**-26, 2.0**-20, 2.0**-12, 3.0, PI)
    for at in (_next(base, 0.0), base, _next(base, 9.0))
)
"""Where an implementation can change its formula."""

NEAR_PI = (
    PI - 1e-3,
    PI - 1e-8,
    PI - 1e-15,
    _next(PI, 0.0),
    PI,
    _next(PI, 9.0),
    PI + 1e-15,
    PI + 1e-8,
)

PLAIN_ANGLES = (0.1, 0.7, 1.0, PI / 2, 2.0, 3.1)

AXES = (
    (1.0, 0.0, 0.0),
    (0.0, 0.0, -1.0),
    (1.0, 1.0, 1.0),
    (3.0, -4.0, 12.0),
    (0.3, -0.7, 0.2),
    (-1.0, 1e-8, 1e-9),
    (1e-160, 1.0, -1e-300),
    (-0.6, 0.8, 5e-324),
)

SIZES = (1.0, 0.3, 1e-3, 1e-155, 1e-160, 1e-300, 2.5e-308, 3e-320, 1e100, 1e154, 1e300, 8e307)
"""Lengths to give a quaternion; their squares overflow, underflow, or are denormal."""
