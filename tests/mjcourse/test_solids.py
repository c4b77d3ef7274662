import numpy as np
import pytest

from mjcourse import spatial


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


def test_a_solid_without_an_extent_is_a_plate_a_rod_or_a_point() -> None:
    rod = np.diag([1.0, 1.0, 0.0]) * 0.3**2 / 3
    for got in (
        spatial.box_inertia(1.0, [0, 0, 0.3]),
        spatial.cylinder_inertia(1.0, 0, 0.3),
        spatial.capsule_inertia(1.0, 0, 0.3),
    ):
        np.testing.assert_allclose(got, rod, rtol=1e-15)
    ball = spatial.sphere_inertia(1.0, 0.3)
    np.testing.assert_allclose(spatial.capsule_inertia(1.0, 0.3, 0), ball, rtol=1e-15)
    assert not spatial.capsule_inertia(1.0, 0, 0).any()
