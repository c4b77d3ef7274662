import mpmath
import numpy as np
import pytest

from mjcourse import spatial
from support import high_precision as hp


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


def test_an_unsymmetric_tensor_is_an_error() -> None:
    skewed = np.eye(3)
    skewed[0, 1] = 1e-6
    text = r"^inertia is not symmetric to 1e-09 of its largest entry$"
    with pytest.raises(ValueError, match=text):
        spatial.principal_axes(skewed)
    with pytest.raises(ValueError, match=r"^inertia at index \(1,\) is not symmetric to 1e-09"):
        spatial.principal_axes([np.eye(3), skewed * 1e-300])
    skewed[0, 1] = 1e-12
    moments, _ = spatial.principal_axes(skewed)
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
