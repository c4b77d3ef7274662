import numpy as np
import pytest

from mjcourse import spatial

RNG = np.random.default_rng(23)
VELOCITY, MOTION, FORCE = RNG.normal(size=(3, 6))


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
