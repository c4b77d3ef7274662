"""The surfaces of MuJoCo's geoms as triangles, in each geom's own frame.

Entry points: `surface(kind, size, mesh)`; `flat_surface`, `smooth_surface` and `ropes` of points.

Sizes are MuJoCo's: half-lengths of a box, radius and half-length of the axis of a cylinder and a
capsule, semi-axes of an ellipsoid. Triangles share vertices only where the surface is smooth, so
that normals at the vertices make curves look smooth and edges sharp.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypeAlias

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Kind: TypeAlias = Literal[
    "plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf"
]

_SEGMENTS = 28
"""Around a round surface."""
_FAR = 30.0
"""Half-length, m, of a plane without a size."""
_ROPE_SEGMENTS = 12
_HEAD_LENGTH = 3.0
"""Of an arrow's head, in radii of its shaft."""
_SMOOTH = 0.8
"""Least cosine between the normals of a face and of its vertex at an edge that is not sharp."""


class Surface(Struct, frozen=True):
    """Triangles with normals."""

    vertices: Array
    """(n, 3), m."""
    normals: Array
    """(n, 3), of length 1."""
    faces: NDArray[np.int64]
    """(m, 3), counter-clockwise seen from outside."""
    uv: Array | None = None
    """(n, 2), texture coordinates from a file."""


def surface(kind: Kind, size: tuple[float, ...], mesh: Surface | None = None) -> Surface | None:
    """Make the surface of a geom; `None` for a mesh that is missing."""
    match kind:
        case "mesh" | "sdf" | "hfield":
            return mesh
        case "plane":
            x, y = (half if half > 0 else _FAR for half in size[:2])
            corners = np.array([(-x, -y, 0.0), (-x, y, 0.0), (x, -y, 0.0), (x, y, 0.0)])
            return Surface(corners, np.tile((0.0, 0.0, 1.0), (4, 1)), grid_faces(2, 2))
        case "box":
            return _box(size)
        case "cylinder":
            radius, half = size[:2]
            rim, hub = [(radius, half), (radius, -half)], [(0, half), (0, -half)]
            profile = np.array([hub[0], rim[0], *rim, rim[1], hub[1]])
            return _revolve(profile, np.repeat([(0.0, 1.0), (1.0, 0.0), (0.0, -1.0)], 2, axis=0))
        case "capsule":
            return _capsule(size[0], size[1], _SEGMENTS)
        case "sphere" | "ellipsoid":
            ball = _capsule(1.0, 0.0, _SEGMENTS)
            axes = np.array(size[:3] if kind == "ellipsoid" else (size[0],) * 3)
            return Surface(ball.normals * axes, unit(ball.normals / axes), ball.faces)


def arrow(radius: float, length: float, *, head: float, double: bool) -> Surface:
    """Make an arrow along z from the origin, or to both sides of it; `head` in shaft widths."""
    tip, brim = min(_HEAD_LENGTH * radius, length / 2), head * radius
    neck = length - tip
    upper = [(0.0, length), (brim, neck), (brim, neck), (radius, neck), (radius, neck)]
    normals = [(tip, brim), (tip, brim), (0.0, -1.0), (0.0, -1.0), (1.0, 0.0)]
    if double:
        lower = [(r, -z) for r, z in upper[::-1]]
        lower_normals = [(r, -z) for r, z in normals[::-1]]
    else:
        lower = [(radius, 0.0), (radius, 0.0), (0.0, 0.0)]
        lower_normals = [(1.0, 0.0), (0.0, -1.0), (0.0, -1.0)]
    return _revolve(np.array(upper + lower), unit(np.array(normals + lower_normals)))


def flat_surface(vertices: Array, faces: NDArray[np.int64]) -> Surface:
    """Make a mesh with flat shading: every triangle has vertices of its own."""
    corners = vertices[faces]
    normals = np.repeat(unit(_area_normals(corners)), 3, axis=0)
    return Surface(corners.reshape(-1, 3), normals, np.arange(3 * len(faces)).reshape(-1, 3))


def smooth_surface(vertices: Array, faces: NDArray[np.int64]) -> Surface:
    """Make a mesh whose normals average those of the adjacent faces, weighted by area."""
    normals = np.zeros_like(vertices)
    np.add.at(normals, faces, _area_normals(vertices[faces])[:, None])
    return Surface(vertices, unit(normals), faces)


