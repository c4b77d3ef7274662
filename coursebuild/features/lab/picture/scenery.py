"""The solids of a lab's static picture, made from the record of its trial."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from msgspec.structs import replace

from coursebuild.features.lab.picture import shapes
from coursebuild.features.lab.picture.draw import Solid
from coursebuild.features.lab.picture.raster import SKY, TextureMapping, texture_of
from coursebuild.features.lab.picture.shapes import Array, Kind, Material, Surface

RGBA = tuple[float, float, float, float]

_KINDS: tuple[Kind, ...] = (
    *("plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf"),
)
"""Indexed by mjtGeom."""
_ARROWS = (100, 101, 102)
_HEAD_WIDTH = 1.75
"""Of an arrow's head, in widths of its shaft; arrows of the second kind have none."""
_IN_FRONT = -2
"""A data id that marks what nothing covers: see `arrows.js` of the live view."""
_VISIBLE = (0, 1, 2)
"""Groups that MuJoCo shows by default."""
_GEOM, _DECORATION = 19, 24
"""Numbers of a geom and of a decoration in a frame."""
_ENDLESS = 40.0
"""Extents of the model to which a plane without a size reaches, as in the live view."""
_UNSET = (0.5, 0.5, 0.5, 1.0)
"""A flex or skin of this colour takes its material's."""
_TURNS, _ROUND, _STRAIGHT, _WIRE = 9, 14, 0.08, 0.16
_STEEL, _IRON = (0.56, 0.58, 0.62, 1.0), (0.4, 0.41, 0.44, 1.0)
_PIN = 0.011
"""Sizes of springs and of the pins of hinges, as in `marks.js` of the live view."""


def scene_solids(scene: dict[str, Any], frame: Array) -> Iterator[Solid]:
    """Make the solids of a frame: geoms, sites, and what MuJoCo's visualizer adds."""
    return _Scene(scene, np.asarray(frame, dtype=float)).solids()


def ground_of(scene: dict[str, Any]) -> float | None:
    """Return the height of the floor with a grid, which replaces a plane without a colour."""
    height: float | None = None if scene["lights"] else scene["floor"]
    return height


