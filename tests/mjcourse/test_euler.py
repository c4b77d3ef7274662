import itertools

import mpmath
import numpy as np
import pytest

from mjcourse import spatial
from support import high_precision as hp

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


def exact_quat(angles: np.ndarray, seq: str) -> hp.Vector:
    turns = []
    for letter, angle in zip(seq.lower(), hp.exact(angles), strict=True):
        turns.append(hp.exp([angle if letter == axis else mpmath.mpf(0) for axis in "xyz"]))
    first, second, third = turns[::-1] if seq.isupper() else turns
    return hp.mul(first, hp.mul(second, third))


def test_quaternion_to_four_ulp() -> None:
    errors = {}
    for seq, angles in itertools.product(SEQUENCES, TURNS):
        actual = spatial.euler_to_quat(angles, seq)
        errors[seq, angles] = hp.ulps_of(mpmath.mpf(1), actual, exact_quat(np.array(angles), seq))
    assert hp.errors_over(4, errors) == []


@pytest.mark.site
def test_angles_give_the_rotation_back_to_six_ulp() -> None:
    errors = {}
    turns = [*TURNS, *np.random.default_rng(11).uniform(-3.2, 3.2, size=(10, 3)).tolist()]
    for seq, angles in itertools.product(SEQUENCES, turns):
        quat = spatial.euler_to_quat(angles, seq)
        actual = spatial.quat_to_euler(quat * 1e-200, seq)
        expected = hp.same_up_to_sign(quat, exact_quat(actual, seq))
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


def test_a_bad_sequence_is_an_error() -> None:
    for seq in ("xy", "xxy", "xyY", "XYz", "wxy", "", "xyzx", "rpy", "x y"):
        text = (
            f"seq must be three of x, y, z or of X, Y, Z, no two neighbours the same, got {seq!r}"
        )
        with pytest.raises(ValueError) as caught:
            spatial.euler_to_quat([0, 0, 0], seq)
        assert str(caught.value) == text
        with pytest.raises(ValueError) as caught:
            spatial.quat_to_euler([1, 0, 0, 0], seq)
        assert str(caught.value) == text
