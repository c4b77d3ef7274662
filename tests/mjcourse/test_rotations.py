import itertools

import mpmath
import numpy as np
import pytest

from mjcourse import spatial
from support import high_precision as hp

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


def test_matrices_that_are_no_rotations_are_errors() -> None:
    stretched = np.stack([np.eye(3), np.diag([1, 1.001, 1])])
    text = r"^mat at index \(1,\) is not a rotation: its columns are not orthonormal to 1e-05$"
    for call in (spatial.mat_to_quat, spatial.log_so3):
        with pytest.raises(ValueError, match=text):
            call(stretched)
        with pytest.raises(
            ValueError, match=r"^mat is a reflection, not a rotation: its determinant is -1$"
        ):
            call(np.diag([1, 1, -1]))
    with pytest.raises(ValueError, match="not orthonormal"):
        spatial.mat_to_quat([[1, 0, 0], [0, 1, 0.01], [0, 0, 1]])
    with pytest.raises(ValueError, match="not orthonormal"):
        spatial.mat_to_quat(np.full((3, 3), 1e300))
    with pytest.raises(ValueError, match="not orthonormal"):
        spatial.mat_to_quat(np.zeros((3, 3)))


def test_skew_and_back() -> None:
    vector = np.array([5e-324, -1.7e308, 3.0])
    mat = spatial.skew(vector)
    assert (mat == -mat.T).all()
    assert spatial.unskew(mat).tolist() == vector.tolist()
    assert (spatial.skew([1, 2, 3]) @ [4, 5, 6]).tolist() == np.cross([1, 2, 3], [4, 5, 6]).tolist()
    assert not np.signbit(spatial.skew([0, 0, 0])).any()
