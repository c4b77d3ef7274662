"""The largest stable timestep of a problem for each integrator, and how fast it grows beyond.

Entry points: `boundary(problem, integrator)`, `survey(problem)`.

1. A grid of timesteps, even in the logarithm, is tried from end to end: stability need not be
   monotone, and a bisection alone would find some boundary, not the first.
2. The first boundary is then bisected.
3. Stable is what stays within the problem's bounds, by the same judgement that every run gets. What
   is just beyond the boundary grows slowly, so the number of steps sets the resolution.
"""

from __future__ import annotations

import math

import numpy as np

from coursebuild.physics.detector import Peaks, Status, judge, observe
from coursebuild.physics.engine import begun, bounds_of, compiled, watched
from coursebuild.physics.problem import INTEGRATORS, STANDARD, Integrator, Limit, Problem
from coursebuild.values import dataclass

GRID = 12
"""Timesteps tried in a decade."""
RESOLUTION = 1e-4
"""Relative width at which the bisection ends."""
_LOOKS = 20


@dataclass(frozen=True, slots=True)
class Trial:
    """One timestep tried."""

    timestep: float
    """s."""
    status: Status
    growth: float
    """By what the state is multiplied in a step, from half the run to its end; 1 is neither growth
    nor decay, and no number where the run was lost before."""

    @property
    def stable(self) -> bool:
        """Whether the run stayed within the problem's bounds."""
        return self.status is Status.OK


@dataclass(frozen=True, slots=True)
class Boundary:
    """Where an integrator ceases to be stable."""

    integrator: Integrator
    largest: float
    """The largest stable timestep below which all tried are stable, s; 0 where none is, infinite
    where all tried are."""
    monotone: bool
    """Whether every timestep beyond is unstable."""
    islands: tuple[float, ...]
    """Timesteps beyond the first boundary that are stable all the same, s."""
    beyond: Trial | None
    """The first unstable one of the grid."""
    theory: Limit | None
    searched: tuple[float, float]
    """Timesteps that were tried, from and to, s."""

    @property
    def difference(self) -> float | None:
        """Measured against theory, relative; `None` where there is none or it is not finite."""
        if self.theory is None or not 0 < self.theory.timestep < math.inf:
            return None
        if not 0 < self.largest < math.inf:
            return math.inf
        return self.largest / self.theory.timestep - 1


def survey(problem: Problem) -> tuple[Boundary, ...]:
    """The boundaries of all integrators for which they may differ.

    None where the problem names no timesteps to look between.
    """
    if problem.search is None:
        return ()
    chosen = INTEGRATORS if _damped(problem) else STANDARD
    return tuple(boundary(problem, integrator) for integrator in chosen)


def _damped(problem: Problem) -> bool:
    """Whether `eulerdamp` has anything to do: only joints with damping know it."""
    return bool(np.any(compiled(problem.mjcf, Integrator.EULER, 1e-3).dof_damping))


def boundary(problem: Problem, integrator: Integrator) -> Boundary:
    """Look for the largest stable timestep.

    Raises:
        ValueError: the problem names no timesteps to look between.
    """
    if problem.search is None:
        raise ValueError(f"{problem.name} has no range of timesteps to search")
    low, high = problem.search
    count = max(2, round(GRID * math.log10(high / low)) + 1)
    grid = np.geomspace(low, high, count).tolist()
    trials = [attempt(problem, integrator, h) for h in grid]
    first = next((i for i, trial in enumerate(trials) if not trial.stable), None)
    theory = None if problem.limit is None else problem.limit(integrator)
    if first is None:
        return Boundary(integrator, math.inf, True, (), None, theory, (low, high))
    islands = tuple(trial.timestep for trial in trials[first:] if trial.stable)
    largest = 0.0
    if first > 0:
        largest = _bisected(problem, integrator, grid[first - 1], grid[first])
    return Boundary(integrator, largest, not islands, islands, trials[first], theory, (low, high))


def _bisected(problem: Problem, integrator: Integrator, low: float, high: float) -> float:
    while high / low > 1 + RESOLUTION:
        middle = math.sqrt(low * high)
        if attempt(problem, integrator, middle).stable:
            low = middle
        else:
            high = middle
    return low


def attempt(problem: Problem, integrator: Integrator, timestep: float) -> Trial:
    """Run the problem's steps at a timestep (s), whatever its duration."""
    model = compiled(problem.mjcf, integrator, timestep)
    data = begun(problem, model)
    chunk = max(1, problem.steps // _LOOKS)
    sizes: list[float] = []
    seen, steps = Peaks(), 0
    for _ in range(_LOOKS):
        seen, done = watched(model, data, chunk, seen)
        steps += done
        if not seen.finite:
            break
        sizes.append(_size(data))
    elapsed = steps * timestep
    judgement = judge(observe(model, data, elapsed, seen=seen, bounds=bounds_of(problem)))
    return Trial(timestep, judgement.status, _growth(sizes, chunk))


def _size(data: object) -> float:
    velocity: object = data.qvel  # type: ignore[attr-defined]
    with np.errstate(over="ignore"):
        return float(np.linalg.norm(np.asarray(velocity)))


def _growth(sizes: list[float], chunk: int) -> float:
    half = len(sizes) // 2
    if half < 1 or not 0 < sizes[half - 1] < math.inf or not 0 < sizes[-1] < math.inf:
        return math.nan
    return float((sizes[-1] / sizes[half - 1]) ** (1 / ((len(sizes) - half) * chunk)))
