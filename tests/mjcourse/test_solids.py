import itertools

import mpmath
import numpy as np
import pytest

from mjcourse import spatial
from support import high_precision as hp

THIRD = mpmath.mpf(1) / 3


def diagonal(x: mpmath.mpf, y: mpmath.mpf, z: mpmath.mpf) -> hp.Vector:
    zero = mpmath.mpf(0)
    return [x, zero, zero, zero, y, zero, zero, zero, z]


SIZES = (0.1, 0.05, 0.02, 3.7, 1e-9, 1e6, 0.0)


@pytest.mark.parametrize("half_sizes", list(itertools.product(SIZES[:4], SIZES[2:], SIZES[:3])))
def test_box_and_ellipsoid_to_four_ulp(half_sizes: tuple[float, ...]) -> None:
    for mass in (1.0, 0.3, 1e-7):
        m, a, b, c = hp.exact([mass, *half_sizes])
        moments = (b * b + c * c, a * a + c * c, a * a + b * b)
        got = spatial.box_inertia(mass, half_sizes)
        assert hp.own_ulps(got, diagonal(*(m / 3 * moment for moment in moments))) <= 4
        got = spatial.ellipsoid_inertia(mass, half_sizes)
        assert hp.own_ulps(got, diagonal(*(m / 5 * moment for moment in moments))) <= 4


@pytest.mark.parametrize(("radius", "half"), list(itertools.product(SIZES, SIZES)))
def test_round_solids(radius: float, half: float) -> None:
    for mass in (1.0, 0.7, 1e-7):
        m, r, h = hp.exact([mass, radius, half])
        ball = m * r * r * 2 / 5
        assert hp.own_ulps(spatial.sphere_inertia(mass, radius), diagonal(ball, ball, ball)) <= 3
        across, along = m * (r * r / 4 + h * h / 3), m * r * r / 2
        got = spatial.cylinder_inertia(mass, radius, half)
        assert hp.own_ulps(got, diagonal(across, across, along)) <= 5
        got = spatial.capsule_inertia(mass, radius, half)
        assert hp.own_ulps(got, exact_capsule(m, r, h)) <= 8


def exact_capsule(m: mpmath.mpf, r: mpmath.mpf, h: mpmath.mpf) -> hp.Vector:
    """From the polynomial moments of the two half spheres about the capsule's centre, by volume."""
    if r == 0 and h == 0:
        return diagonal(r, r, r)
    if r == 0:
        return diagonal(m * h * h / 3, m * h * h / 3, mpmath.mpf(0))
    middle, ends = 2 * mpmath.pi * r**2 * h, 4 * THIRD * mpmath.pi * r**3
    # ∫ (h + s)² π (r² − s²) ds from 0 to r, twice.
    height = 2 * mpmath.pi * (h**2 * r**3 * 2 / 3 + h * r**4 / 2 + r**5 * 2 / 15)
    # ∫ x² over a sphere is r²/5 of its volume, over a cylinder r²/4.
    spread = ends * r**2 / 5
    across = middle * (r**2 / 4 + h**2 / 3) + height + spread
    along = middle * r**2 / 2 + 2 * spread
    return diagonal(*(m * moment / (middle + ends) for moment in (across, across, along)))


def test_masses_and_sizes_broadcast() -> None:
    got = spatial.box_inertia([[1.0], [2.0]], [[0.1, 0.2, 0.3], [1, 1, 1], [0, 0, 1]])
    assert got.shape == (2, 3, 3, 3)
    assert (got[1, 2] == spatial.box_inertia(2.0, [0, 0, 1])).all()
    assert spatial.capsule_inertia(1.0, [0.1, 0.2], [[0.3], [0.4], [0.5]]).shape == (3, 2, 3, 3)
    assert spatial.sphere_inertia([1, 2], 0.1).shape == (2, 3, 3)


def test_nan_stays_in_its_entry() -> None:
    got = spatial.capsule_inertia(1.0, [np.nan, 0.1, 0.1], [0.1, np.nan, 0.1])
    assert np.isnan(got[0].diagonal()).all()
    assert np.isnan(got[1].diagonal()).all()
    assert (got[2].diagonal() > 0).all()


def test_negative_sizes_are_errors() -> None:
    with pytest.raises(ValueError, match=r"^half_sizes has a negative entry$"):
        spatial.box_inertia(1.0, [0.1, -0.1, 0.1])
    with pytest.raises(ValueError, match=r"^semi_axes at index \(1,\) has a negative entry$"):
        spatial.ellipsoid_inertia(1.0, [[1, 1, 1], [1, 1, -1]])
    with pytest.raises(ValueError, match=r"^radius is negative$"):
        spatial.sphere_inertia(1.0, -0.1)
    with pytest.raises(ValueError, match=r"^half_length at index \(0,\) is negative$"):
        spatial.cylinder_inertia(1.0, 0.1, [-1, 1])
    with pytest.raises(ValueError, match=r"^radius is negative$"):
        spatial.capsule_inertia(1.0, -0.1, 0.1)