class _Scene:
    def __init__(self, scene: dict[str, Any], frame: Array) -> None:
        self.scene, self.frame, self.layout = scene, frame, scene["layout"]
        self.meshes = [_mesh(mesh) for mesh in scene["meshes"]]
        self.fields = [_height_field(field) for field in scene["hfields"]]
        self.textures = [texture_of(texture) for texture in scene["textures"]]

    def solids(self) -> Iterator[Solid]:
        solids: list[Solid | None] = []
        ground = ground_of(self.scene)
        for part in ("geoms", "sites"):
            for i, item in enumerate(self.scene[part]):
                replaced = ground is not None and item.get("level") == ground
                if item["group"] in _VISIBLE and not replaced:
                    row = self._row(self.layout[part] + _GEOM * i, _GEOM)
                    material = shapes.material_of(self.scene, item["material"])
                    data, index = item.get("data", -1), item["material"]
                    solid = self._solid(item["type"], data, row, material, index)
                    if solid is not None and part == "geoms" and not solid.plane:
                        solid = replace(solid, body=True)
                    solids.append(solid)
        solids += self._soft_bodies()
        solids += self._marks()
        start = self.layout["trail"] + 3 * int(self.frame[2])
        for i in range(int(self.frame[1])):
            solids.append(self._decoration(self._row(start + _DECORATION * i, _DECORATION)))
        return (solid for solid in solids if solid is not None)

    def _marks(self) -> Iterator[Solid]:
        for spring in self.scene["springs"]:
            starts = (self.layout["geoms"] + _GEOM * spring[end] for end in ("from", "to"))
            a, b = (self._row(start, 3) for start in starts)
            if np.isfinite((a, b)).all() and np.any(a != b):
                yield _coil(a, b, spring["radius"])
        radius = _PIN * self.scene["camera"]["distance"]
        for hinge in self.scene["pins"]:
            position, half = np.array(hinge["position"]), 2.2 * radius * np.array(hinge["axis"])
            ends = np.stack((position - half, position + half))
            yield Solid(
                shapes.ropes(ends, np.array([[0, 1]]), radius), np.zeros(3), np.eye(3), _IRON
            )

    def _row(self, start: int, floats: int) -> Array:
        return self.frame[start : start + floats]

    def _texture(
        self,
        index: int,
        kind: Kind,
        size: tuple[float, float, float],
        *,
        endless: bool = False,
        has_uv: bool = False,
    ) -> TextureMapping | None:
        """Map the texture of a material to a geom; -1 is no material."""
        material: dict[str, Any] = self.scene["materials"][index] if index >= 0 else {"texture": -1}
        texture = self.textures[material["texture"]] if material["texture"] >= 0 else None
        if texture is None or texture.role == SKY:
            return None
        if kind == "sphere":
            size = (size[0],) * 3
        elif kind in ("capsule", "cylinder"):
            size = (size[0], size[0], size[1])
        u, v = material["texrepeat"]
        uniform = material["texuniform"]
        return TextureMapping(texture, kind, size, (u, v), uniform, endless, has_uv)

    def _decoration(self, row: Array) -> Solid | None:
        kind, data, size = int(row[0]), int(row[1]), row[4:7]
        name = _KINDS[kind] if kind < len(_KINDS) else ""
        if name in ("capsule", "cylinder"):  # the visualizer puts the half-length last
            size = size[[0, 2, 2]]
        if name in ("mesh", "sdf"):  # it counts meshes and their hulls, which look the same here
            data //= 2
        row = np.concatenate((row[7:19], size, row[19:24]))
        return self._solid(kind, data, row, Material(emission=float(row[-1])))

    def _solid(
        self, kind: int, data: int, row: Array, material: Material, index: int = -1
    ) -> Solid | None:
        """Make the solid of a geom; `index` is that of its material, which may have a texture."""
        if not np.isfinite(row[:15]).all():
            return None  # the simulation diverged
        position, rotation = row[:3], row[3:12].reshape(3, 3)
        size = (float(row[12]), float(row[13]), float(row[14]))
        rgba = _rgba(row[15:19])
        if kind in _ARROWS:
            head = 1.0 if kind == _ARROWS[1] else _HEAD_WIDTH
            pointer = shapes.arrow(size[0], size[2] / 2, head=head, double=kind == _ARROWS[2])
            front = data == _IN_FRONT
            return Solid(pointer, position, rotation, rgba, material, front=front)
        if kind >= len(_KINDS):
            return None
        name = _KINDS[kind]
        endless = name == "plane" and min(size[:2]) <= 0
        meshes = self.fields if name == "hfield" else self.meshes
        mesh = meshes[data] if 0 <= data < len(meshes) else None
        shape = self._endless_plane(row) if endless else shapes.surface(name, size, mesh)
        if shape is None:
            return None
        has_uv = shape.uv is not None
        texture = self._texture(index, name, size, endless=endless, has_uv=has_uv)
        mirror = {"plane": 0.0, "box": size[2]}.get(name)
        plane = name == "plane"
        return Solid(shape, position, rotation, rgba, material, texture, plane, mirror)

    def _endless_plane(self, row: Array) -> Surface:
        """Make a plane without a size, around the camera's target."""
        far = _ENDLESS * self.scene["extent"]
        half = np.where(row[12:14] > 0, row[12:14], far)
        shape = shapes.surface("plane", (float(half[0]), float(half[1])))
        assert shape is not None
        target = np.array(self.scene["camera"]["target"], dtype=float)
        local_target = (target - row[:3]) @ row[3:12].reshape(3, 3)
        middle = np.where(row[12:14] > 0, 0.0, local_target[:2])
        return Surface(shape.vertices + np.append(middle, 0.0), shape.normals, shape.faces)

    def _soft_bodies(self) -> Iterator[Solid]:
        """Make flexes and skins, whose vertices are in the frame, in world coordinates."""
        for part, start, floats in (("flexes", "flex", 3), ("skins", "skin", 6)):
            for item in self.scene[part]:
                first = self.layout[start] + floats * item["start"]
                rows = self._row(first, floats * item["count"]).reshape(-1, floats)
                if item["group"] not in _VISIBLE or not np.isfinite(rows).all():
                    continue
                indices = np.asarray(item["elements" if part == "flexes" else "faces"], np.int64)
                if part == "skins":
                    uv = item["texcoords"]
                    uv = None if uv is None else np.asarray(uv, dtype=float).reshape(-1, 2)
                    shape = Surface(rows[:, :3], rows[:, 3:], indices.reshape(-1, 3), uv)
                elif item["dim"] == 1:
                    shape = shapes.ropes(rows, indices.reshape(-1, 2), item["radius"])
                else:
                    surface = shapes.flat_surface if item["flat"] else shapes.smooth_surface
                    shape = surface(rows, indices.reshape(-1, 3))
                index, texture = item["material"], None
                if shape.uv is not None:
                    texture = self._texture(index, "mesh", (1.0, 1.0, 1.0), has_uv=True)
                pose = np.zeros(3), np.eye(3)
                rgba = item["rgba"]
                if index >= 0 and tuple(rgba) == _UNSET:
                    rgba = self.scene["materials"][index]["rgba"]
                material = shapes.material_of(self.scene, index)
                yield Solid(shape, *pose, _rgba(rgba), material, texture, open=True)


