"""Meshes that are only looked at, where a primitive has the same shape.

Entry point: `meshes(look)`.

MuJoCo itself fits a primitive to each mesh. It does where no corner of the mesh is farther outside
of it than one part in fifty of its size, and both have the same volume to that part.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from coursebuild.numerics.pruning.edits import ModelEdit, drop_attribute, set_attributes
from coursebuild.numerics.pruning.markup import Element, place_of
from coursebuild.numerics.pruning.trials import Candidate, Item, PruningContext, worded
from coursebuild.numerics.pruning.unused import asset_name
from mjcourse.spatial import quat_conj, quat_rotate

Points = NDArray[np.float64]

SHARE = 0.02
"""Of its size and its volume, by which the shape may be another."""
_MESH = int(mujoco.mjtGeom.mjGEOM_MESH)
_SHAPES = ("box", "sphere", "cylinder", "ellipsoid", "capsule")
_PLACED = ("pos", "quat", "axisangle", "xyaxes", "zaxis", "euler", "fromto", "size", "mesh", "type")
_MOST = 100
"""Geoms that are tried; each is compiled a few times."""


def meshes(look: PruningContext) -> Iterator[Candidate]:
    """Geoms that only show a mesh, and could be a primitive."""
    items: list[Item] = []
    for element in _shown(look)[:_MOST]:
        item = _item(look, element)
        if item is not None:
            items.append(item)
    if items:
        what = worded(items, "the geom {} is", "the geoms {} are")
        blocked = "whether the shape is near enough to look at is for a person to say"
        yield Candidate(
            "mesh-primitive",
            f"{what} a mesh with the shape of a primitive",
            tuple(items),
            "it is only looked at",
            timed=False,
            blocked=blocked,
        )


def _shown(look: PruningContext) -> list[Element]:
    """Geoms that are meshes of their own, and touch nothing."""
    model = look.model
    paired = {int(g) for g in (*model.pair_geom1, *model.pair_geom2)}
    found = []
    for element in look.scene.elements:
        thing = look.scene.ids(element)
        if element.tag != "geom" or thing is None or len(thing.ids) != 1:
            continue
        geom = thing.ids[0]
        name = element.get("mesh")
        if not name or model.geom_type[geom] != _MESH or geom in paired:
            continue
        if model.geom_contype[geom] or model.geom_conaffinity[geom]:
            continue
        if element.above is None or element.above.tag not in ("body", "worldbody"):
            continue
        if not look.readers.reads("mesh", name):
            found.append(element)
    return found


def _item(look: PruningContext, element: Element) -> Item | None:
    thing = look.scene.ids(element)
    assert thing is not None
    geom = thing.ids[0]
    corners, volume = _mesh(look.model, geom)
    for shape in _SHAPES:
        try:
            other = look.scene.compiled(set_attributes(element, (("type", shape),)))
        except ValueError:
            continue
        if other.ngeom != look.model.ngeom:
            continue
        size = np.asarray(other.geom_size[geom], dtype=np.float64)
        near = _outside(shape, size, _inside(other, geom, corners)) <= SHARE * float(size.max())
        same = abs(_volume(shape, size) / volume - 1.0) <= SHARE if volume > 0 else False
        if near and same:
            name = element.get("name") or place_of(element)
            return Item(
                name, element, _unshared(look, element), _replaced(element, shape, other, geom)
            )
    return None


def _replaced(element: Element, shape: str, other: Any, geom: int) -> tuple[ModelEdit, ...]:
    count = {"sphere": 1, "cylinder": 2, "capsule": 2}.get(shape, 3)
    values = (
        ("type", shape),
        ("size", _text(other.geom_size[geom][:count])),
        ("pos", _text(other.geom_pos[geom])),
        ("quat", _text(other.geom_quat[geom])),
    )
    given = {name for name, _ in values}
    drops = [a.name for a in element.attributes if a.name in _PLACED and a.name not in given]
    return (*set_attributes(element, values), *(drop_attribute(element, name) for name in drops))


def _text(numbers: Any) -> str:
    return " ".join(f"{float(number):.9g}" for number in numbers)


def _unshared(look: PruningContext, element: Element) -> tuple[Element, ...]:
    """The mesh, if nothing else shows it."""
    name = element.get("mesh")
    using = [one for one in look.scene.elements if one.get("mesh") == name and one is not element]
    if using:
        return ()
    return tuple(
        one
        for one in look.scene.elements
        if one.tag == "mesh"
        and one.above is not None
        and one.above.tag == "asset"
        and asset_name(one) == name
    )


def _mesh(model: Any, geom: int) -> tuple[Points, float]:
    """Corners (n, 3) of a geom's mesh in the frame of its body, m; and its volume, m³."""
    mesh = int(model.geom_dataid[geom])
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    own = np.asarray(model.mesh_vert[first : first + count], dtype=np.float64)
    start, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    corners = own[np.asarray(model.mesh_face[start : start + faces])]
    volume = float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)
    return quat_rotate(model.geom_quat[geom], own) + model.geom_pos[geom], abs(volume)


def _inside(model: Any, geom: int, points: Points) -> Points:
    """Points of the body's frame in that of a geom."""
    return quat_rotate(quat_conj(model.geom_quat[geom]), points - model.geom_pos[geom])


def _outside(shape: str, size: Points, points: Points) -> float:
    """How far the farthest point is outside of a primitive, m, or more."""
    flat, up = np.hypot(points[:, 0], points[:, 1]), np.abs(points[:, 2])
    match shape:
        case "box":
            away = np.max(np.abs(points) - size, axis=1)
        case "sphere":
            away = np.linalg.norm(points, axis=1) - size[0]
        case "cylinder":
            away = np.maximum(flat - size[0], up - size[1])
        case "capsule":
            away = np.hypot(flat, np.maximum(up - size[1], 0.0)) - size[0]
        case _:
            away = (np.linalg.norm(points / size, axis=1) - 1.0) * float(size.max())
    return float(np.max(away))


def _volume(shape: str, size: Points) -> float:
    """m³."""
    a, b, c = size.tolist()
    volumes = {
        "box": 8 * a * b * c,
        "sphere": 4 / 3 * math.pi * a**3,
        "cylinder": 2 * math.pi * a**2 * b,
        "capsule": math.pi * a**2 * (2 * b + 4 / 3 * a),
        "ellipsoid": 4 / 3 * math.pi * a * b * c,
    }
    return float(volumes[shape])
