"""Triangles on a screen: which surface is nearest at each sample, and what of it is there.

Entry point: `Raster(size, eye, lens).add(layer, placed)`.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from coursebuild.labs.shapes import Array, Surface

_FAR_AWAY = 1e12
"""m; what is beyond, or nowhere, is not drawn."""
_AT_ONCE = 1 << 20
"""Samples that are looked at together."""
PLACE, NORMAL, WRAP, _KEPT = slice(0, 3), slice(3, 6), slice(6, 8), 8
"""What is kept of a surface at a sample, in the solid's own frame."""


class Eye(Struct, frozen=True):
    """Where a picture is seen from: a camera, or its image in a mirror."""

    position: Array
    axes: Array
    """Rows: to the right, up and into the picture."""
    floor: tuple[Array, float] | None = None
    """Normal and offset of the mirror, behind which nothing is seen."""


class Layer:
    """The nearest surface of each sample."""

    def __init__(self, depth: Array) -> None:
        self.depth = depth
        self.solid = np.full(depth.shape, -1, np.int32)
        self.kept = np.zeros((*depth.shape, _KEPT), np.float32)


class Placed(Struct, frozen=True):
    """A surface at its place in the world, and the number it has in a layer."""

    index: int
    surface: Surface
    position: Array
    """(3,), m."""
    rotation: Array
    """(3, 3)."""
    front: bool
    """Whether only triangles that show their outside are drawn."""


