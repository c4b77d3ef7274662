"""The settings of a scene to measure, and models that have them.

A setting is what can be chosen without changing the scene: every integrator at every timestep;
where a solver runs, also other solvers, fewer iterations and other options; where something
touches, also the other cone. These vary one at a time about the model's own, at its timestep and
at those beside it: the full product would take hours and say little more.
"""

from __future__ import annotations

from typing import Any

import mujoco
from msgspec.structs import replace

from mjbench import simulation
from mjbench.pilot import Pilot
from mjbench.problem import STANDARD, Integrator
from mjbench.reports.scene_report import MeasuredSetting

_SOLVERS = {
    "PGS": int(mujoco.mjtSolver.mjSOL_PGS),
    "CG": int(mujoco.mjtSolver.mjSOL_CG),
    "Newton": int(mujoco.mjtSolver.mjSOL_NEWTON),
}
CONES = {
    "pyramidal": int(mujoco.mjtCone.mjCONE_PYRAMIDAL),
    "elliptic": int(mujoco.mjtCone.mjCONE_ELLIPTIC),
}
_ITERATIONS, _QUICK_ITERATIONS = (1, 2, 4, 10, 30), (1, 4)
_OPTIONS: dict[str, dict[str, float]] = {
    "tolerance": {"0.01": 1e-2, "1e-4": 1e-4, "1e-6": 1e-6},
    "noslip_iterations": {"0": 0, "4": 4},
    "impratio": {"1": 1, "10": 10},
    "jacobian": {
        "dense": int(mujoco.mjtJacobian.mjJAC_DENSE),
        "sparse": int(mujoco.mjtJacobian.mjJAC_SPARSE),
    },
}
"""Options of the solver, and the values that are tried where they are not the model's own."""
_FLAGS = {
    "island": ("disableflags", int(mujoco.mjtDisableBit.mjDSBL_ISLAND)),
    "multiccd": ("disableflags", int(mujoco.mjtDisableBit.mjDSBL_MULTICCD)),
    "sleep": ("enableflags", int(mujoco.mjtEnableBit.mjENBL_SLEEP)),
}
"""Flags that are tried the other way, with their bits."""
_OF_CONTACTS = frozenset(("noslip_iterations", "impratio", "multiccd"))


def own_setting(model: Any, pilot: Pilot) -> MeasuredSetting:
    """The setting that the model has."""
    return MeasuredSetting(
        integrator=simulation.integrator_of(model).value,
        timestep=pilot.scene.timestep,
        solver=_name(_SOLVERS, int(model.opt.solver)) if pilot.constrained else "",
        iterations=int(model.opt.iterations) if pilot.constrained else 0,
        cone=_name(CONES, int(model.opt.cone)) if pilot.contact else "",
    )


def _name(names: dict[str, int], number: int) -> str:
    return next(name for name, value in names.items() if value == number)


def settings(model: Any, pilot: Pilot, *, quick: bool = False) -> tuple[MeasuredSetting, ...]:
    """All settings to measure, each once, the model's own among them."""
    baseline, ladder = own_setting(model, pilot), pilot.scene.timesteps
    variants = [
        replace(baseline, integrator=integrator.value, timestep=step)
        for integrator in STANDARD
        for step in reversed(ladder)
    ]
    own_index = ladder.index(pilot.scene.timestep)
    for step in (
        ladder[own_index : own_index + 1]
        if quick
        else ladder[max(0, own_index - 1) : own_index + 2]
    ):
        variants += _solving_variants(model, replace(baseline, timestep=step), pilot, quick=quick)
    return tuple(dict.fromkeys(variants))


def _solving_variants(
    model: Any, baseline: MeasuredSetting, pilot: Pilot, *, quick: bool
) -> list[MeasuredSetting]:
    """The settings at a timestep that differ from the model's own in one thing of its solver."""
    variants = [replace(baseline, cone=cone) for cone in CONES] if pilot.contact else []
    if not pilot.constrained:
        return variants
    variants += [replace(baseline, solver=solver) for solver in _SOLVERS]
    counts = _QUICK_ITERATIONS if quick else _ITERATIONS
    variants += [replace(baseline, iterations=n) for n in counts if n < baseline.iterations]
    if quick:
        return variants
    options = [
        (name, text)
        for name, values in _OPTIONS.items()
        for text, value in values.items()
        if value != getattr(model.opt, name)
        and (name != "tolerance" or value > model.opt.tolerance)
    ]
    for name, (field, bit) in _FLAGS.items():
        is_set = bool(getattr(model.opt, field) & bit)
        options.append((name, "enable" if is_set == (field == "disableflags") else "disable"))
    return variants + [
        replace(baseline, options=((name, text),))
        for name, text in options
        if pilot.contact or name not in _OF_CONTACTS
    ]


def apply(model: Any, setting: MeasuredSetting, own_model: Any) -> None:
    """Give a `mjModel` a setting; what is empty in it is as in `own_model`, the scene's."""
    for name in ("solver", "iterations", "cone", "disableflags", "enableflags", *_OPTIONS):
        setattr(model.opt, name, getattr(own_model.opt, name))
    simulation.set_integrator(model, Integrator(setting.integrator), setting.timestep)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    if setting.solver:
        model.opt.solver = _SOLVERS[setting.solver]
        model.opt.iterations = setting.iterations
    if setting.cone:
        model.opt.cone = CONES[setting.cone]
    for name, text in setting.options:
        if name in _OPTIONS:
            setattr(model.opt, name, _OPTIONS[name][text])
            continue
        field, bit = _FLAGS[name]
        is_set = (text == "enable") == (field == "enableflags")
        flags = int(getattr(model.opt, field))
        setattr(model.opt, field, flags | bit if is_set else flags & ~bit)


def with_setting(model: Any, setting: MeasuredSetting) -> Any:
    """A copy of a `mjModel` with a setting, and automatic reset off."""
    variant = simulation.with_integrator(model, Integrator(setting.integrator), setting.timestep)
    apply(variant, setting, model)
    return variant
