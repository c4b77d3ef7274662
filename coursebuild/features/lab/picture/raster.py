"""Rasterizes triangles: finds the nearest surface at each sample, and its attributes there.

Texture coordinates match the live view (`geometry.js` and `materials.js` of the page), but are
computed at every point that is drawn.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from coursebuild.features.lab.picture.shapes import Array, Kind, Surface

FAR_AWAY = 1e12
"""m; vertices beyond, or not finite, are not drawn: a diverged simulation throws things out."""
_AT_ONCE = 1 << 18
"""Samples that are processed together, unless a single triangle has more."""
_FACES_AT_ONCE = 1 << 16
"""Triangles that are processed together: hundreds of bodies have a million, of 264 bytes each."""
POSITION, NORMAL, UV, _ATTRIBUTES = slice(0, 3), slice(3, 6), slice(6, 8), 8
"""Columns of the attributes of a surface at a sample, in the solid's own frame."""


class Eye(Struct, frozen=True):
    """A point of view: a camera, or its image in a mirror."""

    size: tuple[int, int]
    """Width and height of the screen, samples."""
    focal: float
    """Distance of the screen, samples."""
    near: float
    """m; nothing nearer is visible."""
    position: Array
    axes: Array
    """Rows: to the right, up and into the picture."""
    mirror: tuple[Array, float] | None = None
    """Normal and offset of the mirror, behind which nothing is visible."""


class GBuffer:
    """The nearest surface of each sample."""

    def __init__(self, eye: Eye) -> None:
        width, height = eye.size
        self.eye = eye
        self.depth = np.full((height, width), np.inf)
        self.solid = np.full((height, width), -1, np.int32)
        self.attributes = np.zeros((height, width, _ATTRIBUTES), np.float32)

    def add(
        self, index: int, surface: Surface, position: Array, rotation: Array, *, front: bool
    ) -> None:
        """Draw a surface at a place in the world; `front`: only triangles seen from outside."""
        eye = self.eye
        with np.errstate(over="ignore", invalid="ignore"):
            world = rotate(surface.vertices, rotation) + position
            in_view = rotate(world - eye.position, eye.axes)
        uv = np.zeros((len(in_view), 2)) if surface.uv is None else surface.uv
        # One row for each vertex: its place in the camera's frame, and its attributes.
        vertices = np.column_stack((in_view, surface.vertices, surface.normals, uv))
        for triangles, indices, shares, x, y in fragments(
            eye, vertices, surface.faces, front=front
        ):
            # What is linear on the surface is linear in 1/z on the screen.
            weights = shares / triangles[:, :, 2][indices]
            depth = 1.0 / (weights[:, 0] + weights[:, 1] + weights[:, 2])
            nearest = np.flatnonzero(depth < self.depth[y, x])
            weights, depth, x, y = weights[nearest], depth[nearest], x[nearest], y[nearest]
            corners = triangles[:, :, 3:][indices[nearest]]
            attributes = np.einsum("sk,skc->sc", weights, corners) * depth[:, None]
            if eye.mirror is not None:
                normal, offset = eye.mirror
                height = attributes[:, POSITION] @ (rotation.T @ normal) + position @ normal
                front_side = height > offset
                depth, attributes = depth[front_side], attributes[front_side]
                x, y = x[front_side], y[front_side]
            # The nearest is written last, and so it stays.
            order = np.argsort(-depth, kind="stable")
            at = y[order], x[order]
            self.depth[at] = depth[order]
            self.solid[at] = index
            self.attributes[at] = attributes[order]


Fragments: TypeAlias = Iterator[
    tuple[Array, NDArray[np.int64], Array, NDArray[np.int64], NDArray[np.int64]]
]
"""Triangles (t, 3, columns), and the samples that they cover: of each the index of its triangle,
the shares of the triangle's corners in it (n, 3), its column and its row."""


