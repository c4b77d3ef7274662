"""What takes no part in what a scene shows, as far as runs can say: bodies and couplings.

1. What touched a body that can move and is left, at any time and along any chain, is no candidate,
   however little that seems to have changed.
2. What refers to a thing that goes, such as a sensor, goes with it.
"""

from __future__ import annotations

from collections.abc import Collection

import mujoco
import numpy as np

from mjbench.problem import Scenario
from mjbench.pruning.candidates import (
    Item,
    commanded_actuators,
    display_name,
    is_forceless_tendon,
)
from mjbench.pruning.comparison import WatchedRun
from mjbench.pruning.model_text import ModelText, section_of
from mjbench.pruning.xml_edits import Element
from mjbench.simulation import initial_data


def far_bodies(
    text: ModelText,
    code_names: Collection[str],
    scenarios: Collection[Scenario],
    runs: Collection[WatchedRun],
) -> list[Item]:
    """Bodies that the scene is not about.

    It is about trees of bodies that are driven or couple with others, are placed or set in motion
    by a scenario, or contain a name that code uses; where there are none, about mechanisms rather
    than single free bodies; where there are none, about those with names. Where all are alike none
    is far. Where some actuators get commands, the others drive nothing: at most they hold it.
    """
    model, tree = text.model, text.model.body_treeid
    commanded = commanded_actuators(model, scenarios)
    used_names = set(code_names)
    for inner in text.elements:
        section = section_of(inner)
        is_idle = section == "actuator" and commanded and commanded.isdisjoint(text.ids(inner))
        # Excluded pairs and unread sensors do not count either.
        is_optional = is_idle or section in ("contact", "sensor")
        if not is_optional or inner.get("name") in code_names:
            attributes = (a for a in inner.attributes if a.name not in _NOT_REFERENCES)
            used_names.update(attribute.value for attribute in attributes)
    used_names |= {
        name.rstrip("0123456789") for name in used_names
    }  # what is repeated has a number
    ranks: dict[int, int] = {}
    for case in scenarios:
        start, off = initial_data(case, model), np.zeros(model.nv)
        if case.qpos:  # a keyframe places all that there is
            mujoco.mj_differentiatePos(model, off, 1.0, model.qpos0, start.qpos)
        is_set = (np.abs(off) > _STILL) | (start.qvel != 0)
        ranks |= dict.fromkeys(model.dof_treeid[is_set].tolist(), 3)
    roots: dict[Element, list[int]] = {}
    for element, ids in text.things("body"):
        names = {inner.get("name") for inner in element.walk()} - {None, ""}
        for number in {int(tree[i]) for i in ids} - {-1}:
            is_free_body = model.tree_bodynum[number] == 1 and model.tree_dofnum[number] == 6
            rank = 3 if names & used_names else 0 if is_free_body else 2
            ranks[number] = max(rank, ranks.get(number, 0), 1 if element.get("name") else 0)
            if int(model.tree_bodyadr[number]) in ids:
                roots.setdefault(element, []).append(number)
    most = max(ranks.values(), default=0)
    far = {
        element: set(numbers)
        for element, numbers in roots.items()
        if all(ranks[number] < most for number in numbers)
        and not any(inner.tag in ("camera", "light") for inner in element.walk())
    }
    touching = {
        frozenset(tree[model.geom_bodyid[[*pair]]].tolist())
        for run in runs
        for pair in run.touching_pairs
    }
    while True:  # what touched a body that is left may have moved it, and so on
        far_trees = {number for numbers in far.values() for number in numbers}
        near = {
            number
            for trees in touching
            if -1 not in trees and len(trees & far_trees) == 1 < len(trees)
            for number in trees & far_trees
        }
        if not near:
            break
        far = {element: numbers for element, numbers in far.items() if not numbers & near}
    subjects = tuple(display_name(element) for element in roots if element not in far)
    return [
        Item(
            "far-body",
            display_name(element),
            element,
            (element, *_users(text, element, _REFERRING)),
            subjects=subjects,
        )
        for element in far
    ]


_REFERRING = ("contact", "sensor", "actuator")
_NOT_REFERENCES = frozenset(("name", "class", "childclass", "material", "mesh", "file", "type"))


def _users(
    text: ModelText,
    thing: Element,
    sections: Collection[str],
    references: str = "",
) -> list[Element]:
    """The elements of some sections that refer to something, and go with it.

    `references`: the attributes that may do so; any where none is named.
    """
    names = {element.get("name") for element in thing.walk()} - {None, ""}
    users = [
        element
        for element in text.elements
        if section_of(element) in sections
        and any(
            attribute.value in names
            for attribute in element.attributes
            if (
                attribute.name in references.split()
                if references
                else attribute.name not in _NOT_REFERENCES
            )
        )
    ]
    actuators = [user for user in users if section_of(user) == "actuator"]
    return users + [s for a in actuators for s in _users(text, a, ("sensor",), "actuator")]


_USERS = ("sensor", "actuator", "equality")
_OF_TENDONS = "tendon tendon1 tendon2"
"""Attributes that refer to tendons."""
_STILL = 1e-9
"""rad or m: a joint that begins so near to where it is drawn is not placed by a scenario."""


def couplings(text: ModelText) -> list[Item]:
    """Equalities, and tendons that could exert a force: each is tried, whatever it carries."""
    return [
        Item("coupling-idle", display_name(element), element, (element, *users))
        for kind in ("equality", "tendon")
        for element, ids in text.things(kind)
        if kind == "equality" or not is_forceless_tendon(text.model, ids)
        for users in [_users(text, element, _USERS, _OF_TENDONS) if kind == "tendon" else []]
        if not any(section_of(user) == "actuator" for user in users)
    ]
