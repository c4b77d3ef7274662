"""Elliptic functions against mpmath with 40 digits."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from coursebuild.numerics.elliptic import complete_k, jacobi

COMPLEMENTS = (1.0, 0.7, 0.3, 1e-2, 1e-6, 1e-13, 1e-20)


def test_complete_integral() -> None:
    with mpmath.workdps(40):
        for m1 in COMPLEMENTS:
            exact = mpmath.ellipk(1 - mpmath.mpf(m1))
            assert abs(mpmath.mpf(complete_k(m1)) - exact) < 4e-16 * exact, m1


def test_functions_over_several_periods() -> None:
    for m1 in COMPLEMENTS:
        quarter = complete_k(m1)
        several = np.linspace(-6.1 * quarter, 7.3 * quarter, 41)
        u = np.concatenate([several, [0.0, 1e-200, quarter]])
        with mpmath.workdps(40):
            m = 1 - mpmath.mpf(m1)
            exact = [
                [float(mpmath.ellipfun(name, mpmath.mpf(x), m=m)) for x in u.tolist()]
                for name in ("sn", "cn", "dn")
            ]
        # The period is known to its last digit, so that several of them cost a few.
        assert np.max(np.abs(np.array(jacobi(u, m1)) - exact)) < 1e-15 * (4 + 8 * quarter), m1


def test_identities_hold_for_arrays_of_any_shape() -> None:
    sn, cn, dn = jacobi(np.linspace(-5, 5, 24).reshape(2, 3, 4), 0.25)
    assert sn.shape == (2, 3, 4)
    assert np.allclose(sn**2 + cn**2, 1, rtol=0, atol=1e-15)
    assert np.allclose(0.75 * sn**2 + dn**2, 1, rtol=0, atol=1e-15)


@pytest.mark.parametrize("m1", [0.0, -1e-9, 1.5, math.nan])
def test_parameters_that_cannot_be(m1: float) -> None:
    with pytest.raises(ValueError, match=r"must be in \(0, 1\]"):
        complete_k(m1)
