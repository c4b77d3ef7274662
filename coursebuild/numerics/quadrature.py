"""Integrals of a smooth function from 0 to each of several times, by Gauss's rule.

Entry point: `cumulative(function, times, width)`.

Source: P. J. Davis, P. Rabinowitz, Methods of Numerical Integration, 2.7.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from coursebuild.numerics.problem import Array

_NODES = 20


def cumulative(function: Callable[[Array], Array], times: Array, width: float) -> Array:
    """∫₀ᵗ f for each of the rising times (n,): (n,).

    `function` takes times (k,) and gives (k,); on intervals of `width` it must be so smooth that 20
    nodes suffice.
    """
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    edges = np.concatenate([[0.0], times])
    gaps = np.diff(edges)
    parts = max(1, math.ceil(float(np.max(gaps)) / width))
    widths = np.repeat(gaps / parts, parts)
    begins = (edges[:-1, None] + gaps[:, None] * np.arange(parts) / parts).ravel()
    at = begins[:, None] + widths[:, None] * (nodes + 1) / 2
    pieces = function(at.ravel()).reshape(at.shape) @ weights * widths / 2
    total: Array = np.cumsum(pieces.reshape(-1, parts).sum(axis=1))
    return total
