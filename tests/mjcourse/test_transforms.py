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
