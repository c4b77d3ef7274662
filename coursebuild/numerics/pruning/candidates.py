"""What could be left out of a model, and why the motion would be the same in every state.

Entry points: `unread(text, scenarios)`, of which no motion is computed; `contacts(text)`, where
nothing can touch; `idle_contacts`, `far_bodies`, `settings`, for which only runs speak.

1. The argument of a kind holds for whatever MuJoCo's compiler lets go: what another element refers
   to does not compile without it. What else changes in the compiled model is looked at by the
   survey, and nothing may beyond what belongs to the things that are gone.
2. Without an argument a thing is tried by running. The integrator and the timestep are not among
   these: what they change is an error, and is judged against a reference, never against the model.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import islice
from pathlib import PurePosixPath
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct

from coursebuild.numerics.problem import Scenario
from coursebuild.numerics.pruning.compare import WatchedRun
from coursebuild.numerics.pruning.edits import ModelEdit, set_attributes, set_option
from coursebuild.numerics.pruning.markup import Element, place_of
from coursebuild.numerics.pruning.model_text import ModelText, section_of
from coursebuild.numerics.pruning.reachability import Pair, each_pair, separate

MOST_PAIRS = 100_000
"""Pairs of geoms beyond which nothing is said of them."""


class Item(Struct, frozen=True, eq=False):
    """One thing that may be in vain, and how to be without it."""

    kind: str
    """Of the finding, such as `sensor-unread`."""
    name: str
    """What it is called; the way to its element where it has no name."""
    element: Element | None
    """Where to point at; `None`: at the model."""
    gone: tuple[Element, ...] = ()
    """Elements to take out."""
    drops: tuple[tuple[Element, str], ...] = ()
    """Attributes to take out."""
    edits: tuple[ModelEdit, ...] = ()
    """Other changes of the text."""
    view: str = ""
    """The kind of thing that it is to code (`differences.VIEWS`)."""


def proof_of(kind: str) -> str:
    """Why what is of this kind and in vain changes no motion, in any state."""
    if kind.startswith("unused-"):
        return "no motion is computed of it, nothing refers to it, and no code can notice"
    return _PROOFS.get(kind, "")


_PROOFS = {
    "sensor-unread": "what a sensor says moves nothing, and no code can notice",
    "energy-flag": "it is computed beside the motion, and no code can notice",
    "fwdinv-flag": "it is computed beside the motion, and no code can notice",
    "actuator-idle": "its force is a multiple of a command that is always 0",
    "tendon-idle": "it has no force, inertia or limit of its own, and nothing refers to it",
    "contact-off": "no two geoms can meet, whatever the joints do",
    "collision-unreachable": "every geom that it could collide with is out of reach",
}


def message_of(kind: str, names: str, count: int) -> str:
    """What a finding says of so many things with these names."""
    what = kind.removeprefix("unused-") if kind.startswith("unused-") else _WHAT.get(kind, "")
    if what == "default":
        what = "class"
    for (_, name, value), words in _SETTINGS.items():
        if (kind, names) == (name, value):
            return words
    many = "bodies" if what == "body" else what + ("es" if what in ("class", "mesh") else "s")
    return _MESSAGES.get(kind, "nothing uses the {}").format(
        f"{what if count == 1 else many} {names}"
    )


_WHAT = {
    "sensor-unread": "sensor",
    "actuator-idle": "actuator",
    "tendon-idle": "tendon",
    "collision-unreachable": "geom",
    "collision-idle": "geom",
    "far-body": "body",
}
_MESSAGES = {
    "unused-default": "no element is of the {}",
    "unused-keyframe": "nothing begins at the {}",
    "sensor-unread": "nobody reads the {}",
    "energy-flag": "energy is computed in every step, and nobody reads it",
    "fwdinv-flag": "forward and inverse dynamics are compared in every step, for nobody",
    "actuator-idle": "nobody commands the {}",
    "tendon-idle": "nothing acts along the {}",
    "contact-off": "contacts are searched for, and nothing can touch",
    "contact-idle": "contacts are searched for, and nothing touched",
    "collision-unreachable": "contacts are searched for on the {}, and nothing can touch there",
    "collision-idle": "contacts are searched for on the {}, and nothing touched there",
    "far-body": "what the scene is about moves in the same way without the {}",
}


_ASSETS = {"material": "Material", "texture": "Texture", "mesh": "Mesh", "hfield": "Hfield"}
_ASSETS |= {"model": ""}
_FLAGS = ("energy", "fwdinv")


def unread(text: ModelText, scenarios: Collection[Scenario]) -> list[Item]:
    """Elements that no motion is computed of."""
    keys = [one for one in text.elements if one.tag == "key" and section_of(one) == "keyframe"]
    begun = {keys[s.keyframe] for s in scenarios if 0 <= s.keyframe < len(keys)}
    found = [
        Item(f"{flag}-flag", flag, one, drops=((one, flag),))
        for one in text.elements
        for flag in _FLAGS
        if one.tag == "flag" and one.get(flag) == "enable"
    ]
    later: list[tuple[int, Item]] = []
    for element in text.elements:
        known = _unread_kind(text, element, scenarios)
        if known is not None and element not in begun:
            kind, view, name, order = known
            later.append((order, Item(kind, name, element, (element,), view=view)))
    return [*found, *(item for _, item in sorted(later, key=lambda one: one[0]))]


def _unread_kind(
    text: ModelText, element: Element, scenarios: Collection[Scenario]
) -> tuple[str, str, str, int] | None:
    """The kind of an element in a finding and to code, its name, and when it is tried.

    Users come before what they use, so that this can go with them.
    """
    thing, tag, name = text.ids(element), element.tag, display_name(element)
    section = section_of(element)
    if section == "sensor" and tag not in ("user", "plugin"):
        return "sensor-unread", "Sensor", name, 0
    if section == "actuator" and thing and _forceless(text.model, thing.ids, scenarios):
        return "actuator-idle", "Actuator", name, 1
    if section == "tendon" and thing and _slack(text.model, thing.ids):
        return "tendon-idle", "Tendon", name, 2
    if section == "keyframe" and tag == "key":
        return "unused-keyframe", "Keyframe", name, 3
    if thing is not None and thing.kind == "site":
        return "unused-site", "Site", name, 4
    if section == "asset" and tag in _ASSETS and element.get("type") != "skybox":
        name = element.get("name") or _file_name(element)
        return f"unused-{tag}", _ASSETS[tag], name, 5 + list(_ASSETS).index(tag)
    if tag == "default" and element.parent is not None and element.parent.tag == "default":
        return "unused-default", "", element.get("class") or name, 5 + len(_ASSETS)
    return None


def display_name(element: Element) -> str:
    """The name of an element, or the way to it where it has none."""
    return element.get("name") or place_of(element)


def _file_name(element: Element) -> str:
    """An asset without a name is called after its file."""
    name = PurePosixPath((element.get("file") or "").replace("\\", "/")).stem
    return name or place_of(element)


def _forceless(model: Any, ids: Collection[int], scenarios: Collection[Scenario]) -> bool:
    """Whether nobody commands these actuators, and a command of 0 gives no force, in any state."""
    commands = [*model.key_ctrl, *(np.array(row) for one in scenarios for row in one.controls)]
    linear = (int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtGain.mjGAIN_AFFINE))
    for i in ids:
        ranges = [(model.actuator_ctrllimited[i], model.actuator_ctrlrange[i])]
        ranges += [(model.actuator_forcelimited[i], model.actuator_forcerange[i])]
        if (
            any(row[i] for row in commands)
            or model.actuator_biastype[i] != mujoco.mjtBias.mjBIAS_NONE
            or model.actuator_dyntype[i] != mujoco.mjtDyn.mjDYN_NONE
            or model.actuator_gaintype[i] not in linear
            or any(limited and (low > 0 or high < 0) for limited, (low, high) in ranges)
        ):
            return False
    return True


_OF_TENDONS = (
    *("stiffness", "stiffnesspoly", "damping", "dampingpoly", "frictionloss", "armature"),
    "limited",
)
"""What makes a tendon exert a force of its own."""


def _slack(model: Any, ids: Collection[int]) -> bool:
    return not any(np.any(getattr(model, f"tendon_{name}")[i]) for name in _OF_TENDONS for i in ids)


def contacts(text: ModelText) -> list[Item]:
    """Contact as a whole, or that of geoms, where a bound says that nothing can touch."""
    pairs = frozenset(islice(each_pair(text.model), MOST_PAIRS))
    if len(pairs) == MOST_PAIRS:
        return []
    near = pairs - separate(text.model, pairs)
    return _without_contact(text, pairs, near, "contact-off", "collision-unreachable")


def idle_contacts(text: ModelText, seen: Collection[WatchedRun]) -> list[Item]:
    """The same where nothing touched."""
    pairs = frozenset(islice(each_pair(text.model), MOST_PAIRS))
    touching = frozenset(pair for one in seen for pair in one.touching)
    return _without_contact(text, pairs, touching, "contact-idle", "collision-idle")


def _without_contact(
    text: ModelText, pairs: Collection[Pair], touching: Collection[Pair], whole: str, part: str
) -> list[Item]:
    """Contact as a whole where none of these pairs touch, else that of geoms in no pair that does.

    Geoms of an explicit pair are left alone. `whole` and `part` are kinds of findings.
    """
    if text.model.nflex or not pairs:
        return []
    if not touching:
        off = set_option(text.main, "flag", "contact", "disable")
        return [Item(whole, "contact", None, edits=off)]
    explicit = {int(g) for g in (*text.model.pair_geom1, *text.model.pair_geom2)}
    idle = {geom for pair in pairs for geom in pair} - explicit
    idle -= {geom for pair in touching for geom in pair}
    none = (("contype", "0"), ("conaffinity", "0"))
    return [
        Item(part, display_name(element), element, edits=set_attributes(element, none))
        for element, ids in text.things("geom")
        if idle.issuperset(ids)
    ]


def far_bodies(text: ModelText, said: Collection[str], seen: Collection[WatchedRun]) -> list[Item]:
    """Bodies that the scene is not about.

    It is about trees of bodies that are driven or couple with others, are set in motion, or of
    which code (`said`) names something; where there is none, about mechanisms rather than single
    free bodies; where there is none, about those with names. Where all are alike none is far.
    """
    model, tree = text.model, text.model.body_treeid
    needed = {value for one in text.elements for value in _references(one, said)} | set(said)
    needed |= {name.rstrip("0123456789") for name in needed}  # what is repeated has a number
    ranks = dict.fromkeys(_thrown(model, seen), 3)
    roots: dict[Element, list[int]] = {}
    for element, ids in text.things("body"):
        names = {one.get("name") for one in element.walk()} - {None, ""}
        for number in {int(tree[i]) for i in ids} - {-1}:
            free = model.tree_bodynum[number] == 1 and model.tree_dofnum[number] == 6
            rank = 3 if names & needed else 0 if free else 2
            ranks[number] = max(rank, ranks.get(number, 0), 1 if element.get("name") else 0)
            if int(model.tree_bodyadr[number]) in ids:
                roots.setdefault(element, []).append(number)
    most = max(ranks.values(), default=0)
    found = []
    for element, numbers in roots.items():
        looks = any(one.tag in ("camera", "light") for one in element.walk())
        if not looks and all(ranks[number] < most for number in numbers):
            gone = (element, *_referring(text, element))
            found.append(Item("far-body", display_name(element), element, gone, view="Body"))
    return found


_NOT_REFERENCES = frozenset(("name", "class", "childclass", "material", "mesh", "file", "type"))


def _references(element: Element, said: Collection[str]) -> Iterator[str]:
    """The names of things that an element needs; excluded pairs and unread sensors need none."""
    spare = section_of(element) in ("contact", "sensor") and element.get("name") not in said
    if not spare:
        yield from (one.value for one in element.attributes if one.name not in _NOT_REFERENCES)


def _referring(text: ModelText, body: Element) -> list[Element]:
    """Pairs and sensors of what is in a body, which go with it."""
    names = {one.get("name") for one in body.walk()} - {None, ""}
    return [
        one
        for one in text.elements
        if section_of(one) in ("contact", "sensor")
        and any(each.value in names for each in one.attributes if each.name != "name")
    ]


def _thrown(model: Any, seen: Collection[WatchedRun]) -> set[int]:
    """The trees that a scenario sets in motion."""
    found: set[int] = set()
    for case in (one.scene.scenario for one in seen):
        velocity = np.array(case.qvel)
        if not case.qvel and case.keyframe >= 0:
            velocity = model.key_qvel[case.keyframe]
        found |= set(model.dof_treeid[np.flatnonzero(velocity)].tolist())
    return found


_SETTINGS = {
    ("flag", "sleep", "enable"): "bodies at rest can sleep",
    ("flag", "island", "disable"): "all constraints can be solved at once, without islands",
    ("option", "solver", "Newton"): "the solver Newton does",
    ("option", "solver", "CG"): "the solver CG does",
    ("option", "cone", "pyramidal"): "pyramidal friction cones do",
    ("option", "cone", "elliptic"): "elliptic friction cones do",
}


def settings(text: ModelText, seen: Collection[WatchedRun]) -> list[Item]:
    """Other ways to compute the same, for a model in which a constraint was ever active."""
    if not any(one.constrained for one in seen):
        return []
    return [
        Item(name, value, None, edits=set_option(text.main, tag, name, value))
        for tag, name, value in _SETTINGS
    ]
