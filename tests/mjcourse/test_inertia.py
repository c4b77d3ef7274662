import itertools

import mpmath
import numpy as np
import pytest

from mjcourse import spatial
from support import high_precision as hp


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


def test_composition_errors() -> None:
    eye = np.eye(3)
    with pytest.raises(ValueError, match=r"^mass must have shape \(\.\.\., n\), got \(\)$"):
        spatial.compose_inertia(1.0, [[0, 0, 0]], [eye])
    with pytest.raises(ValueError, match=r"^com must have shape \(\.\.\., n, 3\), got \(3,\)$"):
        spatial.compose_inertia([1.0], [0, 0, 0], [eye])
    with pytest.raises(
        ValueError, match=r"^inertia must have shape \(\.\.\., n, 3, 3\), got \(3, 3\)$"
    ):
        spatial.compose_inertia([1.0], [[0, 0, 0]], eye)
    with pytest.raises(
        ValueError,
        match=r"^leading shapes do not broadcast: mass \(3,\), com \(2,\), inertia \(2,\)$",
    ):
        spatial.compose_inertia([1, 2, 3], np.zeros((2, 3)), np.zeros((2, 3, 3)))
    with pytest.raises(ValueError, match=r"^a body needs at least one part, got none$"):
        spatial.compose_inertia(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3, 3)))
    with pytest.raises(ValueError, match=r"^total mass is not positive$"):
        spatial.compose_inertia([1.0, -1.0], np.zeros((2, 3)), np.zeros((2, 3, 3)))
    with pytest.raises(ValueError, match=r"^total mass at index \(1,\) is not positive$"):
        spatial.compose_inertia([[1.0], [0.0]], np.zeros((1, 3)), np.zeros((1, 3, 3)))


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
