"""What takes part in the motion and need not, and other ways to the same motion.

Entry points: `idle(look)`, actuators, tendons and fluid without effect; `collisions(look)`,
contacts that are searched for in vain; `settings(look)`, of the engine.

1. Where a bound says that no two geoms can touch, contact can be off. Where it says so of single
   geoms these need not take part. Where there is no such bound and nothing touched in the runs,
   that is said too, as the weaker thing that it is.
2. With settings nothing is in vain: each is another way to the same motion, and only the time that
   it saves speaks for it. The integrator and the timestep are not among them: what they change is
   an error, and is judged against a reference, never against the model as it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Any

import mujoco
import numpy as np

from coursebuild.numerics.pruning.edits import set_attributes
from coursebuild.numerics.pruning.reachability import Pair, each_pair, separate
from coursebuild.numerics.pruning.trials import (
    Candidate,
    Item,
    PruningContext,
    called,
    named_item,
    worded,
)

_NO_BIAS = int(mujoco.mjtBias.mjBIAS_NONE)
_NO_DYNAMICS = int(mujoco.mjtDyn.mjDYN_NONE)
_FIXED_GAIN = int(mujoco.mjtGain.mjGAIN_FIXED)
_AFFINE_GAIN = int(mujoco.mjtGain.mjGAIN_AFFINE)


def idle(look: PruningContext) -> Iterator[Candidate]:
    """Actuators that nobody commands, tendons without a force, fluid that nothing feels."""
    yield from _actuators(look)
    yield from _tendons(look)
    yield from _fluid(look)


def _tendons(look: PruningContext) -> Iterator[Candidate]:
    """Tendons along which nothing acts, and whose length nobody asks for."""
    if look.readers.whole("tendon"):
        return
    items: list[Item] = []
    for element, ids in look.things("tendon"):
        name = element.get("name") or ""
        needed = look.users(name, _TENDON) or look.readers.named(name)
        if not needed and all(_slack(look.model, number) for number in ids):
            items.append(named_item(element))
    if items:
        message = worded(
            items,
            "nothing acts along the tendon {}, and nobody reads its length",
            "nothing acts along the tendons {}, and nobody reads their lengths",
        )
        proof = "it has no stiffness, damping, friction, inertia or limit, and nothing refers to it"
        yield Candidate("tendon-idle", message, tuple(items), proof)


_TENDON = frozenset(("tendon", "tendon1", "tendon2", "objname", "refname"))
"""Attributes that may name a tendon."""
_FORCES = (
    *("stiffness", "stiffnesspoly", "damping", "dampingpoly", "frictionloss", "armature"),
    "limited",
)
"""What makes a tendon exert a force of its own."""


def _slack(model: Any, number: int) -> bool:
    return not any(np.any(getattr(model, f"tendon_{name}")[number]) for name in _FORCES)


def _actuators(look: PruningContext) -> Iterator[Candidate]:
    if look.readers.whole("actuator"):
        return
    driven = _driven(look)
    free: list[Item] = []
    held: list[Item] = []
    for element, ids in look.things("actuator"):
        if look.readers.named(element.get("name") or "") or not driven.isdisjoint(ids):
            continue
        item = named_item(element)
        (free if all(_forceless(look.model, i) for i in ids) else held).append(item)
    blocked = ""
    if "controls" in look.numbered:
        blocked = "scenarios give commands by number: their rows would have to be shortened"
    said = "nobody commands the actuator {}", "nobody commands the actuators {}"
    if free:
        proof = "its force is a multiple of a command that is always 0"
        message = worded(free, *said)
        yield Candidate("actuator-idle", message, tuple(free), proof, blocked=blocked)
    if held:
        message = worded(held, *said) + ", and no force came of " + worded(held, "it", "them")
        yield Candidate("actuator-idle", message, tuple(held), blocked=blocked)


def _driven(look: PruningContext) -> set[int]:
    """Actuators that get a command other than 0 in a scenario or a keyframe."""
    model = look.model
    found: set[int] = set()
    for key in range(model.nkey):
        found |= set(np.nonzero(model.key_ctrl[key])[0].tolist())
    for seen in look.seen:
        for row in seen.scene.scenario.controls:
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
    for name in ("ctrl", "force"):
        low, high = getattr(model, f"actuator_{name}range")[number]
        if getattr(model, f"actuator_{name}limited")[number] and (low > 0 or high < 0):
            return True
    return False


def _fluid(look: PruningContext) -> Iterator[Candidate]:
    opt, names = look.model.opt, ("density", "viscosity", "wind")
    having = {
        name: one
        for name in names
        for one in look.elements
        if one.tag == "option" and one.attribute(name) is not None
    }
    if not having or any(look.readers.named(name) for name in names):
        return
    if opt.density != 0 or opt.viscosity != 0:
        item = Item("fluid", next(iter(having.values())), options=tuple((n, None) for n in having))
        proof = "" if look.model.nv else "nothing moves"
        yield Candidate("fluid", "no body feels the fluid", (item,), proof)
    elif np.any(opt.wind != 0):
        item = Item("wind", having["wind"], options=(("wind", None),))
        proof = "wind acts through a density or a viscosity, and both are 0"
        yield Candidate("fluid", "there is wind in a vacuum", (item,), proof)


# --------------------------------------------------------------------------------------- collisions

_OFF = (("contact", "disable"),)
MOST_PAIRS = 100_000
"""Pairs beyond which nothing is proved of them."""


def collisions(look: PruningContext) -> Iterator[Candidate]:
    """Contact as a whole, or geoms that can touch nothing."""
    model = look.model
    pairs = frozenset(islice(each_pair(model), MOST_PAIRS))
    if model.nflex or not pairs:
        return
    apart = separate(model, pairs) if len(pairs) < MOST_PAIRS else frozenset()
    changed = look.readers.whole("shape")
    proof = "" if changed else f"none of {_pairs(pairs)} can meet, whatever the joints do"
    item = Item("contact", None, flags=_OFF)
    if apart == pairs:
        message = "contacts are searched for, and nothing can touch"
        yield Candidate("contact-off", message, (item,), proof)
        return
    if look.seen and not any(seen.touching for seen in look.seen):
        message = "contacts are searched for, and nothing touched"
        yield Candidate("contact-off", message, (item,))
    if not changed:
        yield from _geoms(look, pairs, apart)


def _pairs(pairs: frozenset[Pair]) -> str:
    return f"{len(pairs)} pairs of geoms" if len(pairs) != 1 else "1 pair of geoms"


def _geoms(
    look: PruningContext, pairs: frozenset[Pair], apart: frozenset[Pair]
) -> Iterator[Candidate]:
    near = {geom for pair in pairs - apart for geom in pair}
    far = {geom for pair in apart for geom in pair} - near
    explicit = {int(g) for g in (*look.model.pair_geom1, *look.model.pair_geom2)}
    items = []
    for element, ids in look.things("geom"):
        if far.issuperset(ids) and explicit.isdisjoint(ids):
            edits = set_attributes(element, (("contype", "0"), ("conaffinity", "0")))
            items.append(Item(called(element), element, edits=edits))
    if items:
        what = worded(items, "the geom {}", "the geoms {}")
        yield Candidate(
            "collision-unreachable",
            f"contacts are searched for on {what}, which can touch nothing",
            tuple(items),
            "whatever the joints do, every geom that they could collide with is out of reach",
        )


# ----------------------------------------------------------------------------------------- settings

_SOLVERS = {0: "PGS", 1: "CG", 2: "Newton"}
_TOLERANCE = 1e-6


def settings(look: PruningContext) -> Iterator[Candidate]:
    """Other settings, for a model in which a constraint was ever active."""
    model = look.model
    if not any(seen.constrained for seen in look.seen):
        return
    solver = _SOLVERS.get(int(model.opt.solver), "")
    for other in ("Newton", "CG"):
        if other != solver:
            yield _option("solver", f"the solver {other} does", "solver", other)
    if next(each_pair(model), None) is not None:
        elliptic = int(model.opt.cone) == int(mujoco.mjtCone.mjCONE_ELLIPTIC)
        other = "pyramidal" if elliptic else "elliptic"
        yield _option("cone", f"{other} friction cones do", "cone", other)
        yield from _dimensions(look)
    if float(model.opt.tolerance) < _TOLERANCE:
        said = f"a solver tolerance of {_TOLERANCE:g} does"
        yield _option("tolerance", said, "tolerance", f"{_TOLERANCE:g}")
    most = max(seen.iterations for seen in look.seen)
    if 0 < most < int(model.opt.iterations):
        said = f"the solver never took more than {most} iterations"
        yield _option("iterations", said, "iterations", str(most))
    disabled = int(model.opt.disableflags)
    if not disabled & int(mujoco.mjtDisableBit.mjDSBL_ISLAND):
        said = "solving all constraints at once, without islands, does"
        yield _flag("island", said, "island", "disable")
    if not int(model.opt.enableflags) & int(mujoco.mjtEnableBit.mjENBL_SLEEP):
        yield _flag("sleep", "bodies at rest can sleep", "sleep", "enable")


def _option(kind: str, message: str, name: str, value: str) -> Candidate:
    return Candidate(kind, message, (Item(value, None, options=((name, value),)),), is_setting=True)


def _flag(kind: str, message: str, name: str, value: str) -> Candidate:
    return Candidate(kind, message, (Item(kind, None, flags=((name, value),)),), is_setting=True)


def _dimensions(look: PruningContext) -> Iterator[Candidate]:
    """Contacts without rolling or torsional friction, and without any."""
    having = [
        one
        for one in look.elements
        if one.tag in ("geom", "pair") and (one.get("condim") or "") in ("3", "4", "6")
    ]
    for least, said in (("3", "no torsional or rolling friction"), ("1", "no friction")):
        chosen = [one for one in having if int(one.get("condim") or 0) > int(least)]
        edits = tuple(e for one in chosen for e in set_attributes(one, (("condim", least),)))
        if edits:
            item = Item(f"condim {least}", chosen[0], edits=edits)
            message = f"contacts with {said} do"
            yield Candidate("condim", message, (item,), is_setting=True)
