import itertools

import mpmath
import pytest

from mjcourse import spatial
from support import high_precision as hp

THIRD = mpmath.mpf(1) / 3


def diagonal(x: mpmath.mpf, y: mpmath.mpf, z: mpmath.mpf) -> hp.Vector:
    zero = mpmath.mpf(0)
    return [x, zero, zero, zero, y, zero, zero, zero, z]


MASSES = (1.0, 0.3, 1e-7)
SIZES = (0.1, 0.05, 0.02, 3.7, 1e-9, 1e6, 0.0)


def test_box_and_ellipsoid_to_four_ulp() -> None:
    errors = {}
    for mass, *half_sizes in itertools.product(MASSES, SIZES[:4], SIZES[2:], SIZES[:3]):
        m, a, b, c = hp.exact([mass, *half_sizes])
        moments = (b * b + c * c, a * a + c * c, a * a + b * b)
        for call, share in ((spatial.box_inertia, 3), (spatial.ellipsoid_inertia, 5)):
            expected = diagonal(*(m / share * moment for moment in moments))
            case = (call.__name__, mass, *half_sizes)
            errors[case] = hp.entry_ulps(call(mass, half_sizes), expected)
    assert hp.errors_over(4, errors) == []


def test_sphere_to_three_ulp_cylinder_to_five_and_capsule_to_eight() -> None:
    spheres, cylinders, capsules = {}, {}, {}
    for mass, radius, half in itertools.product((1.0, 0.7, 1e-7), SIZES, SIZES):
        m, r, h = hp.exact([mass, radius, half])
        ball = m * r * r * 2 / 5
        actual = spatial.sphere_inertia(mass, radius)
        spheres[mass, radius] = hp.entry_ulps(actual, diagonal(ball, ball, ball))
        transverse, axial = m * (r * r / 4 + h * h / 3), m * r * r / 2
        actual = spatial.cylinder_inertia(mass, radius, half)
        cylinders[mass, radius, half] = hp.entry_ulps(
            actual, diagonal(transverse, transverse, axial)
        )
        actual = spatial.capsule_inertia(mass, radius, half)
        capsules[mass, radius, half] = hp.entry_ulps(actual, exact_capsule(m, r, h))
    assert hp.errors_over(3, spheres) == []
    assert hp.errors_over(5, cylinders) == []
    assert hp.errors_over(8, capsules) == []


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
    transverse = middle * (r**2 / 4 + h**2 / 3) + height + spread
    axial = middle * r**2 / 2 + 2 * spread
    return diagonal(*(m * moment / (middle + ends) for moment in (transverse, transverse, axial)))


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
