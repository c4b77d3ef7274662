"""What takes part in the motion, and need not: idle actuators, fluid, things out of reach.

Entry point: `idle(look)`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

from coursebuild.numerics.pruning.candidates import Candidate, Item, Look, named_item
from coursebuild.numerics.pruning.markup import Element
from coursebuild.numerics.pruning.model_text import thing_kind

_NO_BIAS = int(mujoco.mjtBias.mjBIAS_NONE)
_NO_DYNAMICS = int(mujoco.mjtDyn.mjDYN_NONE)
_FIXED_GAIN = int(mujoco.mjtGain.mjGAIN_FIXED)
_AFFINE_GAIN = int(mujoco.mjtGain.mjGAIN_AFFINE)


def idle(look: Look) -> Iterator[Candidate]:
    """Actuators that nobody commands, tendons without a force, fluid that nothing feels."""
    yield from _actuators(look)
    yield from _tendons(look)
    yield from _fluid(look)


def _tendons(look: Look) -> Iterator[Candidate]:
    """Tendons along which nothing acts, and whose length nobody asks for."""
    if look.readers.whole("tendon"):
        return
    used = {
        attribute.value
        for one in look.scene.elements
        for attribute in one.attributes
        if attribute.name in _TENDON
    }
    items: list[Item] = []
    for element in look.scene.elements:
        thing, name = look.scene.ids(element), element.get("name") or ""
        if thing is None or thing.kind != "tendon" or name in used or look.readers.named(name):
            continue
        if all(_slack(look.model, number) for number in thing.ids):
            items.append(named_item(element))
    if items:
        what = "the tendon {}, and nobody reads its length"
        if len(items) > 1:
            what = "the tendons {}, and nobody reads their lengths"
        proof = "it has no stiffness, damping, friction, inertia or limit, and nothing refers to it"
        yield Candidate("tendon-idle", f"nothing acts along {what}", tuple(items), proof)


_TENDON = frozenset(("tendon", "tendon1", "tendon2", "objname", "refname"))
"""Attributes that may name a tendon."""


def _slack(model: Any, number: int) -> bool:
    """Whether a tendon exerts no force of its own."""
    return not any(
        np.any(values[number])
        for values in (
            model.tendon_stiffness,
            model.tendon_stiffnesspoly,
            model.tendon_damping,
            model.tendon_dampingpoly,
            model.tendon_frictionloss,
            model.tendon_armature,
            model.tendon_limited,
        )
    )


def _actuators(look: Look) -> Iterator[Candidate]:
    if look.readers.whole("actuator"):
        return
    driven = _driven(look)
    elements = [one for one in look.scene.elements if thing_kind(one) == "actuator"]
    free: list[Item] = []
    held: list[Item] = []
    for element in elements:
        thing = look.scene.ids(element)
        if thing is None or look.readers.named(element.get("name") or ""):
            continue
        if any(number in driven for number in thing.ids):
            continue
        item = named_item(element)
        (free if all(_forceless(look.model, i) for i in thing.ids) else held).append(item)
    blocked = ""
    if "controls" in look.numbered:
        blocked = "scenarios give commands by number: their rows would have to be shortened"
    said = "nobody commands the actuator{}"
    if free:
        proof = "its force is a multiple of a command that is always 0"
        message = said.replace("{}", " {}" if len(free) == 1 else "s {}")
        yield Candidate("actuator-idle", message, tuple(free), proof, blocked=blocked)
    if held:
        message = said.replace("{}", " {}" if len(held) == 1 else "s {}")
        message += ", and no force came of " + ("it" if len(held) == 1 else "them")
        yield Candidate("actuator-idle", message, tuple(held), blocked=blocked)


def _driven(look: Look) -> set[int]:
    """Actuators that get a command other than 0 in a scenario or a keyframe."""
    model = look.model
    found: set[int] = set()
    for key in range(model.nkey):
        found |= set(np.nonzero(model.key_ctrl[key])[0].tolist())
    for seen in look.seen:
        for row in seen.case.scenario.controls:
            found |= set(np.nonzero(np.array(row))[0].tolist())
    return found


def _forceless(model: Any, number: int) -> bool:
    """Whether a command of 0 gives no force, in any state."""
    return bool(
        model.actuator_biastype[number] == _NO_BIAS
        and model.actuator_dyntype[number] == _NO_DYNAMICS
        and model.actuator_gaintype[number] in (_FIXED_GAIN, _AFFINE_GAIN)
        and not _excludes_zero(model, number)
    )


def _excludes_zero(model: Any, number: int) -> bool:
    """Whether a range would raise a command or a force of 0."""
    ranges = []
    if model.actuator_ctrllimited[number]:
        ranges.append(model.actuator_ctrlrange[number])
    if model.actuator_forcelimited[number]:
        ranges.append(model.actuator_forcerange[number])
    return any(low > 0 or high < 0 for low, high in ranges)


def _fluid(look: Look) -> Iterator[Candidate]:
    model = look.model
    options = [one for one in look.scene.elements if one.tag == "option"]
    having = {
        name: one for name in ("density", "viscosity", "wind") for one in options if _has(one, name)
    }
    if not having:
        return
    dense = model.opt.density != 0 or model.opt.viscosity != 0
    windy = bool(np.any(model.opt.wind != 0))
    if look.readers.named("density") or look.readers.named("viscosity"):
        return
    if look.readers.named("wind"):
        return
    if not dense and windy:
        item = Item("wind", having["wind"], options=(("wind", None),))
        proof = "wind acts through a density or a viscosity, and both are 0"
        yield Candidate("fluid", "there is wind in a vacuum", (item,), proof)
    elif dense:
        names = tuple(having)
        item = Item("fluid", having[names[0]], options=tuple((name, None) for name in names))
        proof = "" if model.nv else "nothing moves"
        yield Candidate("fluid", "no body feels the fluid", (item,), proof)


def _has(element: Element, name: str) -> bool:
    return element.attribute(name) is not None
