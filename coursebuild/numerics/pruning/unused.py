"""Things of a model that nothing uses: assets, classes, sites, keyframes, sensors, flags.

Entry points: `unused(look, kept)`; `meshes(look)`, that are only looked at, where a primitive has
the same shape.

References inside the model are found by the attributes that can hold one; whether that was all of
them is told by MuJoCo, which does not compile a model without a thing that something names.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator
from pathlib import PurePosixPath
from typing import Any

import mujoco
import numpy as np

from coursebuild.numerics.pruning.edits import ModelEdit, drop_attribute, set_attributes
from coursebuild.numerics.pruning.markup import Element
from coursebuild.numerics.pruning.model_text import thing_kind
from coursebuild.numerics.pruning.trials import (
    Candidate,
    Item,
    PruningContext,
    called,
    named_item,
    worded,
)

_SITE = frozenset(
    "site site1 site2 refsite cranksite slidersite sidesite objname refname".split(" ")
)
"""Attributes that may name a site."""

Kept = Callable[[str, str], bool]
"""Whether a finding of this kind and name is to be kept."""


def unused(look: PruningContext, kept: Kept) -> Iterator[Candidate]:
    """What nothing refers to and nobody reads."""
    yield from _assets(look, kept)
    yield from _some("unused-default", "no element is of the {}", _classes(look), _UNNAMED, "class")
    sensors = [named_item(one) for one in unread_sensors(look)]
    yield from _some("sensor-unread", "nobody reads the {}", sensors, _UNREAD, "sensor")
    gone = [i.gone[0] for i in sensors if not kept("sensor-unread", i.name)]
    sites = _sites(look, gone)
    yield from _some("unused-site", "nothing refers to the {}", sites, _UNNAMED, "site")
    yield from _keyframes(look)
    yield from _flags(look)


_UNNAMED = "nothing refers to it, and nobody mentions it"


def _some(kind: str, message: str, items: list[Item], proof: str, what: str) -> Iterator[Candidate]:
    if items:
        named = worded(items, what, _PLURALS.get(what, f"{what}s")) + " {}"
        timed = what in ("site", "sensor")
        message = message.replace("{}", named)
        if any(len(item.gone) > 1 for item in items):
            message += ", but for what is in vain itself"
        yield Candidate(kind, message, tuple(items), proof, timed=timed)


_PLURALS = {"class": "classes", "mesh": "meshes"}


def _assets(look: PruningContext, kept: Kept) -> Iterator[Candidate]:
    """Assets, from those that elements refer to down to those that assets refer to."""
    gone: list[Element] = []
    for kind, attributes in (
        ("material", ("material",)),
        ("texture", ("texture", "material")),
        ("mesh", ("mesh",)),
        ("hfield", ("hfield",)),
        ("model", ("model",)),
    ):
        items = []
        for element in look.elements:
            name = asset_name(element)
            if not _is_asset(element, kind) or not name or element.get("type") == "skybox":
                continue
            if look.readers.named(name) or (kind != "model" and look.readers.whole(kind)):
                continue
            using = [o for o in look.users(name, (*attributes, "objname")) if o is not element]
            if all(one in gone for one in using):
                items.append(Item(name, element, (element, *using)))
        found = f"unused-{kind}"
        gone += [item.gone[0] for item in items if not kept(found, item.name)]
        yield from _some(found, "nothing uses the {}", items, _UNNAMED, kind)


def _is_asset(element: Element, kind: str) -> bool:
    return element.tag == kind and element.above is not None and element.above.tag == "asset"


def asset_name(element: Element) -> str:
    """What an asset is called: after its file, where it has no name."""
    name = element.get("name")
    file = element.get("file")
    if name or not file:
        return name or ""
    return PurePosixPath(file.replace("\\", "/")).name.rpartition(".")[0] or file


def _classes(look: PruningContext) -> list[Item]:
    """Default classes that neither they nor one below them is used."""
    used = {
        value
        for one in look.elements
        for value in (one.get("childclass"), one.get("class") if one.tag != "default" else None)
        if value is not None
    }
    found: list[Item] = []
    taken: set[Element] = set()
    for element in look.elements:
        if element.tag != "default" or element in taken:
            continue
        name, above = element.get("class"), element.above
        if not name or above is None or above.tag != "default":
            continue
        inside = [one for one in element.walk() if one.tag == "default"]
        names = [one.get("class") or "" for one in inside]
        if used.isdisjoint(names) and not any(look.readers.named(one) for one in names):
            taken |= set(inside)
            found.append(Item(name, element, (element,)))
    return found


def _sites(look: PruningContext, gone: Collection[Element]) -> list[Item]:
    """Sites that only elements which are gone refer to."""
    if look.readers.whole("site"):
        return []
    found = []
    for one in look.elements:
        name = one.get("name") or ""
        if one.tag != "site" or thing_kind(one) != "site" or look.readers.named(name):
            continue
        users = look.users(name, _SITE)
        if all(user in gone for user in users):
            found.append(named_item(one, *users))
    return found


def _keyframes(look: PruningContext) -> Iterator[Candidate]:
    keys = [
        one
        for one in look.elements
        if one.tag == "key" and one.above is not None and one.above.tag == "keyframe"
    ]
    if look.readers.whole("keyframe") or look.readers.whole("keyframe-number"):
        return
    if len(keys) != look.model.nkey:
        return
    items = [
        named_item(one)
        for number, one in enumerate(keys)
        if number not in look.used_keyframes and not look.readers.named(one.get("name") or "")
    ]
    proof = "no scenario begins there, and nobody mentions it"
    yield from _some("unused-keyframe", "nothing begins at the {}", items, proof, "keyframe")


_UNREAD = "what a sensor says changes nothing that moves"


def unread_sensors(look: PruningContext) -> list[Element]:
    """Sensors that nobody reads."""
    if look.readers.whole("sensor"):
        return []
    return [
        one
        for one in look.elements
        if thing_kind(one) == "sensor" and not look.readers.named(one.get("name") or "")
    ]


def _flags(look: PruningContext) -> Iterator[Candidate]:
    for flag, said in (
        ("energy", "energy is computed in every step, and nobody reads it"),
        ("fwdinv", "forward and inverse dynamics are compared in every step, for nobody"),
    ):
        having = [one for one in look.elements if one.tag == "flag" and one.get(flag) == "enable"]
        if having and not look.readers.whole(flag):
            item = Item(flag, having[-1], flags=((flag, None),))
            yield Candidate(f"{flag}-flag", said, (item,), "it is computed beside the motion")


# ------------------------------------------------------------------------- meshes to be looked at

SHARE = 0.02
"""Of its size and its volume, by which a primitive may be another shape than a mesh."""
_SHAPES = ("box", "sphere", "cylinder", "ellipsoid", "capsule")
_PLACED = ("pos", "quat", "axisangle", "xyaxes", "zaxis", "euler", "fromto", "size", "mesh", "type")
_MOST = 100
"""Geoms that are tried; each is compiled a few times."""


def meshes(look: PruningContext) -> Iterator[Candidate]:
    """Geoms that only show a mesh, and could be a primitive: MuJoCo itself fits one.

    The fitted one has the mesh's inertia; it does where its volume and its box are the mesh's too.
    """
    items: list[Item] = []
    for element, geom in list(_shown_meshes(look))[:_MOST]:
        for shape in _SHAPES:
            try:
                other = look.text.compiled(set_attributes(element, (("type", shape),)))
            except ValueError:
                continue
            if other.ngeom == look.model.ngeom and _alike(look.model, other, geom, shape):
                edits = _as_primitive(element, shape, other, geom)
                items.append(Item(called(element), element, _unshared(look, element), edits))
                break
    if items:
        yield Candidate(
            "mesh-primitive",
            worded(items, "the geom {} is", "the geoms {} are")
            + " a mesh with the shape of a primitive",
            tuple(items),
            "it is only looked at",
            timed=False,
            blocked="whether the shape is near enough to look at is for a person to say",
        )


def _shown_meshes(look: PruningContext) -> Iterator[tuple[Element, int]]:
    """Geoms that are meshes of their own, and touch nothing."""
    model = look.model
    paired = {int(g) for g in (*model.pair_geom1, *model.pair_geom2)}
    for element, ids in look.things("geom"):
        name = element.get("mesh")
        if not name or len(ids) != 1:
            continue
        (geom,) = ids
        touches = model.geom_contype[geom] or model.geom_conaffinity[geom] or geom in paired
        held = element.above is not None and element.above.tag in ("body", "worldbody")
        is_mesh = model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH
        if is_mesh and held and not touches and not look.readers.reads("mesh", name):
            yield element, geom


def _alike(model: Any, other: Any, geom: int, shape: str) -> bool:
    size = other.geom_size[geom].tolist()
    box, fitted = model.geom_aabb[geom], other.geom_aabb[geom]
    same_box = np.allclose(box, fitted, rtol=0, atol=SHARE * max(size))
    volume = _mesh_volume(model, int(model.geom_dataid[geom]))
    return bool(same_box and math.isclose(_volume(shape, *size), volume, rel_tol=SHARE))


def _mesh_volume(model: Any, mesh: int) -> float:
    """m³: of the tetrahedra from the origin to each face."""
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    start, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    points = np.asarray(model.mesh_vert[first : first + count], dtype=np.float64)
    corners = points[model.mesh_face[start : start + faces]]
    return abs(float(np.linalg.det(corners).sum())) / 6


def _volume(shape: str, a: float, b: float, c: float) -> float:
    """m³."""
    return {
        "box": 8 * a * b * c,
        "sphere": 4 / 3 * math.pi * a**3,
        "cylinder": 2 * math.pi * a**2 * b,
        "capsule": math.pi * a**2 * (2 * b + 4 / 3 * a),
        "ellipsoid": 4 / 3 * math.pi * a * b * c,
    }[shape]


def _as_primitive(element: Element, shape: str, other: Any, geom: int) -> tuple[ModelEdit, ...]:
    def text(numbers: Any) -> str:
        return " ".join(f"{float(number):.9g}" for number in numbers)

    count = {"sphere": 1, "cylinder": 2, "capsule": 2}.get(shape, 3)
    values = {
        "type": shape,
        "size": text(other.geom_size[geom][:count]),
        "pos": text(other.geom_pos[geom]),
        "quat": text(other.geom_quat[geom]),
    }
    drops = [a.name for a in element.attributes if a.name in _PLACED and a.name not in values]
    edits = set_attributes(element, values.items())
    return (*edits, *(drop_attribute(element, name) for name in drops))


def _unshared(look: PruningContext, element: Element) -> tuple[Element, ...]:
    """The mesh, if nothing else shows it."""
    name = element.get("mesh") or ""
    if look.users(name, ("mesh",)) != [element]:
        return ()
    return tuple(one for one in look.elements if _is_asset(one, "mesh") and asset_name(one) == name)
