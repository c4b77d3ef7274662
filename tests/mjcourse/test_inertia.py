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


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(41)


def exact_point(m: mpmath.mpf, d: hp.Vector) -> hp.Vector:
    square = sum(entry * entry for entry in d)
    return [m * (square * (i == j) - d[i] * d[j]) for i in range(3) for j in range(3)]


def exact_composition(
    masses: np.ndarray, centres: np.ndarray, tensors: np.ndarray
) -> tuple[mpmath.mpf, hp.Vector, hp.Vector]:
    ms = hp.exact(masses)
    total = sum(ms)
    points = [hp.exact(centre) for centre in centres]
    centre = [sum(m * p[k] for m, p in zip(ms, points, strict=True)) / total for k in range(3)]
    inertia = [mpmath.mpf(0)] * 9
    for m, point, tensor in zip(ms, points, tensors, strict=True):
        shift = exact_point(m, [p - c for p, c in zip(point, centre, strict=True)])
        inertia = [a + t + s for a, t, s in zip(inertia, hp.exact(tensor), shift, strict=True)]
    return total, centre, inertia


def test_parallel_axis_to_three_ulp(rng: np.random.Generator) -> None:
    for size, _ in itertools.product((1e-160, 1e-9, 1.0, 3e7), range(20)):
        mass, offset = rng.uniform(0.1, 9), rng.normal(size=3) * size
        tensor = spatial.box_inertia(mass, rng.uniform(0.01, 1, size=3))
        point = exact_point(mpmath.mpf(mass), hp.exact(offset))
        actual = spatial.parallel_axis(tensor, mass, offset)
        larger = [max(abs(t), abs(p)) for t, p in zip(hp.exact(tensor), point, strict=True)]
        for entry, base, extra, scale in zip(
            actual.ravel(), hp.exact(tensor), point, larger, strict=True
        ):
            error = abs(mpmath.mpf(float(entry)) - base - extra)
            assert error <= 3 * hp.ULP * scale + hp.DENORMAL, (mass, offset, tensor)


def test_composition_near_and_far(rng: np.random.Generator) -> None:
    sums, centres_of_mass, tensors_of_all = {}, {}, {}
    for away, count in itertools.product((0.0, 1.0, 1e3, 1e9, 1e12), (1, 2, 7)):
        masses = rng.uniform(0.01, 3, size=count)
        centres = rng.normal(size=(count, 3)) * 0.1 + away
        tensors = spatial.inertia_from_principal(
            rng.uniform(0.8, 1.2, size=(count, 3)) * 1e-3, rng.normal(size=(count, 4))
        )
        mass, com, inertia = spatial.compose_inertia(masses, centres, tensors)
        want_mass, want_com, want_inertia = exact_composition(masses, centres, tensors)
        sums[away, count] = hp.entry_ulps(mass, [want_mass])
        centres_of_mass[away, count] = hp.ulps_of(max(map(abs, want_com)), com, want_com)
        error = hp.ulps_of(max(map(abs, want_inertia)), inertia, want_inertia)
        tensors_of_all[away, count] = error - 2 * count
        assert (inertia == inertia.T).all(), (away, count)
    assert hp.errors_over(4, sums) == []
    assert hp.errors_over(4, centres_of_mass) == []
    assert hp.errors_over(4, tensors_of_all) == [], "two for each part are taken off"


def test_a_hole_is_a_part_of_negative_mass() -> None:
    block = spatial.box_inertia(8.0, [0.2, 0.2, 0.2])
    hole = spatial.box_inertia(1.0, [0.1, 0.1, 0.1])
    mass, com, inertia = spatial.compose_inertia(
        [8.0, -1.0], [[0, 0, 0], [0.1, 0.1, 0.1]], [block, -hole]
    )
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)][:-1]) * 0.1
    parts = spatial.compose_inertia(np.ones(7), corners, [hole] * 7)
    assert mass == parts[0] == 7
    np.testing.assert_allclose(com, parts[1], rtol=1e-14)
    np.testing.assert_allclose(inertia, parts[2], rtol=1e-13)


