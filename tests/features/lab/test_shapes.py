"""Surfaces of geoms that degenerate, and normals that no picture of `tests/browser` shows."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coursebuild.features.lab.picture.shapes import (
    flat_surface,
    ropes,
    sharpen,
    smooth_surface,
    surface,
)


def test_normals_of_an_ellipsoid_are_those_of_its_equation() -> None:
    axes = np.array((0.5, 0.2, 1.0))
    shape = surface("ellipsoid", (0.5, 0.2, 1.0))
    assert shape is not None
    gradient = shape.vertices / axes**2
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    assert np.allclose(shape.normals, gradient, atol=1e-9)


def test_a_triangle_without_area_has_no_normal_and_no_error() -> None:
    shape = flat_surface(np.zeros((3, 3)), np.array([(0, 1, 2)]))
    assert np.array_equal(shape.normals, np.zeros((3, 3)))


def test_a_rope_whose_ends_meet_is_a_ball() -> None:
    rope = ropes(np.zeros((2, 3)), np.array([(0, 1)]), 0.2)
    assert np.isfinite(rope.vertices).all()
    assert np.linalg.norm(rope.vertices, axis=1).max() == pytest.approx(0.2)


def test_a_smooth_surface_has_the_mean_normal_of_its_faces() -> None:
    ridge = np.array([(0.0, -1, 0), (0, 1, 0), (-1, 0, -1), (1, 0, -1)])
    shape = smooth_surface(ridge, np.array([(0, 1, 2), (1, 0, 3)]))
    assert shape.normals[0] == pytest.approx((0, 0, 1))
    assert shape.normals[3] == pytest.approx((math.sqrt(0.5), 0, math.sqrt(0.5)))


def test_an_edge_is_sharp_where_the_face_is_turned_far() -> None:
    up = np.tile((0.0, 0.0, 1.0), (1, 3, 1))
    for angle, sharp in ((0.3, False), (0.6, False), (0.7, True), (1.5, True)):
        corners = np.array([[(0.0, 0, 0), (1, 0, 0), (0, math.cos(angle), math.sin(angle))]])
        expected = (0, -math.sin(angle), math.cos(angle)) if sharp else (0, 0, 1)
        assert sharpen(corners, up)[0, 1] == pytest.approx(expected), angle
    assert np.array_equal(sharpen(np.zeros((1, 3, 3)), up), up), "no face, no normal of it"
