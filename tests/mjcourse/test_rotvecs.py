import itertools

import mpmath
import numpy as np
import pytest

from mjcourse import spatial
from support import high_precision as hp

UNIT = mpmath.mpf(1)


def rotvec_of(axis: tuple[float, ...], angle: float) -> np.ndarray:
    return np.array(axis) / max(map(abs, axis)) * angle


def test_exp_to_four_ulp_of_each_component() -> None:
    errors = {}
    angles = (*hp.SMALL_ANGLES, *hp.THRESHOLDS, *hp.PLAIN_ANGLES, hp.PI)
    for axis, angle in itertools.product(hp.AXES, angles):
        rotvec = rotvec_of(axis, angle)
        if hp.length(hp.exact(rotvec)) > mpmath.pi:
            rotvec = rotvec / 2
        expected = hp.exp(hp.exact(rotvec))
        errors[axis, angle] = hp.entry_ulps(spatial.rotvec_to_quat(rotvec)[1:], expected[1:])
    assert hp.errors_over(4, errors) == []


@pytest.mark.site
def test_log_to_four_ulp_of_each_component() -> None:
    errors = {}
    angles = (1e-12, *hp.THRESHOLDS, *hp.PLAIN_ANGLES, *hp.NEAR_PI, 5.0)
    for axis, angle, size in itertools.product(hp.AXES, angles, hp.SIZES):
        quat = spatial.axis_angle_to_quat(axis, angle) * size
        expected = hp.log(hp.exact(quat))
        errors[axis, angle, size] = hp.entry_ulps(spatial.quat_to_rotvec(quat), expected)
    assert hp.errors_over(4, errors) == []


def test_log_keeps_the_digits_of_the_smallest_angles() -> None:
    errors = {}
    for axis, angle in itertools.product(hp.AXES, hp.SMALL_ANGLES):
        rotvec = rotvec_of(axis, angle)
        quat = spatial.rotvec_to_quat(rotvec)
        actual = spatial.quat_to_rotvec(quat)
        errors[axis, angle, "of the quaternion"] = hp.entry_ulps(actual, hp.log(hp.exact(quat)))
        if angle > 1e-300:
            errors[axis, angle, "there and back"] = hp.entry_ulps(actual, hp.exact(rotvec))
    assert hp.errors_over(4, errors) == []


def test_log_at_exactly_half_a_turn() -> None:
    for w in (0.0, -0.0):
        assert spatial.quat_to_rotvec([w, 0, -2, 0]).tolist() == [0, np.pi, 0]
        assert spatial.quat_to_rotvec([w, 0, 2, 0]).tolist() == [0, np.pi, 0]
    actual = spatial.quat_to_rotvec([0, -1, 1, 0])
    assert actual[0] > 0 > actual[1]
    assert np.linalg.norm(actual) == pytest.approx(np.pi, rel=1e-15)


def test_log_takes_the_shorter_way_round() -> None:
    quat = np.array([np.cos(2.5), np.sin(2.5), 0, 0])
    assert spatial.quat_to_rotvec(quat)[0] == pytest.approx(5 - 2 * np.pi, rel=1e-15)
    assert spatial.quat_to_rotvec(-quat)[0] == spatial.quat_to_rotvec(quat)[0]
    assert not np.signbit(spatial.quat_to_rotvec([-1, 0, 0, 0])).any()


