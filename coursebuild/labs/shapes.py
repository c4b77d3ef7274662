"""The surfaces of MuJoCo's geoms as triangles, in each geom's own frame.

Entry point: `surface(kind, size, mesh)`.

Sizes are MuJoCo's: half-lengths for a box, radius and half-length of the axis for a cylinder and a
capsule, semi-axes for an ellipsoid. Vertices are shared only where the surface is smooth, so that
normals at the vertices shade round things round and edges sharp.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Kind: TypeAlias = Literal[
    "plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf", "line"
]

_AROUND = 28
"""Segments around a round thing."""
_FAR = 30.0
"""Half-length (m) at which a plane without a size ends in a picture."""
_AROUND_ROPE = 12
_SMOOTH = 0.8
"""Cosine between a face and its vertex's normal from which on the edge is not sharp."""


class Surface(Struct, frozen=True):
    """Triangles with normals."""

    vertices: Array
    """(n, 3), m."""
    normals: Array
    """(n, 3), of length 1."""
    faces: NDArray[np.int64]
    """(m, 3), counter-clockwise seen from outside."""
    uv: Array | None = None
    """(n, 2), texture coordinates of a file."""


def surface(kind: Kind, size: tuple[float, ...], mesh: Surface | None = None) -> Surface | None:
    """The surface of a geom; `None` for what has none (a line, a mesh that is not given)."""
    if kind in ("mesh", "sdf", "hfield"):
        return mesh
    if kind == "line":
        return None
    if kind == "plane":
        return _plane(size)
    if kind == "box":
        return _box(size)
    unit = _unit_sphere()
    if kind == "cylinder":
        return _cylinder(size[0], size[1])
    if kind == "capsule":
        return _capsule(size[0], size[1])
    axes = np.array(size[:3] if kind == "ellipsoid" else (size[0],) * 3)
    normals = unit.vertices / axes
    return Surface(unit.vertices * axes, _unit(normals), unit.faces)


def mesh_surface(vertices: Array, faces: NDArray[np.int64]) -> Surface:
    """A mesh shaded flat: every triangle has vertices of its own."""
    corners = vertices[faces]
    normals = _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    count = 3 * len(faces)
    return Surface(
        corners.reshape(count, 3),
        np.repeat(normals, 3, axis=0),
        np.arange(count).reshape(-1, 3),
    )


def smooth_surface(vertices: Array, faces: NDArray[np.int64]) -> Surface:
    """A mesh whose normals are the mean of those of the faces around, by their area."""
    corners = vertices[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, faces[:, k], across)
    return Surface(vertices, _unit(normals), faces)


def joined(surfaces: Sequence[Surface]) -> Surface:
    """Several surfaces, none of which has texture coordinates, as one."""
    starts = np.cumsum([0, *(len(part.vertices) for part in surfaces[:-1])])
    return Surface(
        np.concatenate([part.vertices for part in surfaces]),
        np.concatenate([part.normals for part in surfaces]),
        np.concatenate([part.faces + n for part, n in zip(surfaces, starts, strict=True)]),
    )


def sharpened(corners: Array, normals: Array) -> Array:
    """Normals (m, 3, 3) of triangles' corners (m, 3, 3): the face's where they are far off."""
    face = _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))[:, None]
    sharp = (face * normals).sum(axis=2, keepdims=True) < _SMOOTH
    known = np.any(face != 0, axis=2, keepdims=True)
    found: Array = np.where(sharp & known, face, normals)
    return found


