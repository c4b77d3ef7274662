"""Rasterizes triangles: finds the nearest surface at each sample, and its attributes there.

Floor and edges match the live view (`studio.js` of the page), and so do texture coordinates
(`geometry.js` and `materials.js`), but computed at every point that is drawn.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, TypeAlias

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from coursebuild.features.lab.picture.shapes import LAMP, Array, Kind, Surface, join_surfaces

_FAR_AWAY = 1e12
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
        for part, shares, x, y in _fragments(eye, vertices, surface.faces, front=front):
            # What is linear on the surface is linear in 1/z on the screen.
            weights = shares / part[..., 2]
            depth = 1.0 / weights.sum(axis=1)
            nearest = np.flatnonzero(depth < self.depth[y, x])
            weights, depth, x, y = weights[nearest], depth[nearest], x[nearest], y[nearest]
            attributes = np.einsum("sk,skc->sc", weights, part[nearest, :, 3:]) * depth[:, None]
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


Fragments: TypeAlias = Iterator[tuple[Array, Array, NDArray[np.int64], NDArray[np.int64]]]
"""Samples that triangles cover, each with its triangle, the shares of the triangle's corners in it,
its column and its row."""


def _fragments(eye: Eye, vertices: Array, faces: NDArray[np.int64], *, front: bool) -> Fragments:
    """Yield the samples that faces cover; the first columns of `vertices` are places in view."""
    is_finite = np.all(np.abs(np.nan_to_num(vertices, nan=np.inf)) < _FAR_AWAY, axis=1)
    faces = faces[np.all(is_finite[faces], axis=1)]
    for start in range(0, len(faces), _FACES_AT_ONCE):
        triangles = vertices[faces[start : start + _FACES_AT_ONCE]]
        if front:
            a, b, c = triangles[..., :3].transpose(1, 0, 2)
            volume = np.einsum("ij,ij->i", a, np.cross(b, c))
            triangles = triangles[volume * np.linalg.det(eye.axes) < 0]
        yield from _project(eye, _clip(triangles, eye.near))


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


def _project(eye: Eye, triangles: Array) -> Fragments:
    width, height = eye.size
    scale = eye.focal / triangles[..., 2]
    px = width / 2 + scale * triangles[..., 0]
    py = height / 2 - scale * triangles[..., 1]
    left, right = _span(px, width)
    top, bottom = _span(py, height)
    columns = right - left
    counts = np.maximum(columns, 0) * np.maximum(bottom - top, 0)
    ends = np.cumsum(counts)
    start = 0
    while start < len(counts):
        offset = ends[start - 1] if start else 0
        end = max(int(np.searchsorted(ends, offset + _AT_ONCE, side="right")), start + 1)
        index = np.repeat(np.arange(start, end), counts[start:end])
        place = np.arange(len(index)) - (ends - counts - offset)[index]
        x, y = left[index] + place % columns[index], top[index] + place // columns[index]
        shares, inside = _cover(px[index].T, py[index].T, x + 0.5, y + 0.5)
        yield triangles[index[inside]], shares.T[inside], x[inside], y[inside]
        start = end


def _span(places: Array, size: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the range of samples of a row or column whose middle triangles reach."""
    low = np.clip(np.ceil(places.min(axis=1) - 0.5), 0, size)
    high = np.clip(np.floor(places.max(axis=1) - 0.5) + 1, 0, size)
    return low.astype(np.int64), high.astype(np.int64)


def rotate(vectors: Array, matrix: Array) -> Array:
    """Multiply vectors by a matrix, without a linear algebra library, whose bits may vary."""
    products: Array = np.einsum("ij,kj->ik", vectors, matrix)
    return products


