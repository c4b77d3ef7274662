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
        self.near = _NEAR * camera.distance
        above = np.array((0.25, -0.35, 0.9))
        self.lights = ((-forward, 0.45), (above / np.linalg.norm(above), 0.4))

    def depth_of(self, solid: Solid) -> float:
        return float(self.axes[2] @ (solid.position - self.eye))

    def add(self, solid: Solid) -> None:
        world = solid.surface.vertices @ solid.rotation.T + solid.position
        normals = solid.surface.normals @ solid.rotation.T
        seen = (world - self.eye) @ self.axes.T
        shade = self._shade(world, normals)
        # One row a vertex: place in the camera's frame, brightness, place in the solid's own plane.
        local = solid.surface.vertices[:, :2]
        rows = np.column_stack((seen, shade, local))
        faces = solid.surface.faces
        near = seen[:, 2][faces] > self.near
        for face in faces[np.all(near, axis=1)]:
            self._triangle(solid, rows[face])
        for face in faces[np.any(near, axis=1) & ~np.all(near, axis=1)]:
            part = self._clipped(rows[face])
            for k in range(1, len(part) - 1):
                self._triangle(solid, part[[0, k, k + 1]])

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
        light = np.full(len(world), 0.35)
        for direction, strength in self.lights:
            light += strength * np.clip(turned @ direction, 0.0, None)
        return light

    def _triangle(self, solid: Solid, rows: Array) -> None:
        pz = rows[:, 2]
        px = self.width / 2 + self.focal * rows[:, 0] / pz
        py = self.height / 2 - self.focal * rows[:, 1] / pz
        left, right = max(int(px.min()), 0), min(int(px.max()) + 1, self.width - 1)
        top, bottom = max(int(py.min()), 0), min(int(py.max()) + 1, self.height - 1)
        area = (px[1] - px[0]) * (py[2] - py[0]) - (px[2] - px[0]) * (py[1] - py[0])
        if left > right or top > bottom or area == 0:
            return
        gx = np.arange(left, right + 1) + 0.5
        gy = (np.arange(top, bottom + 1) + 0.5)[:, None]
        w0 = ((px[1] - gx) * (py[2] - gy) - (px[2] - gx) * (py[1] - gy)) / area
        w1 = ((px[2] - gx) * (py[0] - gy) - (px[0] - gx) * (py[2] - gy)) / area
        w2 = 1.0 - w0 - w1
        inside = (w0 >= 0) & (w1 >= 0) & (w2 >= 0)
        # What is linear on the surface is linear in 1/z on the screen.
        parts = np.stack((w0 / pz[0], w1 / pz[1], w2 / pz[2]))
        depth = 1.0 / np.where(inside, parts.sum(axis=0), 1.0)
        window = (slice(top, bottom + 1), slice(left, right + 1))
        inside &= depth < self.depth[window]
        if not inside.any():
            return
        light = np.tensordot(rows[:, 3], parts, 1) * depth
        if solid.checker > 0:
            squares = (
                np.floor(np.tensordot(rows[:, i], parts, 1) * depth / solid.checker) for i in (4, 5)
            )
            light = light * np.where(sum(squares) % 2 == 0, 1.0, 0.9)
        colour = np.clip(light[..., None] * np.array(solid.rgba[:3]), 0.0, 1.0)
        colour = np.concatenate((colour, np.ones((*light.shape, 1))), axis=-1)
        alpha = solid.rgba[3]
        target = self.colour[window]
        target[inside] = (alpha * colour + (1 - alpha) * target)[inside]
        if alpha >= 0.999:
            self.depth[window][inside] = depth[inside]


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
