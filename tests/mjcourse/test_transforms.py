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
        moved = hp.matmul(cross_matrix(pos), hp.exact(rot))
        motion, force = spatial.motion_transform(rot, pos), spatial.force_transform(rot, pos)
        size = 1 + hp.length(hp.exact(pos))
        for kind, got, zero, full in (
            ("motion", motion, motion[:3, 3:], motion[3:, :3]),
            ("force", force, force[3:, :3], force[:3, 3:]),
        ):
            assert (got[:3, :3] == rot).all()
            assert (got[3:, 3:] == rot).all()
            assert (zero == 0).all()
            errors[kind, tuple(pos)] = hp.ulps_of(size, full, moved)
    assert hp.beyond(2, errors) == []


def test_a_motion_of_a_rigid_body_seen_from_two_points() -> None:
    turn, move = np.array([0.3, -1.0, 2.0]), np.array([5.0, 0.1, -2.0])
    for rot, pos in POSES:
        got = spatial.motion_transform(rot, pos) @ np.concatenate((turn, move))
        # The point of the body that is at A's origin moves with v + ω × (0 − p).
        want_turn = rot @ turn
        want_move = rot @ move + np.cross(want_turn, -pos)
        atol = 1e-14 * (1 + np.abs(pos).max())
        np.testing.assert_allclose(got[:3], want_turn, rtol=0, atol=1e-15)
        np.testing.assert_allclose(got[3:], want_move, rtol=0, atol=atol)


def test_a_force_off_the_origin_has_a_torque() -> None:
    force = spatial.force_transform(np.eye(3), [0, 2, 0]) @ [0, 0, 0, 5, 0, 0]
    assert force.tolist() == [0, 0, -10, 5, 0, 0]


def test_force_transform_is_the_transposed_inverse() -> None:
    for rot, pos in POSES:
        product = spatial.force_transform(rot, pos).T @ spatial.motion_transform(rot, pos)
        atol = 1e-15 * (1 + np.abs(pos).max())
        np.testing.assert_allclose(product, np.eye(6), rtol=0, atol=atol)


def test_poses_compose_and_invert() -> None:
    (rot1, pos1), (rot2, pos2) = POSES[2], POSES[3]
    rot, pos = spatial.pose_compose(rot1, pos1, rot2, pos2)
    point = np.array([0.2, -3.0, 1.0])
    np.testing.assert_allclose(rot @ point + pos, rot1 @ (rot2 @ point + pos2) + pos1, rtol=1e-14)
    back_rot, back_pos = spatial.pose_inverse(rot1, pos1)
    np.testing.assert_allclose(back_rot @ (rot1 @ point + pos1) + back_pos, point, rtol=1e-14)
    for transform in (spatial.motion_transform, spatial.force_transform):
        np.testing.assert_allclose(
            transform(rot1, pos1) @ transform(rot2, pos2), transform(rot, pos), rtol=0, atol=1e-13
        )
        np.testing.assert_allclose(
            transform(back_rot, back_pos) @ transform(rot1, pos1), np.eye(6), rtol=0, atol=1e-14
        )


def test_poses_are_fresh_arrays() -> None:
    rot, pos = np.eye(3), np.zeros(3)
    back, _ = spatial.pose_inverse(rot, pos)
    back[0, 1] = 7
    both, shifted = spatial.pose_compose(rot, pos, rot, np.zeros((2, 3)))
    both[0, 0, 0] = 9
    shifted[0] = 4
    assert (rot == np.eye(3)).all()
    assert both[1, 0, 0] == 1
    assert (shifted[1] == 0).all()
    assert not np.signbit(spatial.pose_inverse(rot, pos)[1]).any()


def test_cross_products_against_their_matrices() -> None:
    v, m, f = VELOCITY, MOTION, FORCE
    turn, move = spatial.skew(v[:3]), spatial.skew(v[3:])
    crm = np.block([[turn, np.zeros((3, 3))], [move, turn]])
    np.testing.assert_allclose(spatial.cross_motion(v, m), crm @ m, rtol=1e-14)
    np.testing.assert_allclose(spatial.cross_force(v, f), -crm.T @ f, rtol=1e-14)
    assert spatial.cross_motion(v, v).tolist() == pytest.approx([0] * 6, abs=1e-15)


def test_cross_product_is_the_derivative_of_the_transform() -> None:
    v, m, f = VELOCITY, MOTION, FORCE
    h = 1e-6

    def pose(t: float) -> tuple[np.ndarray, np.ndarray]:
        return spatial.exp_so3(v[:3] * t), v[3:] * t

    for transform, vector, cross in (
        (spatial.motion_transform, m, spatial.cross_motion),
        (spatial.force_transform, f, spatial.cross_force),
    ):
        rate = (transform(*pose(h)) - transform(*pose(-h))) @ vector / (2 * h)
        np.testing.assert_allclose(cross(v, vector), rate, rtol=0, atol=1e-9)