def sharpen(corners: Array, normals: Array) -> Array:
    """Replace normals (m, 3, 3) of corners (m, 3, 3) by the face's where they differ much."""
    face = unit(_area_normals(corners))[:, None]
    sharp = (face * normals).sum(axis=2, keepdims=True) < _SMOOTH
    has_area = np.any(face != 0, axis=2, keepdims=True)
    corner_normals: Array = np.where(sharp & has_area, face, normals)
    return corner_normals


def ropes(points: Array, ends: NDArray[np.int64], radius: float) -> Surface:
    """Make round lines between points (n, 3); `ends` (m, 2) holds the indices of their ends."""
    parts = []
    for a, b in points[ends]:
        direction = b - a if np.any(a != b) else np.array((0.0, 0.0, 1.0))
        z = unit(direction)
        x = unit(np.cross(z, np.eye(3)[np.abs(z).argmin()]))
        axes = np.stack((x, np.cross(z, x), z))
        capsule = _capsule(radius, float(np.linalg.norm(b - a)) / 2, _ROPE_SEGMENTS)
        middle = (a + b) / 2
        parts.append(
            Surface(capsule.vertices @ axes + middle, capsule.normals @ axes, capsule.faces)
        )
    return join_surfaces(parts)


def join_surfaces(surfaces: Sequence[Surface]) -> Surface:
    """Join surfaces without texture coordinates into one."""
    starts = np.cumsum([0, *(len(part.vertices) for part in surfaces[:-1])])
    return Surface(
        np.concatenate([part.vertices for part in surfaces]),
        np.concatenate([part.normals for part in surfaces]),
        np.concatenate([part.faces + n for part, n in zip(surfaces, starts, strict=True)]),
    )


def grid_faces(rows: int, columns: int) -> NDArray[np.int64]:
    """Make two triangles for each cell of a grid of vertices."""
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    first = np.stack((a, b, c), axis=-1).reshape(-1, 3)
    second = np.stack((a, c, d), axis=-1).reshape(-1, 3)
    return np.concatenate((first, second))


def _area_normals(corners: Array) -> Array:
    """Return the normals of triangles (m, 3, 3), with twice their area as length."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def unit(vectors: Array) -> Array:
    """Scale vectors to length 1; those of length 0 stay."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1.0)


def _box(size: tuple[float, ...]) -> Surface:
    square = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    sides = [(axis, sign) for axis in range(3) for sign in (1.0, -1.0)]
    corners = [np.roll((sign, a * sign, b), axis) for axis, sign in sides for a, b in square]
    normals = [np.roll((sign, 0.0, 0.0), axis) for axis, sign in sides]
    faces = 4 * np.arange(6)[:, None, None] + ((0, 1, 2), (0, 2, 3))
    return Surface(
        np.array(corners) * size[:3], np.repeat(normals, 4, axis=0), faces.reshape(-1, 3)
    )


def _capsule(radius: float, half: float, segments: int) -> Surface:
    quarter = np.linspace(0.0, np.pi / 2, segments // 4 + 1)
    polar = np.concatenate((quarter, np.pi - quarter[::-1]))
    normals = np.column_stack((np.sin(polar), np.cos(polar)))
    shift = np.repeat((half, -half), len(quarter))
    profile = np.column_stack((radius * normals[:, 0], radius * normals[:, 1] + shift))
    return _revolve(profile, normals, segments)


def _revolve(profile: Array, normals: Array, segments: int = _SEGMENTS) -> Surface:
    """Revolve a profile, points (distance from z, height) from top to bottom, around z."""
    angles = np.linspace(0.0, 2 * np.pi, segments + 1)

    def turn(rows: Array) -> Array:
        x, y = np.outer(rows[:, 0], np.cos(angles)), np.outer(rows[:, 0], np.sin(angles))
        z = np.repeat(rows[:, 1:], segments + 1, axis=1)
        return np.stack((x, y, z), axis=-1).reshape(-1, 3)

    return Surface(turn(profile), turn(normals), grid_faces(len(profile), segments + 1))
