import itertools

import mpmath
import numpy as np
import pytest

from mjcourse import spatial
from support import high_precision as hp

RNG = np.random.default_rng(23)
POSES = [
    (spatial.quat_to_mat(RNG.normal(size=4)), RNG.normal(size=3) * size)
    for size in (0.0, 1e-9, 1.0, 30.0, 1e8)
]
VELOCITY, MOTION, FORCE = RNG.normal(size=(3, 6))


def cross_matrix(pos: np.ndarray) -> hp.Vector:
    x, y, z = hp.exact(pos)
    return [mpmath.mpf(0), -z, y, z, mpmath.mpf(0), -x, -y, x, mpmath.mpf(0)]


def test_blocks_of_the_transforms() -> None:
    errors = {}
    for rot, pos in POSES:
        coupling = hp.matmul(cross_matrix(pos), hp.exact(rot))
        motion, force = spatial.motion_transform(rot, pos), spatial.force_transform(rot, pos)
        size = 1 + hp.length(hp.exact(pos))
        for kind, actual, zero, full in (
            ("motion", motion, motion[:3, 3:], motion[3:, :3]),
            ("force", force, force[3:, :3], force[:3, 3:]),
        ):
            assert (actual[:3, :3] == rot).all()
            assert (actual[3:, 3:] == rot).all()
            assert (zero == 0).all()
            errors[kind, tuple(pos)] = hp.ulps_of(size, full, coupling)
    assert hp.errors_over(2, errors) == []


def test_a_force_off_the_origin_has_a_torque() -> None:
    force = spatial.force_transform(np.eye(3), [0, 2, 0]) @ [0, 0, 0, 5, 0, 0]
    assert force.tolist() == [0, 0, -10, 5, 0, 0]


def test_cross_products_against_their_matrices() -> None:
    v, m, f = VELOCITY, MOTION, FORCE
    turn, move = spatial.skew(v[:3]), spatial.skew(v[3:])
    crm = np.block([[turn, np.zeros((3, 3))], [move, turn]])
    np.testing.assert_allclose(spatial.cross_motion(v, m), crm @ m, rtol=1e-14)
    np.testing.assert_allclose(spatial.cross_force(v, f), -crm.T @ f, rtol=1e-14)
    assert spatial.cross_motion(v, v).tolist() == pytest.approx([0] * 6, abs=1e-15)


SEQUENCES = [
    cased
    for letters in itertools.product("xyz", repeat=3)
    if letters[0] != letters[1] != letters[2]
    for cased in ("".join(letters), "".join(letters).upper())
]
TURNS = (
    (0.1, 0.2, 0.3),
    (-3.0, 1.2, 2.9),
    (1.0, 1e-9, -2.0),
    (0.7, 1e-300, 1e-300),
    (0.4, hp.PI / 2 - 1e-8, -1.1),
    (3.0, hp.PI / 2, 0.5),
    (-0.2, -hp.PI / 2, 0.5),
    (0.3, hp.PI - 1e-8, 1.0),
    (0.3, hp.PI, -1.0),
    (0.0, 0.0, 0.0),
    (hp.PI, 0.0, hp.PI),
    (2.0, 1e-15, 1.0),
    (2.0, hp.PI / 2 - 1e-15, 1.0),
)


def exact_euler_quat(angles: np.ndarray, seq: str) -> hp.Vector:
    turns = []
    for letter, angle in zip(seq.lower(), hp.exact(angles), strict=True):
        turns.append(hp.exp([angle if letter == axis else mpmath.mpf(0) for axis in "xyz"]))
    first, second, third = turns[::-1] if seq.isupper() else turns
    return hp.mul(first, hp.mul(second, third))


def test_quaternion_to_four_ulp() -> None:
    errors = {}
    for seq, angles in itertools.product(SEQUENCES, TURNS):
        actual = spatial.euler_to_quat(angles, seq)
        errors[seq, angles] = hp.ulps_of(
            mpmath.mpf(1), actual, exact_euler_quat(np.array(angles), seq)
        )
    assert hp.errors_over(4, errors) == []


@pytest.mark.site
def test_angles_give_the_rotation_back_to_six_ulp() -> None:
    errors = {}
    turns = [*TURNS, *np.random.default_rng(11).uniform(-3.2, 3.2, size=(10, 3)).tolist()]
    for seq, angles in itertools.product(SEQUENCES, turns):
        quat = spatial.euler_to_quat(angles, seq)
        actual = spatial.quat_to_euler(quat * 1e-200, seq)
        expected = hp.same_up_to_sign(quat, exact_euler_quat(actual, seq))
        errors[seq, tuple(angles)] = hp.ulps_of(mpmath.mpf(1), quat, expected)
        assert abs(actual[[0, 2]]).max() <= np.pi, (seq, angles)
        low, high = (0, np.pi) if seq[0] == seq[2] else (-np.pi / 2, np.pi / 2)
        assert low <= actual[1] <= high, (seq, angles)
    assert hp.errors_over(6, errors) == []


