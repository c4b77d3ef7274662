import itertools

import mpmath
import numpy as np
import pytest

from mjcourse import spatial
from support import high_precision as hp

LARGEST = float(np.finfo(float).max)
QUATS = (
    (1.0, 0.0, 0.0, 0.0),
    (0.0, 0.0, 1.0, 0.0),
    (0.5, -0.5, 0.5, -0.5),
    (0.3, -0.7, 0.2, 0.1),
    (-0.9, 0.1, 0.2, -0.4),
    (1.0, 1e-9, -2e-9, 3e-10),
    (1e-9, 1.0, 1e-17, -1e-3),
    (1.0, 1e-160, 0.0, 1e-300),
    (1e-200, -1.0, 0.3, 0.9),
)


def test_normalize_to_two_ulp_at_any_length() -> None:
    ends = (
        (5e-324, 0, 0, 0),
        (5e-324, -5e-324, 5e-324, 5e-324),
        (1e-323, 5e-324, 0, -1.5e-323),
        (LARGEST, LARGEST, LARGEST, LARGEST),
        (LARGEST, 5e-324, 0, 1),
        (1e-308, 1e-320, -1e-310, 0),
    )
    errors = {}
    for quat, size in (*itertools.product(QUATS, hp.SIZES), *((end, 1.0) for end in ends)):
        scaled = np.array(quat) * size
        expected = hp.unit(hp.exact(scaled))
        errors[quat, size] = hp.entry_ulps(spatial.quat_normalize(scaled), expected)
    assert hp.errors_over(2, errors) == []


def test_mul_to_two_ulp_of_the_lengths() -> None:
    errors = {}
    for a, b in itertools.product(QUATS, QUATS):
        p, q = hp.exact(a), hp.exact(b)
        size = hp.length(p) * hp.length(q)
        errors[a, b] = hp.ulps_of(size, spatial.quat_mul(a, b), hp.mul(p, q))
    assert hp.errors_over(2, errors) == []


def test_mul_is_the_plain_product() -> None:
    assert spatial.quat_mul([1, 2, 3, 4], [5, 6, 7, 8]).tolist() == [-60, 12, 30, 24]
    assert spatial.quat_mul([0, 1, 0, 0], [0, 0, 1, 0]).tolist() == [0, 0, 0, 1]
    assert spatial.quat_mul([3, 0, 0, 0], [5e-324, 0, 1e300, 0]).tolist() == [1.5e-323, 0, 3e300, 0]


def test_conj_turns_the_vector_part_and_makes_no_negative_zero() -> None:
    assert spatial.quat_conj([1, 2, -3, 4]).tolist() == [1, -2, 3, -4]
    assert not np.signbit(spatial.quat_conj([1, 0, 0, 0])).any()


def test_rotate_to_six_ulp_at_any_length() -> None:
    vectors = ((1.0, 2.0, 3.0), (-1e-200, 1e-201, 0.0), (1e306, -1e306, 3e305), (0.0, 0.0, 7.0))
    errors = {}
    for quat, size, vector in itertools.product(QUATS, hp.SIZES, vectors):
        scaled = np.array(quat) * size
        expected = hp.rotate(hp.exact(scaled), hp.exact(vector))
        actual = spatial.quat_rotate(scaled, vector)
        errors[quat, size, vector] = hp.ulps_of(hp.length(hp.exact(vector)), actual, expected)
    assert hp.errors_over(6, errors) == []


def test_axis_angle_to_four_ulp() -> None:
    angles = (
        *hp.SMALL_ANGLES,
        *hp.THRESHOLDS,
        *hp.PLAIN_ANGLES,
        *hp.NEAR_PI,
        *(-1e-300, -2.0, 3 * hp.PI, 1e6, 0.0),
    )
    sines, cosines = {}, {}
    for axis, angle in itertools.product(hp.AXES, angles):
        direction, turn = hp.unit(hp.exact(axis)), mpmath.mpf(angle)
        expected = hp.exp([turn * entry for entry in direction])
        actual = spatial.axis_angle_to_quat(axis, angle)
        sines[axis, angle] = hp.entry_ulps(actual[1:], expected[1:])
        cosines[axis, angle] = hp.ulps_of(mpmath.mpf(1), actual[:1], expected[:1])
    assert hp.errors_over(4, sines) == []
    assert hp.errors_over(1, cosines) == []


def test_a_bad_quaternion_is_nan_and_the_others_are_not() -> None:
    for bad in (np.nan, np.inf, -np.inf):
        quats = np.array([[0.6, 0.8, 0, 0], [bad, 1, 0, 0], [0, 0, 1e300, 0]])
        for actual in (
            spatial.quat_normalize(quats),
            spatial.quat_rotate(quats, [1, 2, 3]),
            spatial.quat_to_mat(quats),
            spatial.quat_to_rotvec(quats),
            spatial.quat_sub(quats, [1, 0, 0, 0]),
            spatial.quat_slerp(quats, [1, 0, 0, 0], 0.5),
            spatial.quat_integrate(quats, [1, 2, 3], 0.1),
            spatial.angular_distance(quats, [1, 0, 0, 0]),
        ):
            assert np.isnan(actual[1]).all()
            assert np.isfinite(actual[[0, 2]]).all()


def test_a_zero_quaternion_is_an_error() -> None:
    for call in (
        spatial.quat_normalize,
        lambda q: spatial.quat_rotate(q, [1, 2, 3]),
        spatial.quat_to_mat,
        spatial.quat_to_rotvec,
        spatial.quat_to_euler,
        lambda q: spatial.quat_integrate(q, [1, 2, 3], 0.1),
        lambda q: spatial.inertia_from_principal([1, 2, 3], q),
    ):
        with pytest.raises(ValueError, match=r"^quat is zero and has no direction$"):
            call([0.0, -0.0, 0.0, 0.0])
        at = r"^quat at index \(1, 0\) is zero and has no direction$"
        with pytest.raises(ValueError, match=at):
            call([[[1, 0, 0, 0]], [[0, 0, 0, 0]]])


def test_a_zero_quaternion_is_named_by_its_argument() -> None:
    argument, zero = [1, 0, 0, 0], [0, 0, 0, 0]
    for call in (spatial.quat_sub, spatial.angular_distance):
        with pytest.raises(ValueError, match=r"^a is zero and has no direction$"):
            call(zero, argument)
        with pytest.raises(ValueError, match=r"^b is zero and has no direction$"):
            call(argument, zero)
    with pytest.raises(ValueError, match=r"^b is zero and has no direction$"):
        spatial.quat_slerp(argument, zero, 0.5)
    with pytest.raises(ValueError, match=r"^axis is zero and has no direction$"):
        spatial.axis_angle_to_quat([0, 0, 0], 1.0)
