"""Candidates: what could be left out of a model, and why all motions would stay the same.

1. The proof of a kind holds only if MuJoCo compiles the model without the thing, so that no other
   element refers to it. The survey checks that nothing else in the compiled model changes.
2. What has no proof is tried by running. Integrator, timestep and solver are not candidates: they
   change an error, which `bench` judges against a reference, never against the model.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import islice
from pathlib import PurePosixPath
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct

from mjbench.problem import Scenario
from mjbench.pruning.comparison import WatchedRun
from mjbench.pruning.model_text import ModelText, section_of, thing_kind
from mjbench.pruning.reachability import (
    Pair,
    find_separate,
    hull_distance,
    iterate_pairs,
)
from mjbench.pruning.xml_edits import (
    Element,
    ModelEdit,
    place_of,
    set_attributes,
    set_option,
)
from mjbench.reports.diet_report import name_list

MOST_PAIRS = 100_000
"""With so many pairs of geoms no contact is examined."""


class FindingKind(Struct, frozen=True):
    """A kind of findings."""

    message: str
    """What is said of such things: `{}` or `{0}` stands for their noun and names, `{1}` for the
    subjects of the scene."""
    noun: str = ""
    view: str = ""
    """The kind of thing that it is to code (`differences.VIEWS`)."""
    proof: str = ""
    """Why such a thing changes no motion, in any state; empty where only runs speak for it."""
    fields: str = ""
    """Fields of the compiled model that differ without it, beside those of its view."""
    interface: bool = False
    """Whether such things are there for whoever drives the model, whose code may be elsewhere."""


_UNMOVED = "no motion is computed of it, and nothing refers to it"
_UNUSED = f"{_UNMOVED}, nor does the code that was looked at"
_BESIDE = "it is computed beside the motion, and no code that was looked at reads it"
KINDS = {
    "energy-flag": FindingKind(
        "energy is computed in every step, and nothing reads it",
        proof=_BESIDE,
        fields="enableflags",
    ),
    "fwdinv-flag": FindingKind(
        "forward and inverse dynamics are compared in every step, and nothing reads the result",
        proof=_BESIDE,
        fields="enableflags",
    ),
    "sensor-unread": FindingKind(
        "nothing reads the {}",
        "sensor",
        "Sensor",
        "what a sensor says moves nothing",
        interface=True,
    ),
    "actuator-idle": FindingKind(
        "nothing commands the {}",
        "actuator",
        "Actuator",
        "its force is a multiple of a command that is always 0",
        "key_ctrl nu nout nJmom tree_sleep_policy",
        interface=True,
    ),
    "tendon-idle": FindingKind(
        "nothing acts along the {}",
        "tendon",
        "Tendon",
        "it has no force, inertia or limit of its own, and nothing refers to it",
        "wrap_type wrap_prm nwrap nJten ten_J_rownnz ten_J_rowadr ten_J_colind",
    ),
    "unused-keyframe": FindingKind(
        "nothing begins at the {}",
        "keyframe",
        "Keyframe",
        _UNUSED,
        interface=True,
    ),
    "unused-site": FindingKind("nothing uses the {}", "site", "Site", _UNMOVED, interface=True),
    "unused-camera": FindingKind(
        "nothing looks through the {}", "camera", "Camera", _UNMOVED, interface=True
    ),
    "unused-material": FindingKind("nothing uses the {}", "material", "Material", _UNUSED),
    "unused-texture": FindingKind("nothing uses the {}", "texture", "Texture", _UNUSED),
    "unused-mesh": FindingKind("nothing uses the {}", "mesh", "Mesh", _UNUSED, "npolygonmax"),
    "unused-hfield": FindingKind("nothing uses the {}", "hfield", "Hfield", _UNUSED),
    "unused-model": FindingKind("nothing uses the {}", "model", proof=_UNUSED),
    "unused-default": FindingKind("no element is of the {}", "class", proof=_UNUSED),
    "contact-off": FindingKind(
        "contacts are searched for, and nothing can touch",
        proof="no two geoms can meet, whatever the joints do",
        fields="disableflags",
    ),
    "collision-unreachable": FindingKind(
        "contacts are searched for on the {}, and nothing can touch there",
        "geom",
        proof="every geom that it could collide with is out of reach",
        fields="geom_contype geom_conaffinity body_contype body_conaffinity"
        " body_bvhnum body_bvhadr",
    ),
    "far-body": FindingKind(
        "what the scene is about{1} moves in the same way without the {0}", "body", "Body"
    ),
    "contact-idle": FindingKind("contacts are searched for, and nothing touched"),
    "contact-left": FindingKind("contacts are searched for, and without {} nothing touched"),
    "collision-idle": FindingKind(
        "contacts are searched for on the {}, and nothing touched there", "geom"
    ),
    "coupling-idle": FindingKind("what the scene shows is the same without the {}", "coupling"),
    "mesh-primitive": FindingKind(
        "a simple shape can stand for the mesh of the {}", "geom", "Geom"
    ),
}
"""What uses other things comes before them, so that they can go with it."""


class Item(Struct, frozen=True, eq=False):
    """One thing that may be needless, and the changes that take it out."""

    kind: str
    """A key of `KINDS`."""
    name: str
    """Its name, or the path of its element."""
    element: Element | None
    """The element to point at; `None` for the model as a whole."""
    removals: tuple[Element, ...] = ()
    """Elements to take out."""
    drops: tuple[tuple[Element, str], ...] = ()
    """Attributes to take out."""
    edits: tuple[ModelEdit, ...] = ()
    """Other changes of the text."""
    subjects: tuple[str, ...] = ()
    """The bodies that the scene is about, where that counts."""


def message_of(items: Sequence[Item]) -> str:
    """The message of a finding about these items, all of one kind."""
    kind = KINDS[items[0].kind]
    plural = {"body": "bodies", "class": "classes", "mesh": "meshes"}.get(
        kind.noun, f"{kind.noun}s"
    )
    noun = f"{kind.noun if len(items) == 1 else plural} " if kind.noun else ""
    subjects = f" ({name_list(items[0].subjects)})" if items[0].subjects else ""
    return kind.message.format(noun + name_list([item.name for item in items]), subjects)


_FLAGS = ("energy", "fwdinv")


def unread_elements(text: ModelText, scenarios: Collection[Scenario]) -> list[Item]:
    """Elements that no motion is computed from, in the order of their kinds."""
    keys = [e for e in text.elements if e.tag == "key" and section_of(e) == "keyframe"]
    start_keys = {keys[s.keyframe] for s in scenarios if 0 <= s.keyframe < len(keys)}
    start_keys.update(keys[:1])  # in which the page of the model begins
    commanded = commanded_actuators(text.model, scenarios)
    items = [
        Item(f"{flag}-flag", flag, element, drops=((element, flag),))
        for element in text.elements
        for flag in _FLAGS
        if element.tag == "flag" and element.get(flag) == "enable"
    ]
    for element in text.elements:
        kind = _unread_kind(text, element, commanded)
        if kind and element not in start_keys:
            items.append(Item(kind, display_name(element), element, (element,)))
    kinds = list(KINDS)
    return sorted(items, key=lambda item: kinds.index(item.kind))


def _unread_kind(text: ModelText, element: Element, commanded: Collection[int]) -> str:
    """The kind of an element in a finding; empty for one that a motion may depend on."""
    ids, tag, section = text.ids(element), element.tag, section_of(element)
    if section == "sensor" and tag not in ("user", "plugin"):
        return "sensor-unread"
    if section == "actuator" and ids and _is_forceless_actuator(text.model, ids, commanded):
        return "actuator-idle"
    if section == "tendon" and ids and is_forceless_tendon(text.model, ids):
        return "tendon-idle"
    if section == "keyframe" and tag == "key":
        return "unused-keyframe"
    if ids and (kind := thing_kind(element)) in ("site", "camera"):
        return f"unused-{kind}"
    if section == "asset" and element.get("type") != "skybox" and f"unused-{tag}" in KINDS:
        return f"unused-{tag}"
    if tag == "default" and element.parent is not None and element.parent.tag == "default":
        return "unused-default"
    return ""


def display_name(element: Element) -> str:
    """The name of an element, or the way to it where it has none.

    An asset without a name is called after its file.
    """
    name = element.get("class" if element.tag == "default" else "name")
    if section_of(element) == "asset":
        name = name or PurePosixPath((element.get("file") or "").replace("\\", "/")).stem
    return name or place_of(element)


_RESISTANCE = ("damping", "dampingpoly", "armature")
"""Properties by which an actuator resists motion, whatever its command."""


def commanded_actuators(model: Any, scenarios: Collection[Scenario]) -> frozenset[int]:
    """The actuators that a scenario or a keyframe gives a command other than 0, by number."""
    rows = [*model.key_ctrl, *(row for scenario in scenarios for row in scenario.controls)]
    is_used = np.any([np.zeros(model.nu), *rows], axis=0)
    ends = model.actuator_ctrladr + model.actuator_ctrlnum
    return frozenset(
        i
        for i, (start, end) in enumerate(zip(model.actuator_ctrladr, ends, strict=True))
        if np.any(is_used[start:end])
    )


def _is_forceless_actuator(model: Any, ids: Collection[int], commanded: Collection[int]) -> bool:
    """Whether these actuators get no command, and give no force without one, in any state."""
    linear = (int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtGain.mjGAIN_AFFINE))
    for i in ids:
        ranges = [(model.actuator_ctrllimited[i], model.actuator_ctrlrange[i])]
        ranges += [(model.actuator_forcelimited[i], model.actuator_forcerange[i])]
        if (
            i in commanded
            or any(np.any(getattr(model, f"actuator_{name}")[i]) for name in _RESISTANCE)
            or model.actuator_biastype[i] != mujoco.mjtBias.mjBIAS_NONE
            or model.actuator_dyntype[i] != mujoco.mjtDyn.mjDYN_NONE
            or model.actuator_gaintype[i] not in linear
            or any(limited and (low > 0 or high < 0) for limited, (low, high) in ranges)
        ):
            return False
    return True


_FORCES_OF_TENDONS = (
    *("stiffness", "stiffnesspoly", "damping", "dampingpoly", "frictionloss", "armature"),
    "limited",
)
"""Properties that make a tendon exert a force of its own."""


def is_forceless_tendon(model: Any, ids: Collection[int]) -> bool:
    """Whether no force acts along these tendons, in any state."""
    return not any(
        np.any(getattr(model, f"tendon_{name}")[i]) for name in _FORCES_OF_TENDONS for i in ids
    )


def unreachable_contacts(text: ModelText) -> list[Item]:
    """Contact as a whole, or of single geoms, where a bound says that nothing can touch."""
    pairs = frozenset(islice(iterate_pairs(text.model), MOST_PAIRS))
    if len(pairs) == MOST_PAIRS:
        return []
    in_reach = pairs - find_separate(text.model, pairs)
    return _without_contact(text, pairs, in_reach, "contact-off", "collision-unreachable")


def idle_contacts(text: ModelText, runs: Collection[WatchedRun]) -> list[Item]:
    """Contact as a whole, or of single geoms, where nothing touched in these runs."""
    pairs = frozenset(islice(iterate_pairs(text.model), MOST_PAIRS))
    touching = frozenset(pair for run in runs for pair in run.touching_pairs)
    return _without_contact(text, pairs, touching, "contact-idle", "collision-idle")


_UNTOUCHABLE = (("contype", "0"), ("conaffinity", "0"))


def _without_contact(
    text: ModelText, pairs: Collection[Pair], touching: Collection[Pair], whole: str, part: str
) -> list[Item]:
    """Contact as a whole where none of the pairs touch, else of the geoms in no touching pair.

    Geoms of an explicit pair are left alone. `whole` and `part` are kinds of findings.
    """
    if text.model.nflex or not pairs:
        return []
    if not touching:
        disabling = set_option(text.main, "flag", "contact", "disable")
        return [Item(whole, "contact", None, edits=disabling)]
    explicit = {int(g) for g in (*text.model.pair_geom1, *text.model.pair_geom2)}
    idle = {geom for pair in pairs for geom in pair} - explicit
    idle -= {geom for pair in touching for geom in pair}
    return [
        Item(part, display_name(element), element, edits=set_attributes(element, _UNTOUCHABLE))
        for element, ids in text.things("geom")
        if idle.issuperset(ids)
    ]


def contact_of_rest(text: ModelText, items: Sequence[Item]) -> list[Item]:
    """Contact as a whole, together with items without which nothing may touch any more."""
    can_touch = text.model.nflex or next(iterate_pairs(text.model), None)
    if not items or not can_touch:
        return []
    removals = tuple(element for item in items for element in item.removals)
    drops = tuple(drop for item in items for drop in item.drops)
    edits = [edit for item in items for edit in item.edits]
    edits += set_option(text.main, "flag", "contact", "disable")
    kinds = " and ".join(dict.fromkeys(f"`{item.kind}`" for item in items))
    return [Item("contact-left", f"what {kinds} names", None, removals, drops, tuple(edits))]


_FIT = 0.05
"""How far a shape may be off, relative to a mesh's size."""
_SHAPES = ("sphere", "capsule", "cylinder", "box", "ellipsoid")


def primitive_meshes(text: ModelText) -> list[Item]:
    """Meshes that collide, each with the shape that MuJoCo fits to it best.

    Its surface is off by as much as is said; whether that shows is tried by running.
    """
    model, items = text.model, []
    for element, ids in text.things("geom"):
        if element.get("type") != "mesh" or not all(
            model.geom_contype[i] or model.geom_conaffinity[i] for i in ids
        ):
            continue
        fits, body = [], element.parent
        siblings = (
            [child for child in body.children if child.tag in ("geom", "inertial")] if body else []
        )
        mass = (("mass", f"{float(model.body_mass[model.geom_bodyid[ids[0]]]):.17g}"),)
        for shape in _SHAPES:  # with the mass that the mesh has
            edits = set_attributes(
                element, (("type", shape), *(mass if len(siblings) == 1 else ()))
            )
            try:
                variant = text.compile(edits)
            except ValueError:
                continue
            fits.append((hull_distance(model, variant, ids[0]), shape, edits))
        if fits:
            off, shape, edits = min(fits)
            name = f"{display_name(element)} ({shape}, off by {off:.2g} m)"
            if off < _FIT * min(model.geom_rbound[i] for i in ids):
                items.append(Item("mesh-primitive", name, element, edits=edits))
    return items