def test_difference_of_rotations_keeps_its_digits() -> None:
    errors = {}
    lengths = ((1.0, 1.0), (1.0, 0.7), (3e-310, 1e300), (1e-200, 5.0))
    for apart in (1e-16, 3e-16, 1e-15, 1e-12, 1e-8, 1e-4, 0.5, 3.0, *hp.NEAR_PI):
        rng = np.random.default_rng(round(apart * 1e3))
        for (size_a, size_b), k in itertools.product(lengths, range(5)):
            axis = rng.normal(size=3)
            a = spatial.quat_normalize(rng.normal(size=4))
            turn = spatial.rotvec_to_quat(axis / np.linalg.norm(axis) * apart)
            b = spatial.quat_mul(a, turn) * size_b
            a = a * size_a
            expected = hp.log(hp.mul(hp.conj(hp.exact(a)), hp.exact(b)))
            size = hp.length(expected)
            # Below 1e-16 rad the rounding of the quaternions themselves decides.
            if size < 1e-16:
                continue
            case = (apart, size_a, size_b, k)
            errors["difference", *case] = hp.ulps_of(size, spatial.quat_sub(b, a), expected)
            distance = spatial.angular_distance(a, b)
            errors["distance", *case] = hp.ulps_of(size, [distance], [size])
    assert hp.errors_over(4, errors) == []


def test_distance_of_equal_and_opposite_rotations() -> None:
    rng = np.random.default_rng(1)
    quats = rng.normal(size=(50, 4))
    assert (spatial.angular_distance(quats, quats) == 0).all()
    assert (spatial.angular_distance(quats, -4 * quats) == 0).all()
    assert (spatial.quat_sub(quats, -quats) == 0).all()
    assert spatial.angular_distance([1, 0, 0, 0], [0, 0, 0, 1e-310]) == np.pi
    assert spatial.angular_distance([1, 0, 0, 0], [1, 1e-300, 0, 0]) == 2e-300
    assert isinstance(spatial.angular_distance([1, 0, 0, 0], [1, 0, 0, 0]), float)


def test_slerp_to_four_ulp() -> None:
    errors = {}
    parts = (0.0, 1e-300, 1e-9, 0.25, 0.5, 1.0 - 1e-16, 1.0)
    for apart in (1e-300, 1e-12, 0.3, 2.0, 3.1, hp.PI - 1e-9):
        rng = np.random.default_rng(7)
        for k in range(5):
            axis = rng.normal(size=3)
            a = rng.normal(size=4)
            b = spatial.quat_integrate(a, axis / np.linalg.norm(axis), apart) * -3.0
            begin = hp.unit(hp.exact(a))
            rotvec = hp.log(hp.mul(hp.conj(hp.exact(a)), hp.exact(b)))
            for t in parts:
                expected = hp.mul(begin, hp.exp([mpmath.mpf(t) * entry for entry in rotvec]))
                errors[apart, k, t] = hp.ulps_of(UNIT, spatial.quat_slerp(a, b, t), expected)
    assert hp.errors_over(4, errors) == []


def test_slerp_at_its_ends_and_beyond() -> None:
    a, b = spatial.rotvec_to_quat([0, 0, 0.3]), spatial.rotvec_to_quat([0, 0, 0.5])
    assert (spatial.quat_slerp(a, b, 0) == spatial.quat_normalize(a)).all()
    actual = spatial.quat_to_rotvec(spatial.quat_slerp(a, b, [-1.0, 0.5, 1.0, 2.0]))
    np.testing.assert_allclose(actual[:, 2], [0.1, 0.4, 0.5, 0.7], rtol=1e-15)


def test_integrate_to_four_ulp() -> None:
    errors = {}
    for angle in (1e-300, 1e-12, 1e-3, 1.0, 3.0, hp.PI):
        rng = np.random.default_rng(3)
        for dt, k in itertools.product((1.0, -0.25, 1e-3, 1e150), range(4)):
            quat, axis = rng.normal(size=4), rng.normal(size=3)
            angvel = axis / np.linalg.norm(axis) * (angle / abs(dt))
            turn = [mpmath.mpf(dt) * entry for entry in hp.exact(angvel)]
            expected = hp.mul(hp.unit(hp.exact(quat)), hp.exp(turn))
            actual = spatial.quat_integrate(quat, angvel, dt)
            errors[angle, dt, k] = hp.ulps_of(UNIT, actual, expected)
    assert hp.errors_over(4, errors) == []
