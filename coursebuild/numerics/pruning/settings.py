"""Settings of the engine that may cost more than they give: solver, cone, sleep and others.

Entry point: `settings(look)`.

Nothing is in vain here: each is another way to the same motion, and only the time that it saves
speaks for it. The integrator and the timestep are not among them: what they change is an error, and
is judged against a reference, never against the model as it is (`coursebuild bench`).
"""

from __future__ import annotations

from collections.abc import Iterator

import mujoco

from coursebuild.numerics.pruning.candidates import Candidate, Item, Look
from coursebuild.numerics.pruning.edits import set_attributes
from coursebuild.numerics.pruning.reachability import each_pair

_SOLVERS = {0: "PGS", 1: "CG", 2: "Newton"}
_TOLERANCE = 1e-6


def settings(look: Look) -> Iterator[Candidate]:
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


def _dimensions(look: Look) -> Iterator[Candidate]:
    """Contacts without rolling or torsional friction, and without any."""
    having = [
        one
        for one in look.scene.elements
        if one.tag in ("geom", "pair") and (one.get("condim") or "") in ("3", "4", "6")
    ]
    for least, said in (("3", "no torsional or rolling friction"), ("1", "no friction")):
        chosen = [one for one in having if int(one.get("condim") or 0) > int(least)]
        edits = tuple(e for one in chosen for e in set_attributes(one, (("condim", least),)))
        if edits:
            item = Item(f"condim {least}", chosen[0], edits=edits)
            message = f"contacts with {said} do"
            yield Candidate("condim", message, (item,), is_setting=True)
