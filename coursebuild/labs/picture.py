"""A picture of a scene, drawn without a graphics processor.

Entry points: `draw(solids, camera, size)` → pixels, `png(pixels)` → bytes.

1. Every solid's triangles are taken into the camera's frame (MuJoCo's free camera) and projected.
2. A depth buffer keeps the nearest surface of each sample; there are 2 × 2 samples a pixel.
3. Light comes from the camera and from above, as in MuJoCo's own default scene. What is seen
   through is mixed in afterwards, the farthest first.

The same input gives the same bytes: no clock, no threads, colours rounded at the end.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coursebuild.labs.shapes import Array, Surface

_SAMPLES = 2
_NEAR = 0.01
"""What is nearer to the camera than this part of its distance is not drawn."""
_AMBIENT, _FRONT, _ABOVE = 0.3, 0.4, 0.3
"""Brightness of light from all sides, from the camera, and from above: white stays white."""
_FAR_AWAY = 1e12
"""m; what is beyond, or nowhere, is not drawn."""
_AT_ONCE = 1 << 20
"""Samples that are looked at together."""


@dataclass(frozen=True, slots=True)
class Solid:
    """A surface, where it stands and its colour."""

    surface: Surface
    position: Array
    """(3,), m, world."""
    rotation: Array
    """(3, 3); columns are the solid's axes in the world."""
    rgba: tuple[float, float, float, float]
    checker: float = 0.0
    """Width (m) of the squares of a plane's pattern; 0: plain."""


@dataclass(frozen=True, slots=True)
class Camera:
    """MuJoCo's free camera."""

    azimuth: float
    """Degrees, about z."""
    elevation: float
    """Degrees; negative looks down."""
    distance: float
    """m, to the target."""
    target: tuple[float, float, float]
    """m, world."""
    fovy: float = 45.0
    """Vertical field of view, degrees."""


def draw(solids: Sequence[Solid], camera: Camera, size: tuple[int, int]) -> NDArray[np.uint8]:
    """The picture: (height, width, 4) bytes, RGBA, clear where there is nothing.

    `size` is (width, height) in pixels.
    """
    width, height = size[0] * _SAMPLES, size[1] * _SAMPLES
    canvas = _Canvas(width, height, camera)
    opaque = [solid for solid in solids if solid.rgba[3] >= 0.999]
    through = [solid for solid in solids if 0.001 < solid.rgba[3] < 0.999]
    for solid in opaque:
        canvas.add(solid)
    for solid in sorted(through, key=lambda s: -canvas.depth_of(s)):
        canvas.add(solid)
    mean = canvas.colour.reshape(size[1], _SAMPLES, size[0], _SAMPLES, 4).mean(axis=(1, 3))
    # Colours were weighted with how much they cover.
    mean[..., :3] /= np.where(mean[..., 3:] > 0, mean[..., 3:], 1.0)
    pixels: NDArray[np.uint8] = np.clip(np.rint(255 * mean), 0, 255).astype(np.uint8)
    return pixels