def test_rotation_of_a_tensor_to_eight_ulp(rng: np.random.Generator) -> None:
    for _ in range(40):
        quat, moments = rng.normal(size=4), rng.uniform(0, 1, size=3) * 10.0 ** rng.uniform(-12, 9)
        rot = spatial.quat_to_mat(quat)
        rows = hp.exact(rot)
        middle = hp.exact(np.diag(moments))
        expected = hp.matmul(hp.matmul(rows, middle), hp.transpose(rows))
        largest = max(hp.exact(moments))
        actual = spatial.rotate_inertia(np.diag(moments), rot)
        assert hp.ulps_of(largest, actual, expected) <= 8
        assert (actual == actual.T).all()
        rows = hp.matrix(hp.exact(quat))
        expected = hp.matmul(hp.matmul(rows, middle), hp.transpose(rows))
        actual = spatial.inertia_from_principal(moments, quat * 1e-200)
        assert hp.ulps_of(largest, actual, expected) <= 8
        assert (actual == actual.T).all()


def test_spatial_inertia_times_velocity_is_momentum() -> None:
    mass, com, tensor = 3.0, np.array([0.1, 0.2, -0.4]), np.diag([1.0, 2.0, 2.5])
    turn, move = np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.1, 4.0])
    momentum = spatial.spatial_inertia(mass, com, tensor) @ np.concatenate((turn, move))
    linear = mass * (move + np.cross(turn, com))
    np.testing.assert_allclose(momentum[3:], linear, rtol=1e-15)
    np.testing.assert_allclose(momentum[:3], tensor @ turn + np.cross(com, linear), rtol=1e-15)


def random_tensors() -> list[np.ndarray]:
    bases = np.random.default_rng(31).normal(size=(40, 3, 3))
    return [base @ base.T for base in bases]


def nearly_equal() -> list[np.ndarray]:
    rng = np.random.default_rng(32)
    tensors = []
    for split in (0.0, 1e-17, 2e-16, 1e-15, 1e-12, 1e-8, 1e-3):
        for moments in (
            [1.0, 1.0 + split, 1.0 - split],
            [1.0, 1.0, 1.0 + split],
            [0.5, 1.0, 1.0 + split],
        ):
            tensors.append(spatial.inertia_from_principal(moments, rng.normal(size=4)))
            tensors.append(np.diag(moments) + split * spatial.skew([1, 1, 1]) ** 2)
    return tensors


def thin_and_scaled() -> list[np.ndarray]:
    rng = np.random.default_rng(33)
    thin = [
        spatial.inertia_from_principal([flat, 1.0, 1.0], rng.normal(size=4))
        for flat in (0.0, 1e-300, 1e-17, 1e-9)
    ]
    sizes = (1e-320, 1e-300, 1e-9, 1e300)
    return [*thin, *(base * size for base, size in zip(random_tensors(), sizes, strict=False))]


GRADED_TENSORS = [np.outer(d, d) * (np.eye(3) + 0.5) for d in ([1, 1e-4, 1e-8], [1e-70, 1, 1e70])]
ROUND_TENSORS = [
    np.eye(3),
    np.zeros((3, 3)),
    np.diag([3.0, 1.0, 2.0]),
    np.full((3, 3), 0.5),
    np.ones((3, 3)) - np.eye(3),
]


def table_of(tensor: np.ndarray) -> mpmath.matrix:
    entries = hp.exact(tensor)
    return mpmath.matrix([entries[:3], entries[3:6], entries[6:]])


def test_moments_and_axes() -> None:
    moment_errors, bends, differences = {}, {}, {}
    for tensor in (
        *random_tensors(),
        *nearly_equal(),
        *thin_and_scaled(),
        *GRADED_TENSORS,
        *ROUND_TENSORS,
    ):
        case = repr(tensor.tolist())
        moments, axes = spatial.principal_axes(tensor)
        entries, columns, values = hp.exact(tensor), hp.exact(axes), hp.exact(moments)
        expected = sorted(mpmath.eigsy(table_of(tensor), eigvals_only=True))
        largest = max(max(map(abs, expected)), hp.DENORMAL / hp.ULP)
        assert list(moments) == sorted(moments), case
        moment_errors[case] = hp.ulps_of(largest, moments, expected)

        product = hp.matmul(hp.transpose(columns), columns)
        bends[case] = hp.ulps_of(mpmath.mpf(1), np.eye(3), product)
        assert np.linalg.det(axes) == pytest.approx(1, abs=1e-14), case

        spread = [columns[k] * values[k % 3] for k in range(9)]
        again = hp.matmul(spread, hp.transpose(columns))
        entry = max(max(map(abs, entries)), hp.DENORMAL / hp.ULP)
        differences[case] = hp.ulps_of(entry, tensor, again)
    assert hp.errors_over(4, moment_errors) == []
    assert hp.errors_over(5, bends) == []
    assert hp.errors_over(8, differences) == []


