"""What a static picture of a lab shows, from what its trial recorded.

Entry point: `scene_solids(scene, frame)`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from msgspec import Struct

from coursebuild.labs.light import Material, material_of
from coursebuild.labs.picture import Solid
from coursebuild.labs.shapes import (
    Array,
    Kind,
    Surface,
    joined,
    mesh_surface,
    ropes,
    sharpened,
    smooth_surface,
    surface,
)
from coursebuild.labs.textures import Dress, Texture, texture_of

RGBA = tuple[float, float, float, float]

_KINDS: dict[int, Kind] = {
    0: "plane",
    1: "hfield",
    2: "sphere",
    3: "capsule",
    4: "ellipsoid",
    5: "cylinder",
    6: "box",
    7: "mesh",
    8: "sdf",
}
"""mjtGeom."""
_LONG = (3, 5)
"""Capsules and cylinders."""
_MESHES = (7, 8)
_ARROWS = (100, 101, 102)
_SKY = 2
"""mjtTexture."""
_VISIBLE = (0, 1, 2)
"""Groups that MuJoCo shows by itself."""
_GEOM, _DECORATION = 19, 24
"""Floats of a geom and of a decoration in a frame."""
_ENDLESS = 40.0
"""Extents of the model to which a plane without a size reaches, as in the live view."""
_UNSET = (0.5, 0.5, 0.5, 1.0)
"""A flex or skin of this colour has its material's."""


class _Stock(Struct, frozen=True):
    """What geoms share."""

    meshes: tuple[Surface, ...]
    fields: tuple[Surface, ...]
    textures: tuple[Texture | None, ...]
    target: Array
    """(3,), m: what the camera looks at."""
    far: float
    """m."""


class _Looks(Struct, frozen=True):
    material: Material
    texture: Texture | None = None
    repeat: tuple[float, float] = (1.0, 1.0)
    uniform: bool = False


def scene_solids(scene: dict[str, Any], frame: Array) -> Iterator[Solid]:
    """What a picture of a frame shows: geoms, sites, and what MuJoCo's visualizer adds."""
    frame = np.asarray(frame, dtype=float)
    layout = scene["layout"]
    stock = _Stock(
        tuple(_mesh(mesh) for mesh in scene["meshes"]),
        tuple(_height_field(field) for field in scene["hfields"]),
        tuple(texture_of(texture) for texture in scene["textures"]),
        np.array(scene["camera"]["target"], dtype=float),
        _ENDLESS * scene["extent"],
    )
    for part, start in (("geoms", layout["geoms"]), ("sites", layout["sites"])):
        for i, item in enumerate(scene[part]):
            if item["group"] not in _VISIBLE:
                continue
            row = frame[start + _GEOM * i : start + _GEOM * (i + 1)]
            looks = _looks(scene, stock, item["material"])
            if solid := _solid(item["type"], item.get("data", -1), row, stock, looks):
                yield solid
    yield from _soft(scene, frame, stock)
    start = layout["trail"] + 3 * int(frame[2])
    for i in range(int(frame[1])):
        row = frame[start + _DECORATION * i : start + _DECORATION * (i + 1)]
        if solid := _decoration(row, stock):
            yield solid


def _looks(scene: dict[str, Any], stock: _Stock, index: int) -> _Looks:
    material = material_of(scene, index)
    if index < 0:
        return _Looks(material)
    given = scene["materials"][index]
    texture = stock.textures[given["texture"]] if given["texture"] >= 0 else None
    if texture is None or texture.role == _SKY:
        return _Looks(material)
    u, v = given["texrepeat"]
    return _Looks(material, texture, (u, v), given["texuniform"])


def _decoration(row: Array, stock: _Stock) -> Solid | None:
    kind, data = int(row[0]), int(row[1])
    size = row[4:7]
    if kind in _LONG:  # the visualizer's have their half-length last
        size = size[[0, 2, 2]]
    placed = np.concatenate((row[7:10], row[10:19], size, row[19:23]))
    # The visualizer counts a mesh and its hull: both have the mesh's shape here.
    data = data // 2 if kind in _MESHES else data
    return _solid(kind, data, placed, stock, _Looks(Material(emission=float(row[23]))))


def _solid(kind: int, data: int, row: Array, stock: _Stock, looks: _Looks) -> Solid | None:
    if not np.isfinite(row[:15]).all():
        return None  # the simulation blew up
    position, rotation = row[:3], row[3:12].reshape(3, 3)
    size = (float(row[12]), float(row[13]), float(row[14]))
    red, green, blue, alpha = (float(x) for x in row[15:19])
    rgba: RGBA = (red, green, blue, alpha)
    if kind in _ARROWS:
        shape = surface("cylinder", (size[0], size[2] / 2))
        assert shape is not None
        position = position + rotation[:, 2] * size[2] / 2
        return Solid(shape, position, rotation, rgba, looks.material)
    if kind not in _KINDS:
        return None
    name = _KINDS[kind]
    endless = name == "plane" and min(size[:2]) <= 0
    shape = _unrolled(row, stock) if endless else surface(name, size, _given(name, data, stock))
    if shape is None:
        return None
    dress = _dress(name, size, looks, endless=endless, given=shape.uv is not None)
    face = {"plane": 0.0, "box": size[2]}.get(name)
    return Solid(
        shape, position, rotation, rgba, looks.material, dress, plane=name == "plane", mirror=face
    )


