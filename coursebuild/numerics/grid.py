"""The settings that are measured in a scene: what can be chosen without changing the scene.

Entry points: `settings(model, scene, pilot)`, `own_setting`, `apply`.

Every integrator at every timestep; where a solver runs, also other solvers and fewer iterations;
where something touches, also the other cone. These vary one at a time about the model's own: the
full product would take hours and say little more.
"""

from __future__ import annotations

from typing import Any

import mujoco
from msgspec.structs import replace

from coursebuild.numerics.engine import choose
from coursebuild.numerics.pilot import OWN, Pilot
from coursebuild.numerics.problem import STANDARD, Integrator
from coursebuild.numerics.reports.bench import Setting
from coursebuild.numerics.scene import Scene

_SOLVERS = {
    "PGS": int(mujoco.mjtSolver.mjSOL_PGS),
    "CG": int(mujoco.mjtSolver.mjSOL_CG),
    "Newton": int(mujoco.mjtSolver.mjSOL_NEWTON),
}
_CONES = {
    "pyramidal": int(mujoco.mjtCone.mjCONE_PYRAMIDAL),
    "elliptic": int(mujoco.mjtCone.mjCONE_ELLIPTIC),
}
_ITERATIONS, _QUICK_ITERATIONS = (1, 2, 4, 10, 30), (1, 4)


def own_setting(model: Any, scene: Scene, first: Pilot) -> Setting:
    """The setting that the model has."""
    return Setting(
        integrator=OWN[int(model.opt.integrator)].value,
        timestep=scene.own,
        solver=_name(_SOLVERS, int(model.opt.solver)) if first.constrained else "",
        iterations=int(model.opt.iterations) if first.constrained else 0,
        cone=_name(_CONES, int(model.opt.cone)) if first.contact else "",
    )


def _name(names: dict[str, int], number: int) -> str:
    return next(name for name, value in names.items() if value == number)


def settings(model: Any, scene: Scene, first: Pilot, *, quick: bool = False) -> tuple[Setting, ...]:
    """All settings to measure, each once, the model's own among them."""
    own = own_setting(model, scene, first)
    found = [
        replace(own, integrator=integrator.value, timestep=step)
        for integrator in STANDARD
        for step in reversed(scene.timesteps)
    ]
    if first.contact:
        found += [replace(own, cone=cone) for cone in _CONES]
    if first.constrained:
        found += [replace(own, solver=solver) for solver in _SOLVERS]
        counts = _QUICK_ITERATIONS if quick else _ITERATIONS
        found += [replace(own, iterations=n) for n in counts if n < own.iterations]
    return tuple(dict.fromkeys(found))


def apply(model: Any, setting: Setting) -> None:
    """Give a `mjModel` a setting; what is empty in it stays as it is."""
    choose(model, Integrator(setting.integrator), setting.timestep)
    if setting.solver:
        model.opt.solver = _SOLVERS[setting.solver]
        model.opt.iterations = setting.iterations
    if setting.cone:
        model.opt.cone = _CONES[setting.cone]