class _Canvas:
    """Colours and depths of the samples."""

    def __init__(self, width: int, height: int, camera: Camera) -> None:
        self.colour = np.zeros((height, width, 4))
        """RGB times how much is covered, and how much is covered."""
        self.depth = np.full((height, width), np.inf)
        self.width, self.height = width, height
        self.camera = camera
        azimuth, elevation = np.radians(camera.azimuth), np.radians(camera.elevation)
        forward = np.array(
            (
                np.cos(elevation) * np.cos(azimuth),
                np.cos(elevation) * np.sin(azimuth),
                np.sin(elevation),
            )
        )
        right = np.array((np.sin(azimuth), -np.cos(azimuth), 0.0))
        self.axes = np.stack((right, np.cross(right, forward), forward))
        self.eye = np.array(camera.target) - camera.distance * forward
        self.focal = height / 2 / np.tan(np.radians(camera.fovy) / 2)
        self.near = max(_NEAR * camera.distance, 1e-6)
        above = np.array((0.25, -0.35, 0.9))
        self.lights = ((-forward, _FRONT), (above / np.linalg.norm(above), _ABOVE))

    def depth_of(self, solid: Solid) -> float:
        depth = float(self.axes[2] @ (solid.position - self.eye))
        return depth if np.isfinite(depth) else 0.0

    def add(self, solid: Solid) -> None:
        with np.errstate(over="ignore", invalid="ignore"):
            world = _turned(solid.surface.vertices, solid.rotation) + solid.position
            normals = _turned(solid.surface.normals, solid.rotation)
            seen = _turned(world - self.eye, self.axes)
            shade = self._shade(world, normals)
        # One row a vertex: place in the camera's frame, brightness, place in the solid's own plane.
        rows = np.column_stack((seen, shade, solid.surface.vertices[:, :2]))
        faces = solid.surface.faces
        # A simulation that blew up has no picture of what it threw out of the world.
        known = np.all(np.abs(np.nan_to_num(rows, nan=np.inf)) < _FAR_AWAY, axis=1)
        faces = faces[np.all(known[faces], axis=1)]
        near = seen[:, 2][faces] > self.near
        whole = faces[np.all(near, axis=1)]
        if solid.rgba[3] >= 0.999:
            whole = self._small(solid, rows, whole)
        for face in whole:
            self._triangle(solid, rows[face])
        for face in faces[np.any(near, axis=1) & ~np.all(near, axis=1)]:
            part = self._clipped(rows[face])
            for k in range(1, len(part) - 1):
                self._triangle(solid, part[[0, k, k + 1]])

    def _small(self, solid: Solid, rows: Array, faces: NDArray[np.int64]) -> NDArray[np.int64]:
        """Draw all small triangles of an opaque solid at once; gives those that remain."""
        places = self._places(rows)
        corners = places[faces]
        low, high = np.floor(corners.min(axis=1)), np.floor(corners.max(axis=1))
        shown = np.all((high >= 0) & (low < (self.width, self.height)), axis=1)
        widest = (high - low).max(axis=1)
        below = 0
        for side in (6, 14, 30):
            batch = faces[shown & (widest >= below) & (widest < side)]
            for start in range(0, len(batch), _AT_ONCE // side**2):
                self._batch(solid, rows, places, batch[start : start + _AT_ONCE // side**2], side)
            below = side
        rest: NDArray[np.int64] = faces[shown & (widest >= below)]
        return rest

    def _batch(
        self, solid: Solid, rows: Array, places: Array, faces: NDArray[np.int64], side: int
    ) -> None:
        """Triangles that fit into squares of `side` samples."""
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
        # The nearest is written last, and so remains.
        order = np.argsort(-depth, kind="stable")
        order = order[depth[order] < self.depth[y[order], x[order]]]
        which, weights, depth, x, y = (
            which[order],
            weights[:, order],
            depth[order],
            x[order],
            y[order],
        )
        values = np.einsum("ks,skc->sc", weights, rows[faces[which], 3:]) * depth[:, None]
        self.colour[y, x] = self._painted(solid, values[:, 0], values[:, 1:])
        self.depth[y, x] = depth

    def _places(self, rows: Array) -> Array:
        """Where vertices are on the screen, in samples."""
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            x = self.width / 2 + self.focal * rows[:, 0] / rows[:, 2]
            y = self.height / 2 - self.focal * rows[:, 1] / rows[:, 2]
        return np.stack((x, y), axis=1)

    def _painted(self, solid: Solid, light: Array, place: Array) -> Array:
        """Colour and coverage of samples of this brightness, at these places of the solid."""
        if solid.checker > 0:
            squares = np.floor(place / solid.checker).sum(axis=-1)
            light = light * np.where(squares % 2 == 0, 1.0, 0.9)
        colour = np.clip(light[..., None] * np.array(solid.rgba[:3]), 0.0, 1.0)
        return np.concatenate((colour, np.ones((*light.shape, 1))), axis=-1)

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

    def _shade(self, world: Array, normals: Array) -> Array:
        """Brightness at each vertex; surfaces are lit from both sides."""
        view = self.eye - world
        facing = np.sign(np.einsum("ij,ij->i", normals, view))
        facing[facing == 0] = 1.0
        turned = normals * facing[:, None]
        light = np.full(len(world), _AMBIENT)
        for direction, strength in self.lights:
            light += strength * np.clip(np.einsum("ij,j->i", turned, direction), 0.0, None)
        return light

    def _triangle(self, solid: Solid, rows: Array) -> None:
        px, py = self._places(rows).T
        pz = rows[:, 2]
        left, right = max(int(px.min()), 0), min(int(px.max()) + 1, self.width - 1)
        top, bottom = max(int(py.min()), 0), min(int(py.max()) + 1, self.height - 1)
        if left > right or top > bottom:
            return
        gx: Array = np.arange(left, right + 1, dtype=np.float64) + 0.5
        gy: Array = np.arange(top, bottom + 1, dtype=np.float64)[:, None] + 0.5
        shares, inside = _cover(px, py, gx, gy)
        # What is linear on the surface is linear in 1/z on the screen.
        parts = shares / pz[:, None, None]
        depth = 1.0 / np.where(inside, parts.sum(axis=0), 1.0)
        window = (slice(top, bottom + 1), slice(left, right + 1))
        inside &= depth < self.depth[window]
        if not inside.any():
            return
        values = sum(part[..., None] * row for part, row in zip(parts, rows[:, 3:], strict=True))
        values = values * depth[..., None]
        colour = self._painted(solid, values[..., 0], values[..., 1:])
        alpha = solid.rgba[3]
        target = self.colour[window]
        if alpha >= 0.999:
            target[inside] = colour[inside]
            self.depth[window][inside] = depth[inside]
        else:
            target[inside] = alpha * colour[inside] + (1 - alpha) * target[inside]


def _turned(vectors: Array, matrix: Array) -> Array:
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


def png(pixels: NDArray[np.uint8]) -> bytes:
    """An RGBA picture as PNG, losslessly, with the same bytes each time."""
    height, width, _ = pixels.shape
    rows = pixels.astype(np.int16).reshape(height, width * 4)
    above = np.vstack((np.zeros((1, width * 4), np.int16), rows[:-1]))
    filtered = np.column_stack((np.full(height, 2, np.uint8), ((rows - above) & 255)))
    data = zlib.compress(filtered.astype(np.uint8).tobytes(), 9)
    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", data), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(name, body) for name, body in chunks)


def _chunk(name: bytes, body: bytes) -> bytes:
    checksum = zlib.crc32(name + body)
    return struct.pack(">I", len(body)) + name + body + struct.pack(">I", checksum)