def _given(name: Kind, data: int, stock: _Stock) -> Surface | None:
    """The surface of a mesh or a height field."""
    shapes = stock.fields if name == "hfield" else stock.meshes
    return shapes[data] if 0 <= data < len(shapes) else None


def _unrolled(row: Array, stock: _Stock) -> Surface | None:
    """A plane without a size, around what the camera looks at."""
    size = [float(half) if half > 0 else stock.far for half in row[12:14]]
    shape = surface("plane", (*size, 0.0))
    assert shape is not None
    there = (stock.target - row[:3]) @ row[3:12].reshape(3, 3)
    middle = np.where(row[12:14] > 0, 0.0, there[:2])
    return Surface(shape.vertices + np.append(middle, 0.0), shape.normals, shape.faces)


def _dress(
    kind: Kind, size: tuple[float, float, float], looks: _Looks, *, endless: bool, given: bool
) -> Dress | None:
    if looks.texture is None:
        return None
    if kind == "sphere":
        size = (size[0],) * 3
    elif kind in ("capsule", "cylinder"):
        size = (size[0], size[0], size[1])
    return Dress(looks.texture, kind, size, looks.repeat, looks.uniform, endless, given)


def _soft(scene: dict[str, Any], frame: Array, stock: _Stock) -> Iterator[Solid]:
    """Flexes and skins: their vertices are in the frame, in the world."""
    for part, floats in (("flexes", 3), ("skins", 6)):
        begin = scene["layout"]["flex" if part == "flexes" else "skin"]
        for item in scene[part]:
            first = begin + floats * item["start"]
            rows = frame[first : first + floats * item["count"]].reshape(-1, floats)
            if item["group"] not in _VISIBLE or not np.isfinite(rows).all():
                continue
            shape = _flex(item, rows) if part == "flexes" else _skin(item, rows)
            looks = _looks(scene, stock, item["material"])
            dress = None
            if shape.uv is not None:
                dress = _dress("mesh", (1.0, 1.0, 1.0), looks, endless=False, given=True)
            where = np.zeros(3), np.eye(3)
            yield Solid(shape, *where, _colour(scene, item), looks.material, dress, open=True)


def _flex(item: dict[str, Any], points: Array) -> Surface:
    elements = np.asarray(item["elements"], dtype=np.int64)
    if item["dim"] == 1:
        return ropes(points, elements.reshape(-1, 2), item["radius"])
    faces = elements.reshape(-1, 3)
    return mesh_surface(points, faces) if item["flat"] else smooth_surface(points, faces)


def _skin(item: dict[str, Any], rows: Array) -> Surface:
    uv = item["texcoords"]
    faces = np.asarray(item["faces"], dtype=np.int64).reshape(-1, 3)
    given = None if uv is None else np.asarray(uv, dtype=float).reshape(-1, 2)
    return Surface(rows[:, :3], rows[:, 3:], faces, given)


def _colour(scene: dict[str, Any], item: dict[str, Any]) -> RGBA:
    rgba = item["rgba"]
    if item["material"] >= 0 and tuple(rgba) == _UNSET:
        rgba = scene["materials"][item["material"]]["rgba"]
    red, green, blue, alpha = (float(x) for x in rgba)
    return red, green, blue, alpha


def _mesh(mesh: dict[str, Any]) -> Surface:
    """A mesh with the normals of its file, smooth as the live view has them."""

    def taken(values: str, which: str, width: int) -> Array:
        rows = np.asarray(mesh[values], dtype=float).reshape(-1, width)
        found: Array = rows[np.asarray(mesh[which], dtype=np.int64)]
        return found

    corners = taken("vertices", "faces", 3).reshape(-1, 3, 3)
    normals = sharpened(corners, taken("normals", "faceNormals", 3).reshape(-1, 3, 3))
    uv = None if mesh["texcoords"] is None else taken("texcoords", "faceTexcoords", 2)
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    return Surface(corners.reshape(-1, 3), normals.reshape(-1, 3), faces, uv)


def _height_field(field: dict[str, Any]) -> Surface:
    """A height field: its surface, and its four sides down to its floor."""
    rows, columns = field["rows"], field["columns"]
    half_x, half_y, top, base = field["size"]
    x, y = np.linspace(-half_x, half_x, columns), np.linspace(-half_y, half_y, rows)
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    heights = np.asarray(field["data"], dtype=float) * top
    vertices = np.column_stack((grid, heights))
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    first = np.stack((a, b, c), axis=-1).reshape(-1, 3)
    second = np.stack((a, c, d), axis=-1).reshape(-1, 3)
    parts = [smooth_surface(vertices, np.concatenate((first, second)))]
    for edge in (index[0], index[:, -1], index[-1, ::-1], index[::-1, 0]):
        upper = vertices[edge]
        lower = np.column_stack((upper[:, :2], np.full(len(edge), -base)))
        low, high = np.arange(len(edge)), np.arange(len(edge)) + len(edge)
        faces = np.concatenate(
            (
                np.column_stack((low[:-1], low[1:], high[1:])),
                np.column_stack((low[:-1], high[1:], high[:-1])),
            )
        )
        parts.append(mesh_surface(np.concatenate((lower, upper)), faces))
    return joined(parts)