def fragments(eye: Eye, vertices: Array, faces: NDArray[np.int64], *, front: bool) -> Fragments:
    """Yield the samples that faces cover; the first columns of `vertices` are places in view.

    A sample on the edge between two triangles belongs to only one of them: otherwise a transparent
    surface would have seams.
    """
    width, height = eye.size
    is_finite = np.all(np.abs(np.nan_to_num(vertices, nan=np.inf)) < FAR_AWAY, axis=1)
    faces = faces[np.all(is_finite[faces], axis=1)]
    for first_face in range(0, len(faces), _FACES_AT_ONCE):
        triangles = vertices[faces[first_face : first_face + _FACES_AT_ONCE]]
        if front:
            a, b, c = triangles[..., :3].transpose(1, 0, 2)
            volume = np.einsum("ij,ij->i", a, np.cross(b, c))
            triangles = triangles[volume * np.linalg.det(eye.axes) < 0]
        triangles = _clip(triangles, eye.near)
        scale = eye.focal / triangles[..., 2]
        px = width / 2 + scale * triangles[..., 0]
        py = height / 2 - scale * triangles[..., 1]
        top, bottom = _first(py.min(axis=1), height), _first(py.max(axis=1), height)
        columns = _first(px.max(axis=1), width) - _first(px.min(axis=1), width)
        most_samples = np.cumsum((bottom - top) * np.maximum(columns, 0))
        start = 0
        while start < len(triangles):
            offset = most_samples[start - 1] if start else 0
            end = int(np.searchsorted(most_samples, offset + _AT_ONCE, side="right"))
            part = slice(start, max(end, start + 1))
            yield triangles[part], *_samples(px[part], py[part], top[part], bottom[part], width)
            start = part.stop


def _clip(triangles: Array, near: float) -> Array:
    """Cut triangles (n, 3, columns) at the near plane, and return the parts beyond it."""
    hidden_corners = (triangles[..., 2] <= near).sum(axis=1)
    parts = [triangles[hidden_corners == 0]]
    for triangle in triangles[(hidden_corners > 0) & (hidden_corners < 3)]:
        polygon = []
        for first, second in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
            a, b = first[2] - near, second[2] - near
            if a > 0:
                polygon.append(first)
            if (a > 0) != (b > 0):
                polygon.append(first + (second - first) * (a / (a - b)))
        parts += [
            np.array([[polygon[0], polygon[k], polygon[k + 1]]]) for k in range(1, len(polygon) - 1)
        ]
    return np.concatenate(parts)


def _samples(
    px: Array, py: Array, top: NDArray[np.int64], bottom: NDArray[np.int64], width: int
) -> tuple[NDArray[np.int64], Array, NDArray[np.int64], NDArray[np.int64]]:
    """The samples of triangles with these corners (t, 3) on the screen, in these rows."""
    triangle, row = _count_up(top, bottom)
    left, right = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    middle = row + 0.5
    for a, b in ((0, 1), (1, 2), (2, 0)):
        # Both triangles at an edge follow it downwards, and so get the same places.
        is_down = py[:, a] <= py[:, b]
        xa, ya = (np.where(is_down, p[:, a], p[:, b])[triangle] for p in (px, py))
        xb, yb = (np.where(is_down, p[:, b], p[:, a])[triangle] for p in (px, py))
        is_crossed = (ya <= middle) & (middle < yb)
        place = xa + (middle - ya) * ((xb - xa) / np.where(is_crossed, yb - ya, 1.0))
        left = np.where(is_crossed, np.minimum(left, place), left)
        right = np.where(is_crossed, np.maximum(right, place), right)
    line, column = _count_up(_first(left, width), _first(right, width))
    indices = triangle[line]
    # The shares are linear along a row.
    (x0, x1, x2), (y0, y1, y2) = px.T, py.T
    area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    area = np.where(area == 0, 1.0, area)
    shares = np.empty((len(column), 3))
    x = column + 0.5
    for k, (xa, ya, xb, yb) in enumerate(((x1, y1, x2, y2), (x2, y2, x0, y0))):
        slope, rise = (ya - yb) / area, (xb - xa) / area
        at_zero = (rise[triangle] * (middle - ya[triangle])) - slope[triangle] * xa[triangle]
        shares[:, k] = at_zero[line] + slope[indices] * x
    shares[:, 2] = 1 - shares[:, 0] - shares[:, 1]
    return indices, shares, column, row[line]


