"""The settings that are measured in a scene: what can be chosen without changing the scene.

Entry points: `settings(model, pilot)`, `own_setting`, `apply`; `stable_rows(model, pilot)`, the
largest stable timestep of each integrator.

Every integrator at every timestep; where a solver runs, also other solvers and fewer iterations;
where something touches, also the other cone. These vary one at a time about the model's own: the
full product would take hours and say little more.
"""

from __future__ import annotations

from typing import Any

import mujoco
from msgspec.structs import replace

from coursebuild.numerics.engine import integrator_of, set_integrator, with_integrator
from coursebuild.numerics.pilot import Pilot
from coursebuild.numerics.problem import STANDARD, Integrator
from coursebuild.numerics.reports.bench import MeasuredSetting, StableRow
from coursebuild.numerics.reports.text import FEWEST_STEPS
from coursebuild.numerics.scene import thickness
from coursebuild.numerics.stability import MOST_STEPS, StabilityTrial, run_trial, scan, stable_row

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
_SEARCH = (0.25, 64.0)
"""The multiples of the model's timestep between which the largest stable one is searched for."""


def own_setting(model: Any, pilot: Pilot) -> MeasuredSetting:
    """The setting that the model has."""
    return MeasuredSetting(
        integrator=integrator_of(model).value,
        timestep=pilot.scene.timestep,
        solver=_name(_SOLVERS, int(model.opt.solver)) if pilot.constrained else "",
        iterations=int(model.opt.iterations) if pilot.constrained else 0,
        cone=_name(CONES, int(model.opt.cone)) if pilot.contact else "",
    )


def _name(names: dict[str, int], number: int) -> str:
    return next(name for name, value in names.items() if value == number)


def settings(model: Any, pilot: Pilot, *, quick: bool = False) -> tuple[MeasuredSetting, ...]:
    """All settings to measure, each once, the model's own among them."""
    baseline = own_setting(model, pilot)
    variants = [
        replace(baseline, integrator=integrator.value, timestep=step)
        for integrator in STANDARD
        for step in reversed(pilot.scene.timesteps)
    ]
    if pilot.contact:
        variants += [replace(baseline, cone=cone) for cone in CONES]
    if pilot.constrained:
        variants += [replace(baseline, solver=solver) for solver in _SOLVERS]
        counts = _QUICK_ITERATIONS if quick else _ITERATIONS
        variants += [replace(baseline, iterations=n) for n in counts if n < baseline.iterations]
    return tuple(dict.fromkeys(variants))


def apply(model: Any, setting: MeasuredSetting) -> None:
    """Give a `mjModel` a setting; what is empty in it stays as it is."""
    set_integrator(model, Integrator(setting.integrator), setting.timestep)
    if setting.solver:
        model.opt.solver = _SOLVERS[setting.solver]
        model.opt.iterations = setting.iterations
    if setting.cone:
        model.opt.cone = CONES[setting.cone]


def with_setting(model: Any, setting: MeasuredSetting) -> Any:
    """A copy of a `mjModel` with a setting, and automatic reset off."""
    variant = with_integrator(model, Integrator(setting.integrator), setting.timestep)
    apply(variant, setting)
    return variant


def stable_rows(model: Any, pilot: Pilot, *, quick: bool = False) -> tuple[StableRow, ...]:
    """The largest stable timestep of every integrator, over the scenario.

    They are searched for as those of the hard cases. No timestep is tried of which the scenario
    has fewer than 20: so few steps would say nothing.
    """
    duration = pilot.scene.scenario.duration
    low, high = (part * pilot.scene.timestep for part in _SEARCH)
    search = (max(low, duration / MOST_STEPS), min(high, duration / FEWEST_STEPS))
    if search[1] <= search[0]:
        return ()
    half_thickness = thickness(model)

    def row(integrator: Integrator) -> StableRow:
        def attempt(step: float) -> StabilityTrial:
            return run_trial(
                pilot.setup, with_integrator(model, integrator, step), duration, half_thickness
            )

        return stable_row(integrator, scan(attempt, search, quick=quick), pilot.setup, duration)

    return tuple(map(row, STANDARD))
