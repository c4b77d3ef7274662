"""Elliptic integrals and Jacobi's elliptic functions by the arithmetic–geometric mean.

Entry points: `complete_k(m1)`, `jacobi(u, m1)`.

Both take the complementary parameter m₁ = 1 − m: where m is near 1, as for a body that turns about
its intermediate axis, 1 − m computed from m would have lost its digits.

Source: M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions, 16.4, 17.3 and 17.6; the
recurrence for dn is Bulirsch's, which loses nothing near the quarter period (R. Bulirsch,
Numerische Mathematik 7 (1965) 78).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def complete_k(m1: float) -> float:
    """The complete integral K(m), m = 1 − m₁, with 0 < m₁ ≤ 1: a quarter of the period of sn.

    Raises:
        ValueError: m₁ is not in that range.
    """
    if not 0.0 < m1 <= 1.0:
        raise ValueError(f"the complementary parameter must be in (0, 1], not {m1!r}")
    a, g = 1.0, math.sqrt(m1)
    while abs(a - g) > 1e-16 * a:
        a, g, before = (a + g) / 2, math.sqrt(a * g), a - g
        if abs(a - g) >= abs(before):  # only rounding is left
            break
    return math.pi / (a + g)


def jacobi(u: Array, m1: float) -> tuple[Array, Array, Array]:
    """sn(u|m), cn(u|m), dn(u|m) with m = 1 − m₁ for real u of any shape.

    The argument is first brought into |u| ≤ K by the period, so that large u lose only what the
    period itself lacks.

    Raises:
        ValueError: m₁ is not in (0, 1].
    """
    quarter = complete_k(m1)
    turns = np.round(np.asarray(u, dtype=np.float64) / (2 * quarter))
    reduced = np.asarray(u, dtype=np.float64) - 2 * quarter * turns
    sign = np.where(turns % 2 == 0, 1.0, -1.0)
    sn, cn, dn = _jacobi(reduced, m1)
    return sign * sn, sign * cn, dn


def _jacobi(u: Array, m1: float) -> tuple[Array, Array, Array]:
    a, kc = 1.0, math.sqrt(m1)
    means: list[tuple[float, float]] = []
    for _ in range(16):
        means.append((a, kc))
        c = (a + kc) / 2
        if abs(a - kc) <= 1e-9 * a:  # the next mean differs by the square of this
            break
        kc *= a
        a = c
        kc = math.sqrt(kc)
    x = c * u
    sn, cn = np.sin(x), np.cos(x)
    small = np.abs(sn) < 1e-150  # whose square is no number: sn u = u there
    safe = np.where(small, 1.0, sn)
    ratio = cn / safe
    c_ratio = c * ratio
    dn = np.ones_like(x)
    for mean, complement in reversed(means):
        ratio = c_ratio * ratio
        c_ratio = c_ratio * dn
        dn = (complement + ratio) / (mean + ratio)
        ratio = c_ratio / mean
    size = 1.0 / np.sqrt(c_ratio * c_ratio + 1.0)
    sn_out = np.where(safe >= 0, size, -size)
    cn_out = c_ratio * sn_out
    return (
        np.where(small, u, sn_out),
        np.where(small, 1.0, cn_out),
        np.where(small, 1.0, dn),
    )