def test_graded_tensors_keep_their_small_moments() -> None:
    errors = {}
    for tensor in GRADED_TENSORS:
        with mpmath.workdps(700):
            expected = sorted(mpmath.eigsy(table_of(tensor), eigvals_only=True))
        moments, _ = spatial.principal_axes(tensor)
        errors[repr(tensor.tolist())] = hp.entry_ulps(moments, expected)
    assert hp.errors_over(8, errors) == []


def test_axes_of_a_diagonal_tensor_are_the_frame_s_own() -> None:
    moments, axes = spatial.principal_axes(np.diag([3.0, 1.0, 2.0]))
    assert moments.tolist() == [1, 2, 3]
    assert axes.tolist() == [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    moments, axes = spatial.principal_axes(np.diag([1.0, 3.0, 2.0]))
    assert moments.tolist() == [1, 2, 3]
    assert axes.tolist() == [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    assert not np.signbit(axes[0]).any()
    assert spatial.principal_axes(2 * np.eye(3))[1].tolist() == np.eye(3).tolist()


def test_signs_of_the_axes_do_not_hang_on_rounding() -> None:
    quarter = spatial.exp_so3([0, 0, np.pi / 4])
    for noise in (0.0, 1e-15, -1e-15):
        tensor = quarter @ np.diag([1.0, 2.0, 3.0]) @ quarter.T
        tensor[0, 0] += noise
        tensor = (tensor + tensor.T) / 2
        _, axes = spatial.principal_axes(tensor)
        np.testing.assert_allclose(axes[:, 0], [np.sqrt(0.5), np.sqrt(0.5), 0], atol=1e-14)
        np.testing.assert_allclose(axes[:, 1], [np.sqrt(0.5), -np.sqrt(0.5), 0], atol=1e-14)
        np.testing.assert_allclose(axes[:, 2], [0, 0, -1], atol=1e-14)


def test_nan_stays_in_its_entry() -> None:
    tensors = np.array([np.eye(3), np.full((3, 3), np.nan), np.diag([1, np.inf, 1])])
    tensors[2, 0, 1] = np.nan
    moments, axes = spatial.principal_axes(tensors)
    assert moments[0].tolist() == [1, 1, 1]
    assert np.isnan(moments[1:]).all()
    assert np.isnan(axes[1:]).all()
    assert spatial.is_physical_inertia(tensors).tolist() == [True, False, False]


def test_rounding_makes_no_tensor_unsymmetric() -> None:
    moments, _ = spatial.principal_axes(np.eye(3) + 1e-12 * np.eye(3, k=1))
    np.testing.assert_allclose(moments, 1, atol=1e-12)


def test_a_body_has_moments_of_which_none_exceeds_the_sum_of_the_others() -> None:
    for moments, physical in (
        ([1.0, 1.0, 1.0], True),
        ([1.0, 2.0, 3.0], True),
        ([1.0, 2.0, 3.0 + 1e-9], False),
        ([0.0, 1.0, 1.0], True),
        ([0.0, 0.0, 0.0], True),
        ([0.0, 0.0, 1.0], False),
        ([-1e-9, 1.0, 1.0], False),
        ([-1.0, -1.0, -1.0], False),
        ([1e-310, 1e-310, 2e-310], True),
        ([1e300, 1e300, 1.7e308], False),
        ([1.2e308, 1.2e308, 1.7e308], True),
    ):
        for order in ([0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2]):
            actual = spatial.is_physical_inertia(np.diag(moments)[order][:, order])
            assert isinstance(actual, np.bool_)
            assert actual == physical, (moments, order)


def test_a_flat_plate_written_with_few_digits() -> None:
    plate = np.diag([0.333, 0.083, 0.417])
    assert not spatial.is_physical_inertia(plate)
    assert spatial.is_physical_inertia(plate, rtol=5e-3)
    rotated = spatial.rotate_inertia(np.diag([1.0, 2.0, 3.0]), spatial.exp_so3([1, 2, 3]))
    assert spatial.is_physical_inertia(rotated)