def ropes(points: Array, ends: NDArray[np.int64], radius: float) -> Surface:
    """Lines between points (n, 3), `ends` (m, 2) of each, of a radius and round at the ends."""
    knot = _turned(np.linspace(0.0, np.pi, _AROUND_ROPE // 2 + 1), _AROUND_ROPE)
    rows = _grid_faces(_AROUND_ROPE // 2 + 1, _AROUND_ROPE + 1)
    parts = [Surface(knot * radius + point, knot, rows) for point in points]
    around = np.linspace(0.0, 2 * np.pi, _AROUND_ROPE + 1)
    for a, b in points[ends]:
        z = _unit(b - a)
        x = _unit(np.cross(z, np.eye(3)[np.abs(z).argmin()]))
        ring = np.outer(np.cos(around), x) + np.outer(np.sin(around), np.cross(z, x))
        side = np.concatenate((ring * radius + b, ring * radius + a))
        parts.append(Surface(side, np.tile(ring, (2, 1)), _grid_faces(2, _AROUND_ROPE + 1)))
    return joined(parts)


def _unit(vectors: Array) -> Array:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1.0)


def _plane(size: tuple[float, ...]) -> Surface:
    x, y = (half if half > 0 else _FAR for half in size[:2])
    corners = np.array([(-x, -y, 0.0), (-x, y, 0.0), (x, -y, 0.0), (x, y, 0.0)])
    return Surface(corners, np.tile((0.0, 0.0, 1.0), (4, 1)), _grid_faces(2, 2))


def _grid_faces(rows: int, columns: int) -> NDArray[np.int64]:
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    first = np.stack((a, b, c), axis=-1).reshape(-1, 3)
    second = np.stack((a, c, d), axis=-1).reshape(-1, 3)
    return np.concatenate((first, second))


def _box(size: tuple[float, ...]) -> Surface:
    vertices: list[Array] = []
    normals: list[Array] = []
    faces: list[tuple[int, int, int]] = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for sign in (1.0, -1.0):
            start = len(vertices)
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                corner = np.zeros(3)
                corner[axis], corner[u], corner[v] = sign, a * sign, b
                vertices.append(corner * np.array(size[:3]))
                normals.append(np.eye(3)[axis] * sign)
            faces += [(start, start + 1, start + 2), (start, start + 2, start + 3)]
    return Surface(np.array(vertices), np.array(normals), np.array(faces))


@lru_cache(maxsize=1)
def _unit_sphere() -> Surface:
    rows = _AROUND // 2 + 1
    vertices = _turned(np.linspace(0.0, np.pi, rows))
    return Surface(vertices, vertices, _grid_faces(rows, _AROUND + 1))


def _turned(polar: Array, segments: int = _AROUND) -> Array:
    """Points of the unit sphere: a row all around for each angle from the pole."""
    around = np.linspace(0.0, 2 * np.pi, segments + 1)
    t, p = np.meshgrid(polar, around, indexing="ij")
    xyz = np.stack((np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)), axis=-1)
    return xyz.reshape(-1, 3)


def _capsule(radius: float, half: float) -> Surface:
    rows = _AROUND // 4 + 1
    upper = np.linspace(0.0, np.pi / 2, rows)
    normals = _turned(np.concatenate((upper, np.pi - upper[::-1])))
    vertices = normals * radius
    vertices[:, 2] += np.repeat((half, -half), rows * (_AROUND + 1))
    return Surface(vertices, normals, _grid_faces(2 * rows, _AROUND + 1))


def _cylinder(radius: float, half: float) -> Surface:
    around = np.linspace(0.0, 2 * np.pi, _AROUND + 1)
    ring = np.column_stack((np.cos(around), np.sin(around), np.zeros(_AROUND + 1)))
    n = _AROUND + 1
    up = np.array((0.0, 0.0, 1.0))
    low, high = ring * radius - half * up, ring * radius + half * up
    side = np.concatenate((low, high))
    i = np.arange(_AROUND)
    faces = [
        np.column_stack((i, i + 1, n + i + 1)),
        np.column_stack((i, n + i + 1, n + i)),
        np.column_stack((np.full(_AROUND, 3 * n), 2 * n + i, 2 * n + i + 1)),
        np.column_stack((np.full(_AROUND, 4 * n + 1), 3 * n + 1 + i + 1, 3 * n + 1 + i)),
    ]
    vertices = np.concatenate((side, high, [half * up], low, [-half * up]))
    normals = np.concatenate((ring, ring, np.tile(up, (n + 1, 1)), np.tile(-up, (n + 1, 1))))
    return Surface(vertices, normals, np.concatenate(faces))
