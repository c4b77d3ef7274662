"""The static form of a lab: what its trial recorded, as a picture, plots and a table.

Entry points: `draw_picture(lab, main)`, `static_form(lab, main, picture)`,
`scene_solids(scene, frame)`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, cast

import numpy as np

from coursebuild.labs.picture import Camera, Solid, draw, png
from coursebuild.labs.plots import plot_svg
from coursebuild.labs.reply import unpacked
from coursebuild.labs.shapes import Array, Kind, Surface, mesh_surface, surface
from coursebuild.model import Lab
from coursebuild.results import StaticForm

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
_HEIGHT_FIELD = 1
_MESHES = (7, 8)
_LONG = (3, 5)
"""Capsules and cylinders."""
_ARROWS = (100, 101, 102)
_VISIBLE = (0, 1, 2)
"""Groups that MuJoCo shows by itself."""
_GEOM, _DECORATION = 19, 24
"""Floats of a geom and of a decoration in a frame."""
_WIDTH = 640
_FROM_AFAR = 1000.0
_LARGE = 1e9
"""From here on numbers are shown as powers of ten, as in the live lab."""
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def draw_picture(lab: Lab, main: dict[str, Any]) -> bytes:
    """The start of the main run of a lab's trial, as PNG."""
    scene = unpacked(main["scene"])
    frame = unpacked(main["pictures"][0]["frame"])
    camera = scene["camera"]
    distance, fovy = camera["distance"], camera["fovy"]
    if camera["orthographic"]:  # whose `fovy` is a length: the same seen from far away
        distance *= _FROM_AFAR
        fovy = math.degrees(2 * math.atan(fovy / 2 / distance))
    target = tuple(camera["target"])
    seen = Camera(camera["azimuth"], camera["elevation"], distance, target, fovy)
    return png(draw(tuple(scene_solids(scene, frame)), seen, _size(lab)))


def _size(lab: Lab) -> tuple[int, int]:
    """Width and height of a lab's picture, pixels."""
    return (_WIDTH, max(160, min(round(_WIDTH * lab.height / 480), 480)))


def static_form(lab: Lab, main: dict[str, Any], picture: bytes) -> StaticForm:
    """The static form of a lab whose trial's main run is `main`."""
    first, last = main["pictures"][0], main["pictures"][-1]
    recorded = main["plots"]
    plots = tuple(
        plot_svg(plot, recorded["times"], traces, narrow=lab.dock)
        for plot, traces in zip(lab.plots, recorded["plots"], strict=True)
    )
    readouts = tuple(
        (readout.label, _shown(value, readout.digits))
        for readout, value in zip(lab.readouts, last["readouts"] or (), strict=False)
    )
    return StaticForm(picture, _size(lab), first["time"], readouts, last["time"], plots)


def _shown(value: Any, digits: int) -> str:
    if isinstance(value, str):
        return value
    if not isinstance(value, int | float):
        return "\u2013"
    if not math.isfinite(value):
        return "NaN" if math.isnan(value) else "\u221e" if value > 0 else "\u2212\u221e"
    if abs(value) >= _LARGE:
        mantissa, exponent = f"{value:.{max(2, digits)}e}".split("e")
        return f"{mantissa}·10{str(int(exponent)).translate(_RAISED)}".replace("-", "\u2212")
    text = f"{value:.{digits}f}"
    if float(text) == 0:
        text = text.lstrip("-")
    return text.replace("-", "\u2212")


