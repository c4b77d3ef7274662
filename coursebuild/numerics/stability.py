"""The largest stable timestep for each integrator, and how fast a run grows beyond.

Entry points: `boundaries(problem)`, of a hard case; `scan(attempt, search)` and
`attempted(setup, model, steps)`, for any scene.

1. A grid of timesteps, even in the logarithm, is tried from end to end: stability need not be
   monotone, and a bisection alone would find some boundary, not the first.
2. The first boundary is then bisected.
3. Stable is what stays within the problem's bounds, by the same judgement that every run gets. What
   is just beyond the boundary grows slowly, so the number of steps sets the resolution.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from msgspec import Struct

from coursebuild.numerics.detector import Peaks, RunStatus, judge
from coursebuild.numerics.engine import bounds_of, compiled, initial_data, watched
from coursebuild.numerics.problem import (
    INTEGRATORS,
    STANDARD,
    Array,
    Integrator,
    Limit,
    Problem,
    Scenario,
    Setup,
)
from coursebuild.numerics.reports.cases import BoundaryLine

GRID = 12
"""Timesteps tried in a decade."""
RESOLUTION = 1e-4
"""Relative width at which the bisection ends."""
_LOOKS = 20


class StabilityTrial(Struct, frozen=True):
    """One timestep tried."""

    timestep: float
    """s."""
    status: RunStatus
    growth: float
    """By what the state is multiplied in a step, from half the run to its end; 1 is neither growth
    nor decay, and no number where the run was lost before."""

    @property
    def stable(self) -> bool:
        """Whether the run stayed within the problem's bounds."""
        return self.status is RunStatus.OK


def boundaries(problem: Problem) -> tuple[BoundaryLine, ...]:
    """The boundaries of all integrators for which they may differ.

    None where the problem names no timesteps to look between.
    """
    if problem.search is None:
        return ()
    # Only joints with damping know `eulerdamp`.
    damped = bool(np.any(compiled(problem.mjcf, Integrator.EULER, 1e-3).dof_damping))
    return tuple(boundary(problem, one) for one in (INTEGRATORS if damped else STANDARD))


def boundary(problem: Problem, integrator: Integrator) -> BoundaryLine:
    """Look for the largest stable timestep.

    Raises:
        ValueError: the problem names no timesteps to look between.
    """
    if problem.search is None:
        raise ValueError(f"{problem.name} has no range of timesteps to search")
    found = scan(lambda step: attempt(problem, integrator, step), problem.search)
    theory = None if problem.limit is None else problem.limit(integrator)
    beyond = found.beyond
    return BoundaryLine(
        integrator=integrator.value,
        largest=_finite(found.largest),
        theory=None if theory is None else _finite(theory.timestep),
        formula="" if theory is None else theory.source,
        difference=_difference(found.largest, theory),
        monotone=not found.islands,
        islands=found.islands,
        beyond="" if beyond is None else beyond.status.value,
        growth=None if beyond is None else _finite(beyond.growth),
        searched=problem.search,
    )


def _difference(largest: float, theory: Limit | None) -> float | None:
    """Measured against theory, relative; `None` where one of them is not finite, or 0."""
    if theory is None or not (0 < theory.timestep < math.inf and 0 < largest < math.inf):
        return None
    return largest / theory.timestep - 1


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


class Scan(Struct, frozen=True):
    """Where timesteps cease to be stable."""

    largest: float
    """The largest stable timestep below which all tried are stable, s; 0 where none is, infinite
    where all tried are."""
    islands: tuple[float, ...]
    """Timesteps beyond that are stable all the same, s."""
    beyond: StabilityTrial | None
    """The first unstable one of the grid."""


def scan(
    attempt: Callable[[float], StabilityTrial],
    search: tuple[float, float],
    *,
    grid: int = GRID,
    resolution: float = RESOLUTION,
) -> Scan:
    """Look for the largest stable timestep between two (s): on a grid, then by bisection.

    `grid`: timesteps tried in a decade; `resolution`: relative width at which bisection ends.
    """
    low, high = search
    count = max(2, round(grid * math.log10(high / low)) + 1)
    steps = np.geomspace(low, high, count).tolist()
    trials = [attempt(step) for step in steps]
    first = next((i for i, trial in enumerate(trials) if not trial.stable), None)
    if first is None:
        return Scan(math.inf, (), None)
    islands = tuple(trial.timestep for trial in trials[first:] if trial.stable)
    largest = 0.0
    if first > 0:
        largest = _bisected(attempt, steps[first - 1], steps[first], resolution)
    return Scan(largest, islands, trials[first])


def _bisected(
    attempt: Callable[[float], StabilityTrial], low: float, high: float, resolution: float
) -> float:
    while high / low > 1 + resolution:
        middle = math.sqrt(low * high)
        if attempt(middle).stable:
            low = middle
        else:
            high = middle
    return low


def attempt(problem: Problem, integrator: Integrator, timestep: float) -> StabilityTrial:
    """Run the problem's steps at a timestep (s), whatever its duration."""
    return attempted(problem, compiled(problem.mjcf, integrator, timestep), problem.steps)


def attempted(
    setup: Setup, model: Any, steps: int, thickness: Array | None = None
) -> StabilityTrial:
    """Make so many steps with a model's own timestep; `thickness` as for `detector.peaks`.

    A command changes with the first step that begins after its time: the timestep need not divide
    the hold.
    """
    data = initial_data(setup.scenario, model)
    timestep = float(model.opt.timestep)
    chunk = max(1, steps // _LOOKS)
    sizes: list[float] = []
    seen, total = Peaks(), 0
    for _ in range(_LOOKS):
        for part in _parts(setup.scenario, timestep, total, chunk):
            _command(setup.scenario, data, total * timestep)
            seen, done = watched(model, data, part, seen, thickness)
            total += done
        if not seen.finite:
            break
        with np.errstate(over="ignore"):
            sizes.append(float(np.linalg.norm(data.qvel)))
    elapsed = total * timestep
    judgement = judge(model, data, elapsed, seen, bounds_of(setup))
    return StabilityTrial(timestep, judgement.status, _growth(sizes, chunk))


def _parts(scenario: Scenario, timestep: float, done: int, count: int) -> list[int]:
    """Steps cut at changes of the command."""
    if len(scenario.controls) < 2:
        return [count]
    end = done + count
    edges = {done, end}
    for index in range(1, len(scenario.controls)):
        edges.add(min(max(math.ceil(index * scenario.hold / timestep - 1e-9), done), end))
    cuts = sorted(edges)
    return [b - a for a, b in itertools.pairwise(cuts)]


def _command(scenario: Scenario, data: Any, time: float) -> None:
    if scenario.controls:
        index = int(time / scenario.hold + 1e-9) if scenario.hold else 0
        data.ctrl[:] = scenario.controls[min(index, len(scenario.controls) - 1)]


def _growth(sizes: list[float], chunk: int) -> float:
    half = len(sizes) // 2
    if half < 1 or not 0 < sizes[half - 1] < math.inf or not 0 < sizes[-1] < math.inf:
        return math.nan
    return float((sizes[-1] / sizes[half - 1]) ** (1 / ((len(sizes) - half) * chunk)))
