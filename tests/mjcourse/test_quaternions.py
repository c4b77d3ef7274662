import mpmath
import numpy as np
import pytest

from mjcourse import spatial
from support import high_precision as hp

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


@pytest.mark.parametrize("quat", QUATS)
def test_normalize_to_two_ulp_at_any_length(quat: tuple[float, ...]) -> None:
    for size in hp.SIZES:
        given = np.array(quat) * size
        assert hp.own_ulps(spatial.quat_normalize(given), hp.unit(hp.exact(given))) <= 2


@pytest.mark.parametrize(
    "quat",
    [
        [5e-324, 0, 0, 0],
        [5e-324, -5e-324, 5e-324, 5e-324],
        [1e-323, 5e-324, 0, -1.5e-323],
        [1.7976931348623157e308] * 4,
        [1.7976931348623157e308, 5e-324, 0, 1],
        [1e-308, 1e-320, -1e-310, 0],
    ],
)
def test_normalize_at_the_ends_of_the_range(quat: list[float]) -> None:
    assert hp.own_ulps(spatial.quat_normalize(quat), hp.unit(hp.exact(quat))) <= 2


@pytest.mark.parametrize("a", QUATS)
def test_mul_to_two_ulp_of_the_lengths(a: tuple[float, ...]) -> None:
    for b in QUATS:
        p, q = hp.exact(a), hp.exact(b)
        size = hp.length(p) * hp.length(q)
        assert hp.ulps_of(size, spatial.quat_mul(a, b), hp.mul(p, q)) <= 2


def test_mul_is_the_plain_product() -> None:
    assert spatial.quat_mul([1, 2, 3, 4], [5, 6, 7, 8]).tolist() == [-60, 12, 30, 24]
    assert spatial.quat_mul([0, 1, 0, 0], [0, 0, 1, 0]).tolist() == [0, 0, 0, 1]
    assert spatial.quat_mul([3, 0, 0, 0], [5e-324, 0, 1e300, 0]).tolist() == [1.5e-323, 0, 3e300, 0]


def test_conj_is_exact_and_has_no_negative_zero() -> None:
    assert spatial.quat_conj([-1, 2, -5e-324, 1e308]).tolist() == [-1, -2, 5e-324, -1e308]
    assert not np.signbit(spatial.quat_conj([1, 0, 0, 0])).any()


@pytest.mark.parametrize("size", hp.SIZES)
@pytest.mark.parametrize("quat", QUATS)
def test_rotate_to_six_ulp_at_any_length(quat: tuple[float, ...], size: float) -> None:
    given = np.array(quat) * size
    for vector in (
        (1.0, 2.0, 3.0),
        (-1e-200, 1e-201, 0.0),
        (1e306, -1e306, 3e305),
        (0.0, 0.0, 7.0),
    ):
        want = hp.turned(hp.exact(given), hp.exact(vector))
        got = spatial.quat_rotate(given, vector)
        assert hp.ulps_of(hp.length(hp.exact(vector)), got, want) <= 6


@pytest.mark.parametrize("axis", hp.AXES)
@pytest.mark.parametrize(
    "angle",
    (
        *hp.SMALL_ANGLES,
        *hp.THRESHOLDS,
        *hp.PLAIN_ANGLES,
        *hp.NEAR_PI,
        -1e-300,
        -2.0,
        3 * hp.PI,
        1e6,
        0.0,
    ),
)
def test_axis_angle_to_four_ulp(axis: tuple[float, ...], angle: float) -> None:
    direction, turn = hp.unit(hp.exact(axis)), mpmath.mpf(angle)
    want = hp.exp([turn * entry for entry in direction])
    got = spatial.axis_angle_to_quat(axis, angle)
    assert hp.own_ulps(got[1:], want[1:]) <= 4
    assert hp.ulps_of(mpmath.mpf(1), got[:1], want[:1]) <= 1


def test_axis_may_have_any_length() -> None:
    for size in (5e-324, 1e-310, 1e-200, 1e200, 1.7e308):
        assert spatial.axis_angle_to_quat([0, 0, size], 1.0).tolist() == [
            np.cos(0.5),
            0,
            0,
            np.sin(0.5),
        ]


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_bad_quaternion_is_nan_and_the_others_are_not(bad: float) -> None:
    quats = np.array([[0.6, 0.8, 0, 0], [bad, 1, 0, 0], [0, 0, 1e300, 0]])
    for got in (
        spatial.quat_normalize(quats),
        spatial.quat_rotate(quats, [1, 2, 3]),
        spatial.quat_to_mat(quats),
        spatial.quat_to_rotvec(quats),
        spatial.quat_sub(quats, [1, 0, 0, 0]),
        spatial.quat_slerp(quats, [1, 0, 0, 0], 0.5),
        spatial.quat_integrate(quats, [1, 2, 3], 0.1),
        spatial.angular_distance(quats, [1, 0, 0, 0]),
    ):
        assert np.isnan(got[1]).all()
        assert np.isfinite(got[[0, 2]]).all()


def test_nan_in_a_vector_stays_in_its_entry() -> None:
    got = spatial.quat_rotate([1, 0, 0, 0], [[1, np.nan, 0], [1, 2, 3]])
    assert np.isnan(got[0]).all()
    assert got[1].tolist() == [1, 2, 3]
    turned = spatial.axis_angle_to_quat([[0, 0, 1], [0, 0, 1], [np.nan, 0, 1]], [np.nan, 0.0, 1.0])
    assert np.isnan(turned[0]).any()
    assert turned[1].tolist() == [1, 0, 0, 0]
    assert np.isnan(turned[2][1:]).all()


@pytest.mark.parametrize(
    "call",
    [
        lambda q: spatial.quat_normalize(q),
        lambda q: spatial.quat_rotate(q, [1, 2, 3]),
        lambda q: spatial.quat_to_mat(q),
        lambda q: spatial.quat_to_rotvec(q),
        lambda q: spatial.quat_to_euler(q),
        lambda q: spatial.quat_integrate(q, [1, 2, 3], 0.1),
        lambda q: spatial.inertia_from_principal([1, 2, 3], q),
    ],
)
def test_a_zero_quaternion_is_an_error(call: object) -> None:
    assert callable(call)
    with pytest.raises(ValueError, match=r"^quat is zero and has no direction$"):
        call([0.0, -0.0, 0.0, 0.0])
    with pytest.raises(ValueError, match=r"^quat at index \(1, 0\) is zero and has no direction$"):
        call([[[1, 0, 0, 0]], [[0, 0, 0, 0]]])


def test_a_zero_quaternion_is_named_by_its_argument() -> None:
    one, zero = [1, 0, 0, 0], [0, 0, 0, 0]
    for call in (spatial.quat_sub, spatial.angular_distance):
        with pytest.raises(ValueError, match=r"^a is zero and has no direction$"):
            call(zero, one)
        with pytest.raises(ValueError, match=r"^b is zero and has no direction$"):
            call(one, zero)
    with pytest.raises(ValueError, match=r"^b is zero and has no direction$"):
        spatial.quat_slerp(one, zero, 0.5)
    with pytest.raises(ValueError, match=r"^axis is zero and has no direction$"):
        spatial.axis_angle_to_quat([0, 0, 0], 1.0)
