"""What steps cost, relative to each other, on a machine that does other things too.

Entry points: `timed(jobs, own, clock)`; `step_times(batches, own, clock)`, of steps; `costs(model,
first, settings, …)`, of settings of a scene.

1. A scene is run once, and its full state is kept at a few times: steps are timed from there, since
   what a step costs depends on what is going on (contacts, above all). A job is a batch of steps
   from each of these states, repeated where steps are cheap. What it takes to begin anew is
   measured by itself, and taken off.
2. Candidates are timed in turns, each beside the scene's own and in alternating order, so that what
   slows the machine for a while slows all.
3. Of the times of each, the lowest tenth counts: it forgets those that were disturbed, and does not
   hang on a single lucky one. Rounds go on until all ratios are known well enough, or a cap is
   reached.
4. The least time of all rounds is what an undisturbed machine takes; the median over it says how
   much it was disturbed.

The clock is an argument: processor time of the thread serves best, since it stands still while
others run.
"""

from __future__ import annotations

import gc
import math
import statistics
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import ArrayLike

from coursebuild.numerics.engine import (
    STATE,
    advance,
    full_state,
    initial_data,
    integrator_of,
    silent,
    varied,
)
from coursebuild.numerics.pilot import Pilot
from coursebuild.numerics.problem import Array, Scenario
from coursebuild.numerics.reports.bench import MeasuredSetting
from coursebuild.numerics.settings import apply, with_setting

Clock: TypeAlias = Callable[[], int]
"""Time so far, in ns."""
Job: TypeAlias = Callable[[], None]
"""Does what is timed, always the same amount."""

FEWEST, MOST = 24, 60
"""Rounds."""
_QUICK_MOST = 24
_ENOUGH = 0.005
"""Relative uncertainty of a ratio at which rounds end."""
_PARTS = 4
"""Into so many parts the rounds are cut, to see how much ratios vary."""
_MOMENTS = 6
"""Times of a scenario from which steps are timed."""
_FEWEST_STEPS, _MOST_STEPS, _COORDINATES = 8, 64, 1000
"""Steps from each of them: fewer where there are many degrees of freedom."""
_JOB = 1_000_000
"""ns that a job takes at least."""
_EMPTY = 20
"""Times that beginning is repeated, to see what it takes."""


class Timing(Struct, frozen=True):
    """What a candidate took."""

    ratio: float
    """Its time over the own setting's, the lowest tenths of both."""
    uncertainty: float
    """Of the ratio, relative: its standard error, from parts of the rounds."""
    least: float
    """Least time of one job, or of one step, ns."""
    spread: float
    """Median over least time."""
    rounds: int

    @property
    def certain(self) -> bool:
        """Whether the ratio is another than 1 beyond what the measurement can tell."""
        return abs(self.ratio - 1.0) > max(0.03, 2 * self.uncertainty)


def timed(
    jobs: Sequence[Job],
    own: int,
    clock: Clock,
    *,
    idle: Sequence[float] | None = None,
    most: int = MOST,
    enough: float = _ENOUGH,
) -> tuple[Timing, ...]:
    """Time jobs, of which number `own` is what others are compared with.

    `idle`: for each job the ns that it takes for what is not to be timed.

    Returns:
        A timing for each job; the ratio of `own` is 1.
    """
    times: list[list[float]] = [[] for _ in jobs]
    others = [index for index in range(len(jobs)) if index != own]
    collecting = gc.isenabled()
    gc.disable()
    try:
        for job in jobs:  # caches are warm, and memory is there
            job()
        for turn in range(most):
            for place, index in enumerate(others or [own]):
                for one in (own, index) if (turn + place) % 2 else (index, own):
                    spent = _once(jobs[one], clock) - (idle[one] if idle else 0.0)
                    times[one].append(max(0.0, spent))
            known = (_uncertainty(times[index], times[own]) <= enough for index in others)
            if turn + 1 >= FEWEST and all(known):
                break
    finally:
        if collecting:
            gc.enable()
    return tuple(
        Timing(
            ratio=1.0 if index == own else _ratio(mine, times[own]),
            uncertainty=0.0 if index == own else _uncertainty(mine, times[own]),
            least=min(mine),
            spread=statistics.median(mine) / min(mine) if min(mine) > 0 else math.inf,
            rounds=len(mine),
        )
        for index, mine in enumerate(times)
    )


def _once(job: Job, clock: Clock) -> int:
    before = clock()
    job()
    return clock() - before


def _ratio(times: ArrayLike, own: ArrayLike) -> float:
    """Of the lowest tenths."""
    mine, ours = (float(np.quantile(np.asarray(one), 0.1)) for one in (times, own))
    return mine / ours if ours > 0 else math.nan


