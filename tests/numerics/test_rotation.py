"""Quaternions against SciPy's rotations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from coursebuild.numerics.rotation import (
    angle_between,
    conjugate,
    from_axis_angle,
    from_matrix,
    multiply,
    rate_of,
    rotate,
)

RNG = np.random.default_rng(5)
P, Q = (Rotation.random(200, rng=RNG) for _ in range(2))


def quaternions(r: Rotation) -> np.ndarray:
    return np.roll(r.as_quat(), 1, axis=1)


def same(a: np.ndarray, b: np.ndarray) -> bool:
    return bool(np.max(angle_between(a, b)) < 1e-14)


def test_products_and_vectors() -> None:
    p, q = quaternions(P), quaternions(Q)
    assert same(multiply(p, q), quaternions(P * Q))
    v = RNG.normal(size=(200, 3))
    assert np.max(np.abs(rotate(p, v) - P.apply(v))) < 1e-14
    assert np.max(np.abs(multiply(p, conjugate(p)) - [1, 0, 0, 0])) < 1e-15


def test_matrices_and_half_turns() -> None:
    assert same(from_matrix(P.as_matrix()), quaternions(P))
    half = np.array([np.diag([1.0, -1, -1]), np.diag([-1.0, 1, -1]), np.diag([-1.0, -1, 1])])
    assert np.array_equal(np.abs(from_matrix(half)), np.eye(4)[1:])


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-3, 1.0, 3.0, np.pi])
def test_tiny_and_large_angles(angle: float) -> None:
    axis = np.array([1.0, -2.0, 2.0]) / 3
    p = quaternions(P)
    turned = multiply(p, from_axis_angle(axis, np.full(200, angle)))
    assert np.max(np.abs(angle_between(p, turned) - angle)) < 1e-15 * (1 + angle)
    assert np.max(np.abs(angle_between(p, -turned) - angle)) < 1e-15 * (1 + angle)


def test_rate_is_the_derivative_of_a_turn_in_the_bodys_frame() -> None:
    omega, h = np.array([0.3, -2.0, 1.1]), 1e-5
    speed = float(np.linalg.norm(omega))
    p = quaternions(P)
    ahead = multiply(p, from_axis_angle(omega / speed, np.full(200, speed * h)))
    behind = multiply(p, from_axis_angle(omega / speed, np.full(200, -speed * h)))
    assert np.max(np.abs((ahead - behind) / (2 * h) - rate_of(p, omega + 0 * p[:, 1:]))) < 1e-9