def _first(places: Array, size: int) -> NDArray[np.int64]:
    """The first samples of a row or column whose middles are at places or beyond."""
    return np.clip(np.ceil(places - 0.5), 0, size).astype(np.int64)


def _count_up(
    first: NDArray[np.int64], end: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """All whole numbers from each first one to before its end, with the index of these two."""
    counts = np.maximum(end - first, 0)
    index = np.repeat(np.arange(len(counts)), counts)
    starts = first - (np.cumsum(counts) - counts)
    return index, np.arange(len(index)) + starts[index]


def rotate(vectors: Array, matrix: Array) -> Array:
    """Multiply vectors by a matrix, without a linear algebra library, whose bits may vary."""
    products: Array = np.einsum("ij,kj->ik", vectors, matrix)
    return products


_CUBE, SKY = 1, 2
"""mjtTexture."""
_LID = 0.9


class Texture(Struct, frozen=True):
    """A flat texture or a cube texture, with smaller copies of it."""

    levels: tuple[Array, ...]
    """(faces, height, width, 3) in [0, 1], from the finest on; each is half as large."""
    role: int
    """mjtTexture."""

    @property
    def cube(self) -> bool:
        """Whether a direction determines the texel."""
        return self.role in (_CUBE, SKY)


def texture_of(record: dict[str, Any]) -> Texture | None:
    """Make a texture from the record of a trial; `None` if it has no data."""
    if record["data"] is None:
        return None
    width, height, channels = record["width"], record["height"], record["channels"]
    pixels = np.asarray(record["data"], dtype=float).reshape(height, width, channels) / 255
    colour = pixels[..., :3] if channels >= 3 else np.repeat(pixels[..., :1], 3, axis=2)
    faces = colour[None]
    if record["type"] in (_CUBE, SKY):
        six = height == 6 * width
        faces = colour.reshape(6, width, width, 3) if six else np.repeat(faces, 6, axis=0)
    levels = [faces]
    while min(levels[-1].shape[1:3]) > 1:
        _, rows, columns, _ = levels[-1].shape
        even = levels[-1][:, : rows // 2 * 2, : columns // 2 * 2]
        levels.append(even.reshape(len(even), rows // 2, 2, columns // 2, 2, 3).mean(axis=(2, 4)))
    return Texture(tuple(levels), record["type"])


class TextureMapping(Struct, frozen=True):
    """How a texture lies on a geom."""

    texture: Texture
    kind: Kind
    size: tuple[float, float, float]
    """Half-lengths, m, of the box around the geom; of a capsule, radius, radius and half-length."""
    repeat: tuple[float, float]
    uniform: bool
    endless: bool = False
    has_uv: bool = False
    """Whether a file gives the texture coordinates of a mesh."""

    def texels(self, places: Array, normals: Array, uv: Array, steps: Array) -> Array:
        """Return the colours (n, 3) at places (n, 3) of the geom, m, in its own axes.

        `normals` have length 1; `uv` (n, 2) are texture coordinates from a file; `steps` (n,) are
        the lengths on the surface, m, between samples, longer where it is seen at an angle.
        """
        levels = self.texture.levels
        half = np.where(np.array(self.size) > 0, self.size, 1.0)
        if self.texture.cube:
            face, s, t = _cube(self._direction(places, half))
            texels = steps * levels[0].shape[2] / (2 * half.min())
        else:
            s, t = self._coordinates(places / half, places, normals, uv).T
            face = np.zeros(len(s), dtype=np.int64)
            period = np.array(self.repeat)
            scale = half[:2] if self.uniform or self.endless else np.ones(2)
            widths = np.abs(period * scale) * (levels[0].shape[2], levels[0].shape[1])
            texels = steps * float((widths / (2 * half[:2])).max())
        level = np.clip(np.rint(np.log2(np.maximum(texels, 1.0))), 0, len(levels) - 1)
        colours = np.empty((len(s), 3))
        for i in np.unique(level).astype(np.int64):
            at = level == i
            colours[at] = _interpolate(levels[i], face[at], s[at], t[at], self.texture.cube)
        return colours

    def _direction(self, places: Array, half: Array) -> Array:
        if self.uniform or self.kind in ("mesh", "sdf", "hfield"):
            return places
        unit = places / half
        if self.kind == "capsule":
            cap_height = np.abs(places[:, 2]) - half[2]
            cap = np.sign(places[:, 2]) * (1 + cap_height / half[0])
            unit[:, 2] = np.where(cap_height > 0, cap, unit[:, 2])
        return unit

    def _coordinates(self, unit: Array, places: Array, normals: Array, uv: Array) -> Array:
        repeat = np.array(self.repeat)
        coordinates: Array = uv * repeat
        if self.endless and not self.has_uv:
            coordinates = (1 + repeat * places[:, :2] * (1, -1)) / 2
        elif not self.has_uv:
            scale = self.size[:2] if self.uniform else 1.0
            coordinates = self._unrepeated_coordinates(unit, places, normals) * repeat * scale
        return coordinates

    def _unrepeated_coordinates(self, unit: Array, places: Array, normals: Array) -> Array:
        x, y, z = unit.T
        angle = np.mod(np.arctan2(y, x) / (2 * np.pi), 1.0)
        match self.kind:
            case "plane" | "hfield":
                u, v = (1 + x) / 2, (1 - y) / 2
            case "mesh" | "sdf":
                u, v = places[:, :2].T
            case "box":
                u = (1 + np.where(np.abs(normals[:, 0]) > 0.5, y, x)) / 2
                v = (1 - np.where(np.abs(normals[:, 2]) > 0.5, y, z)) / 2
            case "cylinder":
                lid = np.abs(normals[:, 2]) > _LID
                u, v = np.where(lid, (1 + x) / 2, angle), np.where(lid, (1 + y) / 2, (1 - z) / 2)
            case "capsule":
                cap_height = (np.abs(places[:, 2]) - self.size[2]) / max(self.size[0], 1e-12)
                rise = np.arcsin(np.clip(cap_height, 0.0, 1.0)) / (np.pi / 2)
                u, v = angle, np.where(z > 1, 1 - rise, np.where(z < -1, rise, (1 - z) / 2))
            case "sphere" | "ellipsoid":
                u, v = angle, np.arccos(np.clip(z, -1.0, 1.0)) / np.pi
        return np.column_stack((u, v))


def sky(texture: Texture, directions: Array) -> Array:
    """Return the colours (n, 3) of a sky in directions (n, 3) of the world."""
    x, y, z = directions.T
    face, s, t = _cube(np.column_stack((-x, z, -y)))
    return _interpolate(texture.levels[0], face, s, t, True)


def _cube(direction: Array) -> tuple[NDArray[np.int64], Array, Array]:
    """Return the face and the coordinates of a cube texture, as OpenGL defines them."""
    x, y, z = direction.T
    axis = np.abs(direction).argmax(axis=1)
    major = np.take_along_axis(direction, axis[:, None], axis=1)[:, 0]
    positive = major >= 0
    sign = np.where(positive, 1.0, -1.0)
    rightward = np.choose(axis, (-sign * z, x, sign * x))
    downward = np.choose(axis, (-y, sign * z, -y))
    length = np.where(major == 0, 1.0, np.abs(major))
    return 2 * axis + ~positive, (rightward / length + 1) / 2, (downward / length + 1) / 2


def _interpolate(level: Array, face: NDArray[np.int64], s: Array, t: Array, cube: bool) -> Array:
    _, height, width, _ = level.shape
    x, y = s * width - 0.5, t * height - 0.5
    left, top = np.floor(x), np.floor(y)
    fx, fy = (x - left)[:, None], (y - top)[:, None]

    def texel(dx: int, dy: int) -> Array:
        column, row = left.astype(np.int64) + dx, top.astype(np.int64) + dy
        if cube:  # its faces do not repeat
            column, row = np.clip(column, 0, width - 1), np.clip(row, 0, height - 1)
        texels: Array = level[face, row % height, column % width]
        return texels

    upper = texel(0, 0) * (1 - fx) + texel(1, 0) * fx
    lower = texel(0, 1) * (1 - fx) + texel(1, 1) * fx
    colours: Array = upper * (1 - fy) + lower * fy
    return colours
