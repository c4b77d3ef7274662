"""What scenarios cost, relative to each other, on a machine that does other things too.

Entry points: `time_jobs(jobs, own, clock)`; `costs(model, scene, settings, …)`, of settings of a
scene; `scenario_job(model, scenes)`, a model's whole scenarios as a job.

1. A job is a scenario from its beginning to its end, so that each setting is timed on its own
   states; what takes little time is repeated.
2. A round makes every job once, forwards and backwards in turn: what slows the machine for a while
   slows all.
3. Of the times of each job the lowest tenth counts: it forgets those that were disturbed, and does
   not hang on a single lucky one. Intervals come from rounds drawn again at random (bootstrap).
4. Rounds go on until all ratios are known well enough, or the time for them is over.

The clock is an argument: processor time of the thread serves best, since it stands still while
others run.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Sequence
from itertools import groupby
from typing import Any, TypeAlias

import mujoco
import numpy as np
from msgspec import Struct

from coursebuild.numerics.engine import STATE, full_state, initial_data, silent
from coursebuild.numerics.problem import Array, Scenario
from coursebuild.numerics.reports import Interval
from coursebuild.numerics.reports.bench import MeasuredSetting
from coursebuild.numerics.scene import Scene
from coursebuild.numerics.settings import apply, with_setting

Clock: TypeAlias = Callable[[], int]
"""Time so far, in ns."""
Job: TypeAlias = Callable[[], None]
"""Does what is timed, always the same amount."""

FEWEST, MOST = 8, 60
"""Rounds."""
_BUDGET, _QUICK_BUDGET = 20e9, 2e9
"""ns after which no round begins that is not among the fewest."""
_ENOUGH = 0.01
"""Relative half width of the widest interval at which rounds end."""
_SHORTEST = 1_000_000
"""ns that a job takes at least."""
_DRAWS = 200
"""Times that rounds are drawn again, for an interval."""


class Timing(Struct, frozen=True):
    """What a job took."""

    nanoseconds: Interval
    ratio: Interval
    """Its time over that of the own one."""

    @property
    def certain(self) -> bool:
        """Whether the ratio is another than 1 beyond what the measurement can tell."""
        off = not self.ratio.low <= 1.0 <= self.ratio.high
        return off and abs(self.ratio.value - 1.0) > 0.03


def time_jobs(
    jobs: Sequence[Job], own: int, clock: Clock, *, quick: bool = False
) -> tuple[Timing, ...]:
    """Time jobs, of which number `own` is what others are compared with."""
    times = np.zeros((MOST, len(jobs)))
    budget, began = _QUICK_BUDGET if quick else _BUDGET, clock()
    collecting = gc.isenabled()
    gc.disable()
    try:
        repeats = [_repeats(job, clock) for job in jobs]
        for turn in range(MOST):
            order = range(len(jobs))
            for index in order if turn % 2 else reversed(order):
                times[turn, index] = _spent(jobs[index], repeats[index], clock)
            if turn + 1 < FEWEST:
                continue
            found = _timings(times[: turn + 1] / repeats, own)
            widest = max((one.ratio.half_width for one in found), default=0.0)
            if widest <= _ENOUGH or clock() - began > budget:
                break
    finally:
        if collecting:
            gc.enable()
    return found


def _repeats(job: Job, clock: Clock) -> int:
    """How often a job is repeated, to take as long as it should; caches are warm then."""
    times = 1
    while _spent(job, times, clock) < _SHORTEST and times < 1 << 12:
        times *= 2
    return times


def _spent(job: Job, times: int, clock: Clock) -> int:
    before = clock()
    for _ in range(times):
        job()
    return clock() - before


def _timings(times: Array, own: int) -> tuple[Timing, ...]:
    """What rounds (n, jobs) say."""
    count = len(times)
    again = np.random.default_rng(0).integers(count, size=(_DRAWS, count))
    lowest = np.quantile(times, 0.1, axis=0)
    drawn = np.quantile(times[again], 0.1, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios, drawn_ratios = lowest / lowest[own], drawn / drawn[:, own : own + 1]
    return tuple(
        Timing(_interval(lowest[n], drawn[:, n]), _interval(ratios[n], drawn_ratios[:, n]))
        for n in range(times.shape[1])
    )


def _interval(value: float, drawn: Array) -> Interval:
    low, high = np.quantile(drawn, (0.025, 0.975)).tolist()
    return Interval(float(value), min(low, float(value)), max(high, float(value)))


def costs(
    model: Any,
    scene: Scene,
    chosen: Sequence[MeasuredSetting],
    own: int,
    clock: Clock,
    *,
    quick: bool = False,
) -> tuple[Timing, ...]:
    """What the scenario costs under some settings, relative to number `own` of them."""
    one = with_setting(model, chosen[own])
    state = full_state(one, initial_data(scene.scenario, one))

    def job(setting: MeasuredSetting) -> Job:
        run = scenario_job(one, [(scene.scenario, state)], setting.timestep)

        def work() -> None:
            apply(one, setting)
            run()

        return work

    with silent():
        return time_jobs([job(setting) for setting in chosen], own, clock, quick=quick)


def scenario_job(
    model: Any,
    begins: Sequence[tuple[Scenario, Array]],
    timestep: float,
    actuators: Sequence[int] | None = None,
) -> Job:
    """Runs scenarios from the full states in which they begin; `actuators`: those commanded."""
    data, chosen = mujoco.MjData(model), slice(None) if actuators is None else list(actuators)
    runs = [
        (
            state,
            [
                (np.array(command)[chosen] if command else None, len([*steps]))
                for command, steps in groupby(one.commands(timestep))
            ],
        )
        for one, state in begins
    ]

    def job() -> None:
        for state, parts in runs:
            mujoco.mj_setState(model, data, state, STATE)
            for command, steps in parts:
                if command is not None:
                    data.ctrl[:] = command
                mujoco.mj_step(model, data, steps)

    return job
