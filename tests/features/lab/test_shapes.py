"""Surfaces of geoms: closed, outward, of the right size, with normals of length one."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest

from coursebuild.features.lab.picture.shapes import (
    Kind,
    Surface,
    flat_surface,
    ropes,
    sharpen,
    smooth_surface,
    surface,
)

ROUND = 0.03
"""How much smaller a round thing is for being made of triangles."""
CLOSED: list[tuple[Kind, tuple[float, ...], float, float]] = [
    # kind, size, volume, area
    ("sphere", (0.5, 0, 0), 4 / 3 * math.pi * 0.125, math.pi),
    ("box", (0.1, 0.2, 0.3), 8 * 0.006, 8 * (0.02 + 0.03 + 0.06)),
    ("cylinder", (0.3, 0.7, 0), math.pi * 0.09 * 1.4, 2 * math.pi * (0.09 + 0.3 * 1.4)),
    ("capsule", (0.2, 0.6, 0), math.pi * 0.04 * (1.2 + 0.8 / 3), 2 * math.pi * 0.2 * (1.2 + 0.4)),
    ("ellipsoid", (0.3, 0.3, 0.3), 4 / 3 * math.pi * 0.027, 4 * math.pi * 0.09),
    ("ellipsoid", (0.5, 0.2, 1.0), 4 / 3 * math.pi * 0.1, math.nan),
    ("cylinder", (2.0, 0.001, 0), math.pi * 4 * 0.002, 2 * math.pi * (4 + 2 * 0.002)),
    ("capsule", (0.2, 0.0, 0), 4 / 3 * math.pi * 0.008, 4 * math.pi * 0.04),
]
CASES = pytest.mark.parametrize(("kind", "size", "volume", "area"), CLOSED)


def triangles(shape: Surface) -> tuple[np.ndarray, np.ndarray]:
    """The corners, and the normal (twice the area long) by the order of the corners."""
    corners = shape.vertices[shape.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return corners, across


def made(kind: Kind, size: tuple[float, ...]) -> Surface:
    shape = surface(kind, size)
    assert shape is not None
    return shape


@CASES
def test_volume_and_area(kind: Kind, size: tuple[float, ...], volume: float, area: float) -> None:
    corners, across = triangles(made(kind, size))
    found = float(np.einsum("ij,ij->", corners[:, 0], across) / 6)
    assert volume * (1 - ROUND) < found <= volume * (1 + 1e-12), "counter-clockwise from outside"
    if not math.isnan(area):
        total = float(np.linalg.norm(across, axis=1).sum() / 2)
        assert area * (1 - ROUND) < total <= area * (1 + 1e-12)


@CASES
def test_every_edge_has_two_sides(
    kind: Kind, size: tuple[float, ...], volume: float, area: float
) -> None:
    """Each edge is walked once in each direction; triangles without area do not count."""
    shape = made(kind, size)
    corners, across = triangles(shape)
    edges: Counter[tuple[tuple[float, ...], tuple[float, ...]]] = Counter()
    for corner, normal in zip(corners, across, strict=True):
        if np.linalg.norm(normal) < 1e-12:
            continue
        points = [tuple((np.round(c, 9) + 0.0).tolist()) for c in corner]
        edges.update(zip(points, points[1:] + points[:1], strict=True))
    assert all(count == 1 for count in edges.values())
    assert {(b, a) for a, b in edges} == set(edges)


@CASES
def test_normals_point_outward(
    kind: Kind, size: tuple[float, ...], volume: float, area: float
) -> None:
    shape = made(kind, size)
    assert np.allclose(np.linalg.norm(shape.normals, axis=1), 1, atol=1e-12)
    assert (np.einsum("ij,ij->i", shape.normals, shape.vertices) > -1e-9).all()
    _, across = triangles(shape)
    real = np.linalg.norm(across, axis=1) > 1e-12
    mean = shape.normals[shape.faces].sum(axis=1)
    assert (np.einsum("ij,ij->i", mean, across)[real] > 0).all()


@CASES
def test_it_reaches_as_far_as_its_size(
    kind: Kind, size: tuple[float, ...], volume: float, area: float
) -> None:
    reach = np.abs(made(kind, size).vertices).max(axis=0)
    r = size[0]
    half = {
        "sphere": (r, r, r),
        "capsule": (r, r, r + size[1]),
        "cylinder": (r, r, size[1]),
    }.get(kind, size)
    assert np.allclose(reach, half[:3], rtol=0.01, atol=1e-9)


def test_normals_of_an_ellipsoid_are_those_of_its_equation() -> None:
    axes = np.array((0.5, 0.2, 1.0))
    shape = made("ellipsoid", (0.5, 0.2, 1.0))
    gradient = shape.vertices / axes**2
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    assert np.allclose(shape.normals, gradient, atol=1e-9)


def test_making_one_leaves_the_next_alone() -> None:
    before = made("sphere", (1.0,)).vertices.copy()
    made("capsule", (0.1, 5.0))
    made("ellipsoid", (3.0, 2.0, 1.0))
    assert np.array_equal(made("sphere", (1.0,)).vertices, before)


@pytest.mark.parametrize(
    ("size", "half"),
    [
        ((2.0, 3.0, 0.1), (2.0, 3.0)),
        ((0.0, 0.0, 1.0), (30.0, 30.0)),
        ((1.0, 0.0, 1.0), (1.0, 30.0)),
    ],
)
def test_a_plane_faces_up(size: tuple[float, ...], half: tuple[float, float]) -> None:
    shape = made("plane", size)
    _, across = triangles(shape)
    assert (across[:, 2] > 0).all()
    assert np.isclose(across[:, 2].sum() / 2, 4 * half[0] * half[1])
    assert np.array_equal(np.abs(shape.vertices).max(axis=0), (*half, 0.0))
    assert np.array_equal(shape.normals, np.tile((0.0, 0.0, 1.0), (len(shape.vertices), 1)))


def test_a_mesh_is_shaded_flat() -> None:
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)
    faces = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    shape = flat_surface(vertices, faces)
    assert shape.vertices.shape == (12, 3)
    corners, across = triangles(shape)
    assert np.isclose(np.einsum("ij,ij->", corners[:, 0], across) / 6, 1 / 6)
    assert np.allclose(shape.normals[:3], (0, 0, -1))
    assert np.allclose(shape.normals[9:], np.full((3, 3), 3**-0.5))


def test_a_triangle_without_area_has_no_normal_and_no_error() -> None:
    shape = flat_surface(np.zeros((3, 3)), np.array([(0, 1, 2)]))
    assert np.array_equal(shape.normals, np.zeros((3, 3)))


def test_what_has_no_surface() -> None:
    assert surface("mesh", (1.0, 1.0, 1.0)) is None
    given = flat_surface(np.eye(3), np.array([(0, 1, 2)]))
    for kind in ("mesh", "sdf", "hfield"):
        assert surface(kind, (1.0, 1.0, 1.0), given) is given


def test_ropes_have_their_radius_and_round_ends() -> None:
    points = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 2.0)])
    rope = ropes(points, np.array([(0, 1), (1, 2)]), 0.1)
    assert rope.vertices.min(axis=0) == pytest.approx((-0.1, -0.1, -0.1), rel=0.05)
    assert rope.vertices.max(axis=0) == pytest.approx((1.1, 0.1, 2.1), rel=0.05)
    ends = points[[0, 1]], points[[1, 2]]
    for vertex, normal in zip(rope.vertices, rope.normals, strict=True):
        nearest = []
        for a, b in zip(*ends, strict=True):
            along = np.clip((vertex - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
            nearest.append(np.linalg.norm(vertex - a - along * (b - a)))
        assert min(nearest) <= 0.1 + 1e-12
        assert np.linalg.norm(normal) == pytest.approx(1)
    _, across = triangles(rope)
    facing = np.einsum("ij,ij->i", across, rope.normals[rope.faces].mean(axis=1))
    assert (facing >= -1e-15).all(), "counter-clockwise from outside"


def test_a_rope_whose_ends_meet_is_a_ball() -> None:
    rope = ropes(np.zeros((2, 3)), np.array([(0, 1)]), 0.2)
    assert np.isfinite(rope.vertices).all()
    assert np.linalg.norm(rope.vertices, axis=1).max() == pytest.approx(0.2)


def test_a_smooth_surface_has_the_mean_normal_of_its_faces() -> None:
    ridge = np.array([(0.0, -1, 0), (0, 1, 0), (-1, 0, -1), (1, 0, -1)])
    found = smooth_surface(ridge, np.array([(0, 1, 2), (1, 0, 3)]))
    assert found.normals[0] == pytest.approx((0, 0, 1))
    assert found.normals[3] == pytest.approx((math.sqrt(0.5), 0, math.sqrt(0.5)))


@pytest.mark.parametrize(
    ("turned", "sharp"), [(0.3, False), (0.6, False), (0.7, True), (1.5, True)]
)
def test_an_edge_is_sharp_where_the_face_is_turned_far(turned: float, sharp: bool) -> None:
    corners = np.array([[(0.0, 0, 0), (1, 0, 0), (0, math.cos(turned), math.sin(turned))]])
    up = np.tile((0.0, 0.0, 1.0), (1, 3, 1))
    expected = (0, -math.sin(turned), math.cos(turned)) if sharp else (0, 0, 1)
    assert sharpen(corners, up)[0, 1] == pytest.approx(expected)
    assert np.array_equal(sharpen(np.zeros((1, 3, 3)), up), up), "no face, no normal of it"