def test_gimbal_lock_has_one_answer() -> None:
    quat = spatial.euler_to_quat([0.5, np.pi / 2, 0.25], "xyz")
    actual = spatial.quat_to_euler(quat, "xyz")
    assert actual[0] == 0
    np.testing.assert_allclose(actual[1:], [np.pi / 2, 0.75], rtol=0, atol=3e-8)
    actual = spatial.quat_to_euler(spatial.euler_to_quat([0.5, np.pi / 2, 0.25], "XYZ"), "XYZ")
    assert actual[2] == 0
    actual = spatial.quat_to_euler(spatial.euler_to_quat([0.5, 0.0, 0.25], "zxz"), "zxz")
    assert actual.tolist() == pytest.approx([0, 0, 0.75], abs=1e-15)
    assert spatial.quat_to_euler([1, 0, 0, 0], "zyx").tolist() == [0, 0, 0]
    assert not np.signbit(spatial.quat_to_euler([1, 0, 0, 0], "zyx")).any()


UNIT = mpmath.mpf(1)
IDENTITY = [mpmath.mpf(i == j) for i in range(3) for j in range(3)]


def orthonormality(mat: np.ndarray) -> float:
    rows = hp.exact(mat)
    product = hp.matmul(hp.transpose(rows), rows)
    return max(float(abs(p - i) / hp.ULP) for p, i in zip(product, IDENTITY, strict=True))


@pytest.mark.site
def test_matrix_of_a_quaternion() -> None:
    quats = [
        spatial.axis_angle_to_quat(axis, angle) * size
        for axis in hp.AXES
        for angle in (*hp.SMALL_ANGLES, *hp.THRESHOLDS, *hp.PLAIN_ANGLES, *hp.NEAR_PI, 5.0)
        for size in (1.0, -1e-310)
    ]
    quats += list(np.random.default_rng(5).normal(size=(50, 4)))
    errors, bends = {}, {}
    for quat in quats:
        actual, case = spatial.quat_to_mat(quat), tuple(quat.tolist())
        errors[case] = hp.ulps_of(UNIT, actual, hp.matrix(hp.exact(quat)))
        bends[case] = orthonormality(actual)
    assert hp.errors_over(4, errors) == []
    assert hp.errors_over(5, bends) == []


@pytest.mark.site
def test_quaternion_of_a_matrix_at_any_angle() -> None:
    errors = {}
    angles = (*hp.THRESHOLDS, *hp.PLAIN_ANGLES, *hp.NEAR_PI, 4.0, 1e-8, 1e-12)
    for axis, angle in itertools.product(hp.AXES, angles):
        mat = spatial.exp_so3(np.array(axis) / np.linalg.norm(axis) * angle)
        actual = spatial.mat_to_quat(mat)
        expected = hp.same_up_to_sign(actual, exact_quat(mat))
        errors[axis, angle] = hp.ulps_of(UNIT, actual, expected)
        assert actual[0] >= 0, (axis, angle)
    assert hp.errors_over(3, errors) == []


def exact_quat(mat: np.ndarray) -> hp.Vector:
    """The unit quaternion nearest to a matrix that is a rotation but for rounding.

    Bar-Itzhack, "New method for extracting the quaternion from a rotation matrix", J. Guidance,
    Control and Dynamics 23 (2000): the eigenvector of the largest eigenvalue.
    """
    a, b, c, d, e, f, g, h, i = hp.exact(mat)
    table = mpmath.matrix(
        [
            [a + e + i, h - f, c - g, d - b],
            [h - f, a - e - i, b + d, c + g],
            [c - g, b + d, e - a - i, f + h],
            [d - b, c + g, f + h, i - a - e],
        ]
    )
    _, vectors = mpmath.eigsy(table)
    return [vectors[k, 3] for k in range(4)]


def test_half_turns_have_one_quaternion_and_one_logarithm() -> None:
    assert spatial.mat_to_quat(np.diag([-1.0, -1.0, 1.0])).tolist() == [0, 0, 0, 1]
    assert spatial.log_so3(np.diag([-1.0, 1.0, -1.0])).tolist() == [0, np.pi, 0]
    half = spatial.quat_to_mat([0, -1, 1, 0])
    assert spatial.mat_to_quat(half).tolist() == [0, *(np.array([1, -1, 0]) / np.sqrt(2))]


def test_skew_and_back() -> None:
    vector = np.array([5e-324, -1.7e308, 3.0])
    mat = spatial.skew(vector)
    assert (mat == -mat.T).all()
    assert spatial.unskew(mat).tolist() == vector.tolist()
    assert (spatial.skew([1, 2, 3]) @ [4, 5, 6]).tolist() == np.cross([1, 2, 3], [4, 5, 6]).tolist()
    assert not np.signbit(spatial.skew([0, 0, 0])).any()


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
