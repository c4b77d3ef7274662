"""Textures of a lab's static picture.

Entry points: `texture_of(record)`, from the record of a trial; `TextureMapping.texels`, `sky`.

Texture coordinates are those of the live view (`geometry.js` and `materials.js` of the page), but
computed at every point that is drawn.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from coursebuild.features.lab.picture.shapes import Array, Kind

_CUBE, SKY = 1, 2
"""mjtTexture."""
_SHARPER = 4.0
"""How much longer than wide a sample may be on a surface before the texture is blurred."""
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
        """Return the directions in which a cube texture is looked up."""
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
        coordinates: Array
        if self.has_uv:
            coordinates = uv * repeat
        elif self.endless:
            coordinates = (1 + repeat * places[:, :2] * (1, -1)) / 2
        else:
            scale = self.size[:2] if self.uniform else 1.0
            coordinates = self._unrepeated_coordinates(unit, places, normals) * repeat * scale
        return coordinates

    def _unrepeated_coordinates(self, unit: Array, places: Array, normals: Array) -> Array:
        """Return the coordinates of a texture that covers the geom once."""
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


def sharpness(cosines: Array) -> Array:
    """Return by how much to blur a surface that is seen at an angle, given the cosines."""
    longer = 1 / np.maximum(np.abs(cosines), 1e-3)
    return np.maximum(longer / _SHARPER, 1.0)


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
    """Interpolate the colours at coordinates between the texels of a level."""
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
