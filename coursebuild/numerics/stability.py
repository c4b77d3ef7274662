"""The largest stable timestep for each integrator, how a run grows beyond, and other settings.

Entry points: `boundaries(problem)`, of a hard case; `stable_rows(model, pilot)`, of a scene;
`with_energy_bound(problem)`; `settings(model, pilot)`, which are measured in a scene,
`own_setting`, `apply`.

1. Stable is what stays within what can be over a simulated time that is the same for all timesteps,
   by the judgement that every run gets: finite, within bounds, and where nothing drives the motion,
   without much more energy than it has in small steps. What is just beyond a boundary grows slowly,
   so the time sets the resolution.
2. Stability need not be monotone. The largest stable timestep is the largest below which all that
   were tried are stable: a grid, even in the logarithm, down to a tenth of it; a bisection at its
   end; then others just below, which lie the closer the nearer they are. Where one of these is
   lost, the search goes on below it.
3. A setting is what can be chosen without changing the scene: every integrator at every timestep;
   where a solver runs, also other solvers and fewer iterations; where something touches, also the
   other cone. These vary one at a time about the model's own: the full product would take hours and
   say little more.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import asdict, replace

from coursebuild.numerics.detector import Peaks, RunStatus, driving_force, judge
from coursebuild.numerics.pilot import Pilot
from coursebuild.numerics.problem import (
    STANDARD,
    Array,
    Integrator,
    Limit,
    Problem,
    Setup,
)
from coursebuild.numerics.reports.case_report import BoundaryLine
from coursebuild.numerics.reports.scene_report import MeasuredSetting, StableRow
from coursebuild.numerics.reports.shown_errors import FEWEST_STEPS
from coursebuild.numerics.scene import thickness
from coursebuild.numerics.simulation import (
    advance_watching,
    compile_model,
    initial_data,
    integrator_of,
    set_integrator,
    simulate,
    with_integrator,
)

_REACH = 10.0
"""The grid is tried down to this part of the largest stable timestep."""
_NEAREST, _FARTHEST = 1e-3, 0.5
"""The relative distances below it between which others are tried."""
MOST_STEPS = 200_000
"""The most steps of one run."""
_PARTS, _LOOKS = 20, 1000
"""How often a run is looked at: for its growth, and for whether it is lost."""
_SMALL_STEPS = 100_000
"""Steps of the run that says how much energy there can be, at most."""
_DENSE, _QUICK = (24, 32, 1e-4), (6, 8, 1e-2)
"""The numbers of timesteps that are tried in a decade and just below the largest stable one, and
the relative width at which the bisection ends."""


class StabilityTrial(Struct, frozen=True):
    """A run at one timestep."""

    timestep: float
    """s."""
    status: RunStatus
    growth: float
    """The factor by which velocities grow in a step, from half the run to its end; NaN where the
    run was lost before."""

    @property
    def stable(self) -> bool:
        """Whether the run stayed within what can be."""
        return self.status is RunStatus.OK


def boundaries(problem: Problem) -> tuple[BoundaryLine, ...]:
    """The boundaries of all integrators for which they may differ.

    None where the problem names no timesteps to look between.
    """
    if problem.search is None:
        return ()
    # Only joints with damping know `eulerdamp`.
    damped = bool(np.any(compile_model(problem.mjcf, Integrator.EULER, 1e-3).dof_damping))
    problem = with_energy_bound(problem)
    return tuple(
        boundary(problem, integrator) for integrator in (Integrator if damped else STANDARD)
    )


def with_energy_bound(problem: Problem) -> Problem:
    """The problem with a bound of its energy, from its motion in small steps over its span."""
    if driving_force(compile_model(problem.mjcf, Integrator.RK4, 1e-3), problem.scenario):
        return problem
    step, scenario = min(problem.timesteps), problem.scenario
    looks = math.floor(min(problem.span, _SMALL_STEPS * step) / scenario.sample)
    duration = max(looks * scenario.sample, scenario.duration)
    longer = replace(problem, scenario=replace(scenario, duration=duration))
    energy = simulate(longer, compile_model(problem.mjcf, Integrator.RK4, step)).energy
    most = energy.sum(axis=1).max() + problem.room * energy[:, 1].max()
    return replace(problem, energy_bound=float(most))


def boundary(problem: Problem, integrator: Integrator) -> BoundaryLine:
    """Search for the largest stable timestep of a problem with a search interval."""
    assert problem.search is not None
    low, high = problem.search
    search = max(low, problem.span / MOST_STEPS), high
    trials = scan(lambda step: attempt(problem, integrator, step), search)
    row = stable_row(integrator, trials, problem, problem.span)
    theory = None if problem.limit is None else problem.limit(integrator)
    lost = _first_lost(trials)
    return BoundaryLine(
        **asdict(row),
        theory=None if theory is None else _finite(theory.timestep),
        formula="" if theory is None else theory.source,
        difference=_difference(row.largest, theory),
        beyond="" if lost is None else lost.status.value,
        growth=None if lost is None else _finite(lost.growth),
    )


def _difference(largest: float | None, theory: Limit | None) -> float | None:
    """Measured against theory, relative; `None` where one of them is not finite, or 0."""
    if theory is None or not largest or not 0 < theory.timestep < math.inf:
        return None
    return largest / theory.timestep - 1


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def scan(
    attempt: Callable[[float], StabilityTrial],
    search: tuple[float, float],
    *,
    quick: bool = False,
) -> tuple[StabilityTrial, ...]:
    """Search for the largest stable timestep between two (s); all trials, by rising timestep."""
    low, high = search
    in_a_decade, near_count, resolution = _QUICK if quick else _DENSE
    count = max(2, round(in_a_decade * math.log10(high / low)) + 1)
    grid = np.geomspace(low, high, count).tolist()
    trials: dict[float, StabilityTrial] = {}
    while (step := _next_timestep(trials, grid, near_count, resolution)) is not None:
        trials[step] = attempt(step)
    return tuple(trials[step] for step in sorted(trials))


def _first_lost(trials: Sequence[StabilityTrial]) -> StabilityTrial | None:
    return next((trial for trial in trials if not trial.stable), None)


def _next_timestep(
    trials: Mapping[float, StabilityTrial], grid: list[float], near_count: int, resolution: float
) -> float | None:
    """The timestep to try next; `None` when the largest stable one is known."""
    lost = min((step for step, trial in trials.items() if not trial.stable), default=math.inf)
    least = 0.0 if math.isinf(lost) else lost / _REACH
    fresh = [step for step in grid if step >= least and step not in trials]
    stable = max((step for step in trials if step < lost), default=0.0)
    if not fresh and stable and not math.isinf(lost):
        if lost / stable > 1 + resolution:
            return math.sqrt(lost * stable)
        shorter = [stable * (1 - x) for x in np.geomspace(_NEAREST, _FARTHEST, near_count).tolist()]
        fresh = [step for step in shorter if step > grid[0] and step not in trials]
    return max(fresh, default=None)


def stable_row(
    integrator: Integrator, trials: Sequence[StabilityTrial], setup: Setup, span: float
) -> StableRow:
    """The row of an integrator from the trials of a search, over a span (s) of simulated time."""
    steps = [trial.timestep for trial in trials]
    stable_steps, largest, lost = steps, None, _first_lost(trials)
    if lost is not None:
        stable_steps = [step for step in steps if step < lost.timestep]
        largest = max(stable_steps, default=0.0)
    islands = [trial.timestep for trial in trials[len(stable_steps) :] if trial.stable]
    return StableRow(
        integrator=integrator.value,
        largest=largest,
        searched=(steps[0], steps[-1]),
        islands=(islands[0], islands[-1]) if islands else None,
        duration=span,
        steps=step_count(span, max(stable_steps, default=steps[0])),
        tried=len(stable_steps),
        energy=_finite(setup.energy_bound),
    )


def step_count(span: float, timestep: float) -> int:
    """Steps that make up a span, both in s."""
    return math.ceil(span / timestep * (1 - 1e-12))


def attempt(problem: Problem, integrator: Integrator, timestep: float) -> StabilityTrial:
    """Run the problem over its span at a timestep (s)."""
    return run_trial(problem, compile_model(problem.mjcf, integrator, timestep), problem.span)


def run_trial(
    setup: Setup, model: Any, span: float, thickness: Array | None = None
) -> StabilityTrial:
    """Run a model over a span (s) with its own timestep, or until it is lost.

    `thickness` is as for `detector.update_peaks`. A command changes with the first step that begins
    after its time: the timestep need not divide the hold.
    """
    data = initial_data(setup.scenario, model)
    timestep = float(model.opt.timestep)
    steps = step_count(span, timestep)
    interval = max(8, steps // _LOOKS)
    commands = {
        min(math.ceil(begin / timestep - 1e-9), steps): command
        for begin, _, command in setup.scenario.holds(span)
    }
    looks = {steps * part // _PARTS for part in range(_PARTS + 1)}
    sizes: list[tuple[int, float]] = []
    peaks, total = Peaks(), 0
    for begin, end in itertools.pairwise(sorted(looks.union(commands))):
        if commands.get(begin):
            data.ctrl[:] = commands[begin]
        try:
            peaks, steps_made = advance_watching(
                model, data, end - begin, peaks, thickness, interval=interval, setup=setup
            )
        except mujoco.FatalError:  # MuJoCo does not run it
            return StabilityTrial(timestep, RunStatus.DIVERGED, math.nan)
        total += steps_made
        with np.errstate(over="ignore"):
            sizes.append((total, float(np.linalg.norm(data.qvel))))
        if not peaks.is_within(setup):
            break
    judgement = judge(model, data, total * timestep, peaks, setup)
    return StabilityTrial(timestep, judgement.status, _growth(sizes))


def _growth(sizes: list[tuple[int, float]]) -> float:
    if len(sizes) < 2:
        return math.nan
    (before, small), (after, large) = sizes[len(sizes) // 2 - 1], sizes[-1]
    if not 0 < small < math.inf or not 0 < large < math.inf:
        return math.nan
    return float((large / small) ** (1 / (after - before)))


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