class Raster:
    """Draws triangles as an eye sees them."""

    def __init__(self, size: tuple[int, int], eye: Eye, lens: tuple[float, float]) -> None:
        """A screen of `size` = (width, height) samples for an eye.

        `lens`: the vertical field of view, degrees, and the distance, m, from which on it sees.
        """
        self.width, self.height = size
        self.eye = eye
        fovy, near = lens
        self.focal = self.height / 2 / np.tan(np.radians(fovy) / 2)
        self.near = max(near, 1e-6)

    def add(self, layer: Layer, solid: Placed) -> None:
        """Draw a surface into a layer."""
        surface = solid.surface
        with np.errstate(over="ignore", invalid="ignore"):
            world = turned(surface.vertices, solid.rotation) + solid.position
            seen = turned(world - self.eye.position, self.eye.axes)
        wrap = np.zeros((len(seen), 2)) if surface.uv is None else surface.uv
        # One row a vertex: place in the camera's frame, and what is kept.
        rows = np.column_stack((seen, surface.vertices, surface.normals, wrap))
        faces = surface.faces
        # A simulation that blew up has no picture of what it threw out of the world.
        known = np.all(np.abs(np.nan_to_num(rows, nan=np.inf)) < _FAR_AWAY, axis=1)
        faces = faces[np.all(known[faces], axis=1)]
        if solid.front:
            faces = self._front(seen, faces)
        near = seen[:, 2][faces] > self.near
        for face in self._small(layer, solid, rows, faces[np.all(near, axis=1)]):
            self._triangle(layer, solid, rows[face])
        for face in faces[np.any(near, axis=1) & ~np.all(near, axis=1)]:
            part = self._clipped(rows[face])
            for k in range(1, len(part) - 1):
                self._triangle(layer, solid, part[[0, k, k + 1]])

    def _front(self, seen: Array, faces: NDArray[np.int64]) -> NDArray[np.int64]:
        """The triangles that show their outside."""
        a, b, c = seen[faces].transpose(1, 0, 2)
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        found: NDArray[np.int64] = faces[volume * np.linalg.det(self.eye.axes) < 0]
        return found

    def _small(
        self, layer: Layer, solid: Placed, rows: Array, faces: NDArray[np.int64]
    ) -> NDArray[np.int64]:
        """Draw all small triangles at once; gives those that remain."""
        places = self._places(rows)
        corners = places[faces]
        low, high = np.floor(corners.min(axis=1)), np.floor(corners.max(axis=1))
        shown = np.all((high >= 0) & (low < (self.width, self.height)), axis=1)
        widest = (high - low).max(axis=1)
        below = 0
        for side in (6, 14, 30):
            batch = faces[shown & (widest >= below) & (widest < side)]
            most = _AT_ONCE // side**2
            for start in range(0, len(batch), most):
                self._batch(layer, solid, (rows, places), batch[start : start + most], side)
            below = side
        rest: NDArray[np.int64] = faces[shown & (widest >= below)]
        return rest

    def _batch(
        self,
        layer: Layer,
        solid: Placed,
        vertices: tuple[Array, Array],
        faces: NDArray[np.int64],
        side: int,
    ) -> None:
        """Triangles that fit into squares of `side` samples."""
        rows, places = vertices
        corners = places[faces]
        first = np.floor(corners.min(axis=1)).astype(np.int64)
        x = first[:, None, None, 0] + np.arange(side)[None, None, :]
        y = first[:, None, None, 1] + np.arange(side)[None, :, None]
        px, py = corners.transpose(2, 1, 0)[..., None, None]
        shares, inside = _cover(px, py, x + 0.5, y + 0.5)
        inside &= (x >= 0) & (x < self.width) & (y >= 0) & (y < self.height)
        which, i, j = np.nonzero(inside)
        weights = shares[:, which, i, j] / rows[faces[which], 2].T
        depth = 1.0 / weights.sum(axis=0)
        x, y = first[which, 0] + j, first[which, 1] + i
        near = np.flatnonzero(depth < layer.depth[y, x])
        values = np.einsum("ks,skc->sc", weights[:, near], rows[faces[which[near]], 3:])
        values *= depth[near, None]
        self._keep(layer, solid, (y[near], x[near]), depth[near], values)

    def _triangle(self, layer: Layer, solid: Placed, rows: Array) -> None:
        px, py = self._places(rows).T
        left, right = max(int(px.min()), 0), min(int(px.max()) + 1, self.width - 1)
        top, bottom = max(int(py.min()), 0), min(int(py.max()) + 1, self.height - 1)
        if left > right or top > bottom:
            return
        gx: Array = np.arange(left, right + 1, dtype=np.float64) + 0.5
        gy: Array = np.arange(top, bottom + 1, dtype=np.float64)[:, None] + 0.5
        shares, inside = _cover(px, py, gx, gy)
        i, j = np.nonzero(inside)
        # What is linear on the surface is linear in 1/z on the screen.
        weights = shares[:, i, j] / rows[:, 2, None]
        depth = 1.0 / weights.sum(axis=0)
        near = depth < layer.depth[top + i, left + j]
        values = np.einsum("ks,kc->sc", weights[:, near], rows[:, 3:]) * depth[near, None]
        self._keep(layer, solid, (top + i[near], left + j[near]), depth[near], values)

    def _keep(
        self,
        layer: Layer,
        solid: Placed,
        samples: tuple[NDArray[np.int64], NDArray[np.int64]],
        depth: Array,
        values: Array,
    ) -> None:
        """Write a solid into samples (rows, columns) where it is nearer than what is there."""
        order = np.arange(len(depth))
        if self.eye.floor is not None:
            normal, offset = self.eye.floor
            height = values[:, PLACE] @ (solid.rotation.T @ normal) + solid.position @ normal
            order = order[height > offset]
        # The nearest is written last, and so remains.
        order = order[np.argsort(-depth[order], kind="stable")]
        at = samples[0][order], samples[1][order]
        layer.depth[at] = depth[order]
        layer.solid[at] = solid.index
        layer.kept[at] = values[order]

    def _places(self, rows: Array) -> Array:
        """Where vertices are on the screen, in samples."""
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            x = self.width / 2 + self.focal * rows[:, 0] / rows[:, 2]
            y = self.height / 2 - self.focal * rows[:, 1] / rows[:, 2]
        return np.stack((x, y), axis=1)

    def _clipped(self, triangle: Array) -> Array:
        """The part of a triangle in front of the camera, as a polygon."""
        kept = []
        for here, there in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
            a, b = here[2] - self.near, there[2] - self.near
            if a > 0:
                kept.append(here)
            if (a > 0) != (b > 0):
                kept.append(here + (there - here) * (a / (a - b)))
        return np.array(kept)


def turned(vectors: Array, matrix: Array) -> Array:
    """Each vector times the matrix, without the threads and kernels of a linear algebra library."""
    found: Array = np.einsum("ij,kj->ik", vectors, matrix)
    return found


def _cover(px: Array, py: Array, gx: Array, gy: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Shares of a triangle's three corners in samples, and whether these are inside.

    A sample on the edge between two triangles belongs to one of them, or a transparent surface
    would have seams.
    """
    area = (px[1] - px[0]) * (py[2] - py[0]) - (px[2] - px[0]) * (py[1] - py[0])
    turn = np.sign(area)
    inside = np.broadcast_to(turn != 0, np.broadcast_shapes(gx.shape, gy.shape, area.shape)).copy()
    shares = []
    for a, b in ((1, 2), (2, 0), (0, 1)):
        edge = turn * ((px[a] - gx) * (py[b] - gy) - (px[b] - gx) * (py[a] - gy))
        right, down = turn * (px[b] - px[a]), turn * (py[b] - py[a])
        owned = (down > 0) | ((down == 0) & (right > 0))
        inside &= (edge > 0) | ((edge == 0) & owned)
        shares.append(edge / np.where(turn == 0, 1.0, np.abs(area)))
    return np.stack(shares), inside
