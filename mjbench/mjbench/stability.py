"""A laboratory of stability: largest timesteps by integrator, and what ends there.

1. Three things can end, each at a timestep of its own. *Bounded* is what stays within what can be
   over a simulated time that is the same for all timesteps: finite, within bounds, and where
   nothing drives the motion, without much more energy than it has in small steps. What shoots up
   in the first steps and then decays is a transient of the method and no loss. *Near* is what stays
   near the motion that small steps keep, as long as that can be predicted. *Through* is what comes
   out on the other side of something, or stays inside it: how deep it goes is no loss by itself.
2. One limit has several answers, which need not agree: theory at rest; runs from the own start over
   the span, and over twice the span; runs from starts nearby. Only digits on which they agree are
   shown. Theory is asked only where the scenario comes near to that rest.
3. Stability need not be monotone. A grid, even in the logarithm, is tried down to a tenth of the
   shortest timestep that is lost, and about it from all starts; a bisection follows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Any

import numpy as np
from msgspec import Struct, field
from msgspec.structs import replace

from mjbench.detector import Passages, driving_force
from mjbench.linearization import Theory, find_theory
from mjbench.parts import Parts
from mjbench.pilot import MOST_STEPS, Pilot, longer_setup, position_distance
from mjbench.problem import (
    STANDARD,
    Array,
    Integrator,
    Problem,
    Setup,
)
from mjbench.reports import Reach, reach
from mjbench.reports.scene_report import StableRow
from mjbench.reports.shown_errors import FEWEST_STEPS
from mjbench.simulation import (
    EngineStates,
    compile_model,
    integrator_of,
    simulate,
    with_integrator,
)
from mjbench.stability_runs import (
    QUICK_STARTS,
    STARTS,
    KeptMotion,
    StabilityTrial,
    bisect,
    kept_motion,
    run_trial,
)

_NEAR = 2.0
"""How many times below and beyond the shortest timestep that is lost others are tried from starts
nearby."""
_GRID, _FINE, _CLOSER = 16, 1e-4, 32
_QUICK_GRID, _COARSE, _QUICK_CLOSER = 6, 1e-2, 8
"""The timesteps that are tried in a decade, the relative width at which a bisection ends, and the
timesteps that are tried from half the limit up to it."""
_SMALL_STEPS = 100_000
"""Steps of the run that says how much energy there can be, at most."""
_SHARE = 0.4
"""Of the time that is left, what the search of an integrator may take."""
_SETTLED_STEPS = 2000
"""Steps, at the limit of theory, of a run that comes to rest: growth at rest shows slowly."""


class Laboratory(Struct, frozen=True, eq=False):
    """What runs of an integrator show, by start and timestep."""

    run: Callable[[int, float, float], StabilityTrial]
    """A start (0 is the own one, the others are near it), a timestep and a time (s) → a run."""
    span: float
    """s."""
    starts: int = 1
    questions: tuple[str, ...] = ()
    """What else is asked: whether runs go `astray` from the motion of small steps, and whether
    anything goes `through` anything, where it can touch."""
    shortest: float = math.inf
    """The shortest timestep at which that is asked, s."""
    snap: Callable[[float], float] = float
    """A timestep → the longest one up to it that is tried, s: all of them, or those of a loop."""
    trials: dict[tuple[int, float], dict[int, StabilityTrial]] = field(default_factory=dict)
    """By start and timestep, and by the number of spans."""

    def trial(self, start: int, timestep: float, spans: int = 1) -> StabilityTrial:
        """The run from a start at a timestep (s) over so many spans; each is made once."""
        runs = self.trials.setdefault((start, timestep), {})
        if spans not in runs:
            is_known = 1 in runs and not runs[1].stable  # what is lost stays so
            runs[spans] = runs[1] if is_known else self.run(start, timestep, spans * self.span)
        return runs[spans]

    def is_lost(self, start: int, timestep: float, spans: int = 1) -> bool:
        """Whether it was lost within so many spans."""
        return not self.trial(start, timestep, spans).stable

    def own_steps(self) -> list[float]:
        """The timesteps tried from the own start over the span, rising."""
        return sorted(
            step for (start, step), runs in self.trials.items() if not start and 1 in runs
        )


def boundaries(problem: Problem) -> tuple[StableRow, ...]:
    """The boundaries of all integrators for which they may differ.

    None where the problem names no timesteps to look between.
    """
    if problem.search is None:
        return ()
    # Only joints with damping know `eulerdamp`.
    model = compile_model(problem.mjcf, Integrator.EULER, min(problem.timesteps or (1e-3,)))
    integrators = Integrator if np.any(model.dof_damping) else STANDARD
    problem = with_energy_bound(problem)
    theory = find_theory(model, problem.scenario, problem.limit)
    return tuple(boundary(problem, integrator, theory) for integrator in integrators)


def with_energy_bound(problem: Problem) -> Problem:
    """The problem with a bound of its energy, from its motion in small steps over its span."""
    if driving_force(compile_model(problem.mjcf, Integrator.RK4, 1e-3), problem.scenario):
        return problem
    step, scenario = min(problem.timesteps), problem.scenario
    looks = math.floor(min(problem.span, _SMALL_STEPS * step) / scenario.sample)
    duration = max(looks * scenario.sample, scenario.duration)
    longer = replace(problem, scenario=replace(scenario, duration=duration))
    energy = simulate(longer, compile_model(problem.mjcf, Integrator.RK4, step)).energy
    most, kinetic = float(energy.sum(axis=1).max()), float(energy[:, 1].max())
    bound = most + problem.room * kinetic
    return replace(problem, energy_bound=bound)


def boundary(problem: Problem, integrator: Integrator, theory: Theory | None = None) -> StableRow:
    """Search for the largest stable timestep of a problem with a search interval."""
    assert problem.search is not None
    low, high = problem.search
    search = max(low, problem.span / MOST_STEPS), high

    def run(start: int, step: float, span: float) -> StabilityTrial:
        return run_trial(problem, compile_model(problem.mjcf, integrator, step), span, start=start)

    laboratory = Laboratory(run, problem.span, STARTS)
    return search_row(laboratory, integrator, search, problem, theory or Theory(problem.limit))


def search_row(
    laboratory: Laboratory,
    integrator: Integrator,
    search: tuple[float, float],
    setup: Setup,
    theory: Theory,
    *,
    quick: bool = False,
    closer: bool = True,
) -> StableRow:
    """Search for the largest stable timestep between two (s), and for what speaks against it.

    Without `closer` from the own start on the grid alone.

    1. From the own start over the span: a grid, falling, down to a tenth of the largest timestep
       below which nothing was lost, a bisection at its end, and a finer grid below that.
    2. About that all starts over both spans; then a bisection for the start that is lost first, and
       one for the own start over the doubled span.
    """
    low, high = search
    count = max(2, round((_QUICK_GRID if quick else _GRID) * math.log10(high / low)) + 1)
    grid = sorted(set(map(laboratory.snap, np.geomspace(low, high, count).tolist())))
    resolution = _COARSE if quick else _FINE
    for kind in laboratory.questions:  # which matter most; their runs say what is bounded too
        _limit_of(laboratory, grid, resolution, kind)
    is_lost = partial(laboratory.is_lost, 0)
    largest = bisect(is_lost, grid, _COARSE, snap=laboratory.snap)
    if closer:
        largest = _look_closer(laboratory, grid, resolution, quick)
    near = [h for h in grid if h < _NEAR * min(largest, grid[-1])] or grid[:1]
    # A first look asks other starts and times about that limit alone, where most of them fail.
    enough = min(largest, grid[-1]) / _NEAR if quick else 0.0

    def estimate(start: int, width: float) -> float:
        is_lost = partial(laboratory.is_lost, start, spans=2)
        return bisect(is_lost, near, width, _NEAR, enough, laboratory.snap)

    estimates = [estimate(0, resolution)] if closer else []
    starts = range(1, laboratory.starts if closer else 1)
    by_start = {n: estimate(n, math.inf) for n in starts}
    if by_start:
        estimates.append(estimate(min(by_start, key=lambda n: by_start[n]), resolution))
    bounds = [min(h, grid[-1]) for h in (largest, *estimates)]
    limit = theory.limit(integrator, search)
    near_limit = _limit_of(laboratory, grid, resolution, "astray")
    through_limit = _limit_of(laboratory, grid, resolution, "through")
    steps = laboratory.own_steps()
    islands = [h for h in steps if h > largest and not laboratory.is_lost(0, h)]
    lost = [h for h in steps if laboratory.is_lost(0, h)]
    is_all = math.isinf(largest)
    return StableRow(
        integrator=integrator.value,
        largest=reach(largest),
        reason=laboratory.trial(0, lost[0]).reason if lost else "",
        near=near_limit[0],
        near_reason=near_limit[1],
        through=through_limit[0],
        through_reason=through_limit[1],
        searched=(steps[0], steps[-1]),
        islands=(islands[0], islands[-1]) if islands and not is_all else None,
        duration=laboratory.span,
        energy=setup.energy_bound if math.isfinite(setup.energy_bound) else None,
        bracket=(min(bounds), max(bounds)) if estimates and min(bounds) < grid[-1] else None,
        theory=None if limit is None else reach(limit.timestep),
        formula="" if limit is None else limit.source,
    )


def _limit_of(
    laboratory: Laboratory, grid: Sequence[float], resolution: float, kind: str
) -> tuple[Reach | None, str]:
    """The largest timestep below which no run of the own start is `astray` or `through`, and why.

    `None` where that is not asked. It is not looked for below the shortest that was tried to see
    what is bounded, or that the scene is measured at.
    """
    if kind not in laboratory.questions:
        return None, ""
    steps_tried = laboratory.own_steps()
    low = min([laboratory.shortest, *steps_tried[:1]])
    steps = [h for h in grid if h >= low * (1 - 1e-9)] or steps_tried

    def is_lost(step: float) -> bool:
        return bool(getattr(laboratory.trial(0, step), kind))

    largest = bisect(is_lost, steps, max(resolution, _COARSE), math.inf, snap=laboratory.snap)
    lost = [h for h in laboratory.own_steps() if h > largest and is_lost(h)]
    return reach(largest), getattr(laboratory.trial(0, lost[0]), kind) if lost else ""


def _look_closer(
    laboratory: Laboratory, grid: list[float], resolution: float, quick: bool
) -> float:
    """`bisect`, until none of many timesteps below is lost: with impacts islands are narrow."""
    is_lost, snap = partial(laboratory.is_lost, 0), laboratory.snap
    largest = bisect(is_lost, grid, resolution, snap=snap)
    while largest:
        top = min(largest, grid[-1])
        count = _QUICK_CLOSER if quick else _CLOSER
        closer = sorted(set(map(snap, np.geomspace(top / _NEAR, top, count).tolist())))
        lost = next((step for step in closer[1:-1] if is_lost(step)), None)
        if lost is None:
            break
        grid = [*(step for step in grid if step < lost), lost]
        largest = bisect(is_lost, grid, resolution, snap=snap)
    return largest


_SEARCH, _LOWER = (0.25, 64.0), 8.0
"""The multiples of the model's timestep between which the largest stable one is searched for, and
by how much lower it is searched for again where all of these are lost."""


def stable_rows(
    model: Any, pilot: Pilot, reference: EngineStates, parts: Parts, *, quick: bool = False
) -> tuple[StableRow, ...]:
    """The largest stable timestep of every integrator, over the scenario.

    They are searched for as those of the hard cases. No timestep is tried of which the scenario
    has fewer than 20: so few steps would say nothing.
    """
    scene = pilot.scene
    duration = scene.declaration.stable_for or scene.scenario.duration
    low, high = sorted(scene.declaration.search or [part * scene.timestep for part in _SEARCH])
    setup_over = cache(partial(longer_setup, model, pilot))
    motion = kept_motion(model, pilot, reference)
    questions = ("astray", "through") if Passages(model).needed else ("astray",)

    theory = parts.run(
        f"{scene.name}: theory of stability",
        lambda: (
            Theory()
            if scene.scenario.loop is not None  # which no linearization of the engine knows
            else find_theory(model, scene.scenario, visits=partial(_comes_near, motion, model))
        ),
        Theory(),
        share=0.2,
    )

    def find(
        laboratory: Laboratory, integrator: Integrator, search: tuple[float, float], closer: bool
    ) -> StableRow:
        least = search[0] if scene.declaration.search else laboratory.span / MOST_STEPS
        look = partial(search_row, quick=quick, closer=closer)
        while True:
            row = look(laboratory, integrator, search, pilot.setup, theory)
            if row.largest != "none" or search[0] <= least:
                return row
            search = max(search[0] / _LOWER, least), search[0]

    def first_look(integrator: Integrator) -> tuple[StableRow, partial[StableRow]] | None:
        """What the own start shows, and what looks closer."""

        def run(start: int, step: float, span: float) -> StabilityTrial:
            is_longer = span > scene.scenario.duration and not pilot.settles
            setup = setup_over(span) if is_longer else pilot.setup
            variant = with_integrator(model, integrator, step)
            return run_trial(setup, variant, span, motion, start=start)

        span, settles = duration, pilot.settles and pilot.smooth
        limit = theory.limit(integrator, (low, high)) if settles else None
        if limit is not None and math.isfinite(limit.timestep):
            span = max(span, _SETTLED_STEPS * limit.timestep)
        search = max(low, span / MOST_STEPS), min(high, span / FEWEST_STEPS)
        if search[1] <= search[0]:
            return None
        starts, shortest = QUICK_STARTS if quick else STARTS, min(scene.timesteps)
        loop = scene.scenario.loop
        snap = float if loop is None else loop.timestep_below
        laboratory = Laboratory(run, span, starts, questions, shortest, snap)
        look = partial(find, laboratory, integrator, search)
        return look(closer=False), partial(look, closer=True)

    baseline = integrator_of(model)  # of which the verdict tells, so it comes first
    order = sorted(STANDARD, key=lambda i: i is not baseline)
    part = f"{scene.name}: stable timesteps of {{}}".format
    looks = [parts.run(part(i.value), partial(first_look, i), None, share=_SHARE) for i in order]
    rows = dict.fromkeys(STANDARD)
    for integrator, look in zip(order, looks, strict=True):
        if look is not None:
            name = f"{part(integrator.value)} from starts nearby"
            rows[integrator] = parts.run(name, look[1], look[0], share=_SHARE)
    return tuple(filter(None, rows.values()))


def _comes_near(motion: KeptMotion, model: Any, rest: Array) -> bool:
    """Whether the motion of small steps comes near to a rest, with these positions."""
    return any(position_distance(model, q, rest, motion.units) < 1 for q in motion.states.qpos)