def _uncertainty(times: Sequence[float], own: Sequence[float]) -> float:
    """Relative standard error of a ratio, from the ratios of parts of the rounds."""
    if len(times) < _PARTS:
        return math.inf
    cuts = zip(np.array_split(times, _PARTS), np.array_split(own, _PARTS), strict=True)
    parts = [_ratio(mine, ours) for mine, ours in cuts]
    middle = statistics.fmean(parts)
    if not middle > 0:
        return math.inf
    return statistics.stdev(parts) / (math.sqrt(_PARTS) * middle)


# ------------------------------------------------------------------------------------------ steps


class Batch(Struct, frozen=True, eq=False):
    """Steps whose time is measured: so many from each of some states of a model."""

    model: Any
    data: Any
    states: Sequence[Array]
    steps: int
    setting: MeasuredSetting | None = None
    """What the model is given before; it is shared with other batches then."""

    def job(self, times: int, *, begin_only: bool = False) -> Job:
        """All of that so many times, or only what it takes to begin at the states."""
        model, data, steps = self.model, self.data, 0 if begin_only else self.steps

        def job() -> None:
            if self.setting is not None:
                apply(model, self.setting)
            for _ in range(times):
                for state in self.states:
                    mujoco.mj_setState(model, data, state, STATE)
                    mujoco.mj_step(model, data, steps)

        return job

    def repeats(self, clock: Clock) -> int:
        """How often it is repeated, to take about as long as a job should."""
        times = 1
        while _once(self.job(times), clock) < _JOB and times < 1 << 12:
            times *= 2
        return times


def step_times(
    batches: Sequence[Batch], own: int, clock: Clock, *, quick: bool = False
) -> tuple[Timing, ...]:
    """Time for a step, and its ratio to that of number `own`."""
    with silent():
        repeats = [one.repeats(clock) for one in batches]
        jobs = [one.job(times) for one, times in zip(batches, repeats, strict=True)]
        idle = []
        for one, times in zip(batches, repeats, strict=True):
            begin = one.job(_EMPTY, begin_only=True)
            idle.append(times * min(_once(begin, clock) for _ in range(7)) / _EMPTY)
        found = timed(jobs, own, clock, idle=idle, most=_QUICK_MOST if quick else MOST)
    counts = [
        times * one.steps * len(one.states) for one, times in zip(batches, repeats, strict=True)
    ]
    return tuple(
        replace(timing, ratio=timing.ratio * counts[own] / count, least=timing.least / count)
        for timing, count in zip(found, counts, strict=True)
    )


def costs(
    model: Any,
    first: Pilot,
    chosen: Sequence[MeasuredSetting],
    own: int,
    clock: Clock,
    *,
    quick: bool = False,
) -> tuple[Timing, ...]:
    """What the scenario costs under some settings, relative to number `own` of them."""
    one, scenario = with_setting(model, chosen[own]), first.scene.scenario
    data = initial_data(scenario, one)
    states = moments(one, data, scenario)
    # Over the same time with every timestep, as far as that is little.
    span = min(step_count(model) * first.scene.own, scenario.duration / _MOMENTS)
    batches = []
    for setting in chosen:
        count = max(1, min(round(span / setting.timestep), step_count(model)))
        batches.append(Batch(one, data, states, count, setting))
    found = step_times(batches, own, clock, quick=quick)
    return tuple(
        replace(timing, ratio=timing.ratio * chosen[own].timestep / setting.timestep)
        for timing, setting in zip(found, chosen, strict=True)
    )


def step_count(model: Any) -> int:
    """Steps from each state, at most: fewer where they take long."""
    return min(_MOST_STEPS, max(_FEWEST_STEPS, _COORDINATES // max(1, int(model.nv))))


def subnormal(model: Any, first: Pilot) -> bool:
    """Whether the state holds numbers so small that processors compute with them slowly."""
    scenario = first.scene.scenario
    one = varied(model, integrator_of(model), first.scene.own)
    small = np.abs(np.concatenate(moments(one, initial_data(scenario, one), scenario)))
    return bool(np.any((small > 0) & (small < np.finfo(np.float64).tiny)))


def moments(model: Any, data: Any, scenario: Scenario) -> tuple[Array, ...]:
    """Full states of the engine at a few times of a scenario, from the beginning on."""
    every, looks = scenario.steps(float(model.opt.timestep)), len(scenario.times)
    wanted = {round(part * looks / _MOMENTS) for part in range(_MOMENTS)}
    found = []
    for index in range(looks):
        if scenario.controls:
            data.ctrl[:] = scenario.command(index)
        if index in wanted:
            found.append(full_state(model, data))
        advance(model, data, every)
    return tuple(found)