def scene_solids(scene: dict[str, Any], frame: Array) -> Iterator[Solid]:
    """What a picture of a frame shows: geoms, sites, and what MuJoCo's visualizer adds."""
    frame = np.asarray(frame, dtype=float)
    layout = scene["layout"]
    meshes = [_mesh(mesh) for mesh in scene["meshes"]]
    fields = [_height_field(field) for field in scene["hfields"]]
    for part, start in (("geoms", layout["geoms"]), ("sites", layout["sites"])):
        for i, item in enumerate(scene[part]):
            if item["group"] not in _VISIBLE:
                continue
            row = frame[start + _GEOM * i : start + _GEOM * (i + 1)]
            data = item.get("data", -1)
            solid = _solid(item["type"], data, row, (meshes, fields), _square(scene, item))
            if solid is not None:
                yield solid
    yield from _soft(scene, frame)
    start = layout["trail"] + 3 * int(frame[2])
    for i in range(int(frame[1])):
        row = frame[start + _DECORATION * i : start + _DECORATION * (i + 1)]
        kind, data = int(row[0]), int(row[1])
        size = row[4:7]
        if kind in _LONG:  # the visualizer's have their half-length last
            size = size[[0, 2, 2]]
        placed = np.concatenate((row[7:10], row[10:19], size, row[19:23]))
        # The visualizer counts a mesh and its hull: both have the mesh's shape here.
        data = data // 2 if kind in _MESHES else data
        solid = _solid(kind, data, placed, (meshes, fields), 0.0)
        if solid is not None:
            yield solid


def _solid(
    kind: int, data: int, row: Array, shapes: tuple[list[Surface], list[Surface]], square: float
) -> Solid | None:
    if not np.isfinite(row[:15]).all():
        return None  # the simulation blew up
    position, rotation, size = row[:3], row[3:12].reshape(3, 3), row[12:15]
    rgba = cast("tuple[float, float, float, float]", tuple(float(x) for x in row[15:19]))
    if kind in _ARROWS:
        half = float(size[2]) / 2
        shape = surface("cylinder", (float(size[0]), half))
        position = position + rotation[:, 2] * half
    elif kind in _KINDS:
        given = None
        if kind in _MESHES and 0 <= data < len(shapes[0]):
            given = shapes[0][data]
        elif kind == _HEIGHT_FIELD and 0 <= data < len(shapes[1]):
            given = shapes[1][data]
        shape = surface(_KINDS[kind], tuple(float(x) for x in size), given)
    else:
        return None
    if shape is None:
        return None
    return Solid(shape, position, rotation, rgba, square if kind == 0 else 0.0)


def _soft(scene: dict[str, Any], frame: Array) -> Iterator[Solid]:
    """Flexes with a surface, and skins: their vertices are in the frame, in the world."""
    for part, floats in (("flexes", 3), ("skins", 6)):
        begin = scene["layout"]["flex" if part == "flexes" else "skin"]
        for item in scene[part]:
            faces = np.asarray(item["elements" if part == "flexes" else "faces"], dtype=np.int64)
            if item["group"] not in _VISIBLE or faces.size == 0 or item.get("dim", 2) < 2:
                continue
            first = begin + floats * item["start"]
            rows = frame[first : first + floats * item["count"]].reshape(-1, floats)
            shape = mesh_surface(rows[:, :3], faces.reshape(-1, 3))
            rgba = cast("tuple[float, float, float, float]", tuple(float(x) for x in item["rgba"]))
            yield Solid(shape, np.zeros(3), np.eye(3), rgba)


def _square(scene: dict[str, Any], item: dict[str, Any]) -> float:
    """Width of the squares of a plane whose material has a pattern; 0 where it is plain."""
    if item["type"] != 0 or item["material"] < 0:
        return 0.0
    material = scene["materials"][item["material"]]
    if material["texture"] < 0:
        return 0.0
    repeat = material["texrepeat"][0] if material["texuniform"] else 1.0
    return 0.5 / repeat if repeat > 0 else 0.5


def _mesh(mesh: dict[str, Any]) -> Surface:
    vertices = np.asarray(mesh["vertices"], dtype=float).reshape(-1, 3)
    return mesh_surface(vertices, np.asarray(mesh["faces"], dtype=np.int64).reshape(-1, 3))


def _height_field(field: dict[str, Any]) -> Surface:
    rows, columns = field["rows"], field["columns"]
    half_x, half_y, top, _ = field["size"]
    x, y = np.linspace(-half_x, half_x, columns), np.linspace(-half_y, half_y, rows)
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    heights = np.asarray(field["data"], dtype=float) * top
    vertices = np.column_stack((grid, heights))
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    first = np.stack((a, b, c), axis=-1).reshape(-1, 3)
    second = np.stack((a, c, d), axis=-1).reshape(-1, 3)
    return mesh_surface(vertices, np.concatenate((first, second)))