def _cover(px: Array, py: Array, gx: Array, gy: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return the shares of a triangle's three corners in samples, and whether these are inside.

    A sample on the edge between two triangles belongs to only one of them: otherwise a transparent
    surface would have seams.
    """
    area = (px[1] - px[0]) * (py[2] - py[0]) - (px[2] - px[0]) * (py[1] - py[0])
    turn = np.sign(area)
    inside = turn != 0
    shares = []
    for a, b in ((1, 2), (2, 0), (0, 1)):
        edge = turn * ((px[a] - gx) * (py[b] - gy) - (px[b] - gx) * (py[a] - gy))
        right, down = turn * (px[b] - px[a]), turn * (py[b] - py[a])
        owns_edge = (down > 0) | ((down == 0) & (right > 0))
        inside &= (edge > 0) | ((edge == 0) & owns_edge)
        shares.append(edge / np.where(turn == 0, 1.0, np.abs(area)))
    return np.stack(shares), inside


_CELLS, _REACH, _LIFT = 10, 2.2, 0.0005
_GREY, _EDGE_GREY = 0.5, 0.42
_SHADOW, _POINTS, _WIDTH = 0.32, 10, 0.08
_GOLDEN = np.pi * (3 - np.sqrt(5))
"""Points at multiples of this angle lie evenly on a disc."""
_EDGE_SAMPLES = 2
_DEPTH_TOLERANCE = 1e-3


class Floor(Struct, frozen=True):
    """A level floor."""

    height: float
    """m."""
    distance: float
    """Distance of the camera from its target, m."""
    target: tuple[float, float, float]

    def paint(self, colour: Array, buffer: GBuffer, bodies: Sequence[Surface]) -> None:
        """Mix it into colours (rows, columns, RGB and alpha) where nothing covers it."""
        eye, height = buffer.eye, self.height + self._lift / 2
        width, rows = eye.size
        x, y = np.meshgrid(np.arange(width) + 0.5 - width / 2, rows / 2 - np.arange(rows) - 0.5)
        sight = np.column_stack((x.ravel(), y.ravel(), np.full(x.size, eye.focal)))
        rays = rotate(sight, eye.axes.T).reshape(rows, width, 3)
        with np.errstate(divide="ignore", invalid="ignore"):
            far = (height - eye.position[2]) / rays[..., 2]
            place = eye.position[:2] + far[..., None] * rays[..., :2]
        depth = far * eye.focal
        visible = (
            (far > 0)
            & (depth < buffer.depth * (1 + _DEPTH_TOLERANCE))
            & np.isfinite(place).all(axis=2)
        )
        place = np.where(visible[..., None], place, 0.0)
        offset = np.linalg.norm((place - self.target[:2]) / (_REACH * self.distance), axis=2)
        fade = np.clip(1 - offset, 0, None) ** 2
        cell = round_length(0.8 * self.distance / _CELLS)
        line = np.maximum(0.55 * _lines(place / cell), _lines(place / (5 * cell)))
        _mix(colour, _GREY, visible * fade * (0.06 + 0.5 * line))
        if bodies:
            _mix(colour, 0.0, 1 - (1 - _SHADOW) ** self._shade(eye, bodies, buffer.depth))

    @property
    def _lift(self) -> float:
        return _LIFT * self.distance

    def _shade(self, eye: Eye, bodies: Sequence[Surface], depth: Array) -> Array:
        """Return the part of the light that does not reach each sample."""
        joined_surface = join_surfaces(bodies)
        height = self.height + self._lift
        elevation = joined_surface.vertices[:, 2:] - height
        shade = np.zeros_like(depth)
        for i in range(_POINTS):
            angle, radius = _GOLDEN * i, _WIDTH * np.sqrt((i + 0.5) / _POINTS)
            slope = radius * np.array((np.cos(angle), np.sin(angle))) + LAMP[:2]
            flat = joined_surface.vertices[:, :2] - elevation * slope / LAMP[2]
            vertices = np.column_stack((flat, np.full(len(flat), height)))
            with np.errstate(over="ignore", invalid="ignore"):
                in_view = rotate(vertices - eye.position, eye.axes)
            shadow = np.full_like(depth, np.inf)
            for part, shares, x, y in _fragments(eye, in_view, joined_surface.faces, front=False):
                np.minimum.at(shadow, (y, x), 1.0 / (shares / part[..., 2]).sum(axis=1))
            shade += shadow < depth * (1 + _DEPTH_TOLERANCE)
        return shade / _POINTS


def draw_edges(colour: Array, buffer: GBuffer, bodies: NDArray[np.bool_]) -> None:
    """Draw lines around bodies, on what is behind them; `bodies` says which solids are bodies."""
    edge = np.zeros(buffer.solid.shape, bool)
    body = np.where(buffer.solid >= 0, bodies[buffer.solid], False)
    reach = range(-_EDGE_SAMPLES, _EDGE_SAMPLES + 1)
    for dy, dx in ((dy, dx) for dy in reach for dx in reach if dx * dx + dy * dy <= 4):
        is_body = np.roll(body, (dy, dx), axis=(0, 1))
        differs = np.roll(buffer.solid, (dy, dx), axis=(0, 1)) != buffer.solid
        is_nearer = np.roll(buffer.depth, (dy, dx), axis=(0, 1)) < buffer.depth
        edge |= is_body & differs & is_nearer
    _mix(colour, _EDGE_GREY, edge.astype(float))


def round_length(length: float) -> float:
    """Round a length down to 1, 2 or 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(power * next(n for n in (5, 2, 1) if n * power <= length))


def _lines(place: Array) -> Array:
    """Return how strong the lines of a grid of cell size 1 are at places (rows, columns, 2)."""
    width = sum(np.abs(np.gradient(place, axis=axis)) for axis in (0, 1))
    width = np.maximum(width, 1e-6)
    distance = np.abs((place - 0.5) % 1 - 0.5) / width
    line = np.clip(1 - distance, 0, 1) * np.clip(0.5 / width - 0.5, 0, 1)
    strength: Array = line.max(axis=2)
    return strength


def _mix(colour: Array, grey: float, alpha: Array) -> None:
    cover = alpha[..., None]
    colour[:] = cover * np.array((grey, grey, grey, 1.0)) + (1 - cover) * colour


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