def _rgba(values: Any) -> RGBA:
    red, green, blue, alpha = (float(x) for x in values)
    return red, green, blue, alpha


def _mesh(mesh: dict[str, Any]) -> Surface:
    """Make the surface of a mesh with the normals of its file, smooth as in the live view."""

    def corner_rows(values: str, indices: str, width: int) -> Array:
        rows = np.asarray(mesh[values], dtype=float).reshape(-1, width)
        corners: Array = rows[np.asarray(mesh[indices], dtype=np.int64)]
        return corners

    corners = corner_rows("vertices", "faces", 3).reshape(-1, 3, 3)
    normals = shapes.sharpen(corners, corner_rows("normals", "faceNormals", 3).reshape(-1, 3, 3))
    uv = None if mesh["texcoords"] is None else corner_rows("texcoords", "faceTexcoords", 2)
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    return Surface(corners.reshape(-1, 3), normals.reshape(-1, 3), faces, uv)


def _height_field(field: dict[str, Any]) -> Surface:
    """Make a height field: its upper surface, and its four sides down to its base."""
    rows, columns = field["rows"], field["columns"]
    half_x, half_y, top, base = field["size"]
    x, y = np.linspace(-half_x, half_x, columns), np.linspace(-half_y, half_y, rows)
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    vertices = np.column_stack((grid, np.asarray(field["data"], dtype=float) * top))
    # Rows go up along y, so that seen from above the faces of the grid are clockwise.
    parts = [shapes.smooth_surface(vertices, shapes.grid_faces(rows, columns)[:, ::-1])]
    index = np.arange(rows * columns).reshape(rows, columns)
    for edge in (index[0], index[:, -1], index[-1, ::-1], index[::-1, 0]):
        upper = vertices[edge]
        lower = np.column_stack((upper[:, :2], np.full(len(edge), -base)))
        parts.append(
            shapes.flat_surface(np.concatenate((upper, lower)), shapes.grid_faces(2, len(edge)))
        )
    return shapes.join_surfaces(parts)


def _coil(a: Array, b: Array, radius: float) -> Solid:
    z = shapes.unit(b - a)
    x = shapes.unit(
        np.array((-z[1], z[0], 0.0)) if abs(z[2]) < 0.9 else np.array((0.0, -z[2], z[1]))
    )
    t = np.linspace(0.0, 1.0, _TURNS * _ROUND + 1)[:, None]
    coil_radius = radius * np.clip((np.minimum(t, 1 - t) - _STRAIGHT) / _STRAIGHT, 0.0, 1.0)
    angle = 2 * np.pi * _TURNS * t
    points = a + t * (b - a) + coil_radius * (np.cos(angle) * x + np.sin(angle) * np.cross(z, x))
    steps = np.arange(len(points))
    ends = np.column_stack((steps[:-1], steps[1:]))
    return Solid(shapes.ropes(points, ends, _WIRE * radius), np.zeros(3), np.eye(3), _STEEL)
