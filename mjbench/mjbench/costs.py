"""What settings cost.

1. A job is a scenario from its beginning to its end, so that each setting is timed on its own
   states; what takes little time is repeated.
2. A round makes every job once, forwards and backwards in turn: what slows the machine for a while
   slows all. The first one finds out how often each has to be repeated.
3. Of the times of each job the lowest tenth counts: it forgets those that were disturbed, and does
   not hang on a single lucky one. Intervals come from rounds drawn again at random (bootstrap).

The clock is best the processor time of the thread, which stands still while others run.
"""

from __future__ import annotations

import copy
import gc
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mjbench.loop import time_left
from mjbench.problem import Array, Inputs, Scenario
from mjbench.reports import Interval
from mjbench.reports.scene_report import MeasuredSetting
from mjbench.scene import Scene
from mjbench.settings import apply, with_setting
from mjbench.simulation import STATE, advance, full_state, initial_data, silent

Clock: TypeAlias = Callable[[], int]
"""Time so far, in ns."""
Job: TypeAlias = Callable[[], None]
"""Does what is timed, always the same amount."""

MIN_ROUNDS, QUICK_MIN_ROUNDS, MAX_ROUNDS = 8, 3, 60
"""Rounds; of a first look that takes long already, fewer are enough."""
_BUDGET, _QUICK_BUDGET = 20e9, 2e9
"""ns after which no round begins that is not among the fewest."""
_TARGET_WIDTH = 0.01
"""Relative half width of the widest interval at which rounds end."""
_SHORTEST = 1_000_000
"""ns that a job takes at least."""
_DRAWS = 200
"""Times that rounds are drawn again, for an interval."""


class Timing(Struct, frozen=True):
    """The time of a job."""

    nanoseconds: Interval
    ratio: Interval
    """Its time over that of the baseline."""

    @property
    def certain(self) -> bool:
        """Whether the ratio differs from 1 by more than 3 % and the measurement's uncertainty."""
        differs = not self.ratio.low <= 1.0 <= self.ratio.high
        return differs and abs(self.ratio.value - 1.0) > 0.03


def time_jobs(
    jobs: Sequence[Job], baseline: int, clock: Clock, *, quick: bool = False
) -> tuple[Timing, ...]:
    """Time jobs, of which number `baseline` is what the others are compared with.

    Where time is limited, only the first jobs are made, as many as there is time for.
    """
    times = np.zeros((MAX_ROUNDS, len(jobs)))
    budget, began = _QUICK_BUDGET if quick else _BUDGET, clock()
    enough = (1 - 1 / QUICK_MIN_ROUNDS) * time_left()  # for the other rounds
    gc_was_enabled = gc.isenabled()
    gc.disable()
    try:
        repeats = []
        for index, job in enumerate(jobs):
            if index > baseline and time_left() < enough:
                break
            count = 1
            while (took := _time_job(job, count, clock)) < _SHORTEST and count < 1 << 12:
                count *= 2
            times[0, index] = took
            repeats.append(count)
        times = times[:, : len(repeats)]
        order = range(len(repeats))
        for turn in range(1, MAX_ROUNDS):
            for index in reversed(order) if turn % 2 else order:
                times[turn, index] = _time_job(jobs[index], repeats[index], clock)
            is_late = time_left() <= 0 or clock() - began > budget
            is_short = time_left() <= 0 or (quick and is_late)
            if turn + 1 < (QUICK_MIN_ROUNDS if is_short else MIN_ROUNDS):
                continue
            timings = _timings(times[: turn + 1] / repeats, baseline)
            widest = max((timing.ratio.half_width for timing in timings), default=0.0)
            if widest <= _TARGET_WIDTH or is_late:
                break
    finally:
        if gc_was_enabled:
            gc.enable()
    return timings


def _time_job(job: Job, times: int, clock: Clock) -> int:
    before = clock()
    for _ in range(times):
        job()
    return clock() - before


def _timings(times: Array, baseline: int) -> tuple[Timing, ...]:
    """The timings of jobs, from the times (n, jobs) of n rounds."""
    count = len(times)
    resamples = np.random.default_rng(0).integers(count, size=(_DRAWS, count))
    lowest = np.quantile(times, 0.1, axis=0)
    redrawn = np.quantile(times[resamples], 0.1, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios, redrawn_ratios = (
            lowest / lowest[baseline],
            redrawn / redrawn[:, baseline : baseline + 1],
        )
    return tuple(
        Timing(_interval(lowest[n], redrawn[:, n]), _interval(ratios[n], redrawn_ratios[:, n]))
        for n in range(times.shape[1])
    )


def _interval(value: float, redrawn: Array) -> Interval:
    low, high = np.quantile(redrawn, (0.025, 0.975)).tolist()
    return Interval(float(value), min(low, float(value)), max(high, float(value)))


def costs(
    model: Any,
    scene: Scene,
    settings: Sequence[MeasuredSetting],
    baseline: int,
    clock: Clock,
    *,
    quick: bool = False,
) -> tuple[Timing, ...]:
    """The costs of a scenario under some settings, relative to number `baseline` of them."""
    variant = with_setting(model, settings[baseline])

    def job(setting: MeasuredSetting) -> Job:
        apply(variant, setting, model)  # under which a controller is asked
        run = scenario_job(variant, [scene.scenario], setting.timestep)

        def work() -> None:
            apply(variant, setting, model)
            run()

        return work

    with silent():
        return time_jobs([job(setting) for setting in settings], baseline, clock, quick=quick)


def scenario_job(
    model: Any,
    scenarios: Sequence[Scenario],
    timestep: float,
    *,
    states: Sequence[Array] | None = None,
    actuators: Sequence[int] | None = None,
) -> Job:
    """A job that runs scenarios.

    `states`: full ones to begin in, else those of the scenarios; `actuators`: those commanded, else
    all.
    """
    data, commanded = mujoco.MjData(model), slice(None) if actuators is None else list(actuators)
    if states is None:
        states = [full_state(model, initial_data(scenario, model)) for scenario in scenarios]
    runs = []
    for scenario, state in zip(scenarios, states, strict=True):
        holds = inputs_of(model, scenario, timestep)
        # Arrays take less time than rows of numbers, which would be part of what is timed.
        parts = [
            (
                np.array(inputs.controls)[commanded] if inputs.controls else None,
                replace(inputs, controls=()) if inputs.forces or inputs.poses else None,
                steps,
            )
            for inputs, steps in holds
        ]
        runs.append((state, parts))

    def job() -> None:
        for state, parts in runs:
            if model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP:
                mujoco.mj_resetData(model, data)  # a state does not say who sleeps
            mujoco.mj_setState(model, data, state, STATE)
            for command, outside, steps in parts:
                if command is not None:
                    data.ctrl[:] = command
                if outside is not None:
                    outside.give(data)
                mujoco.mj_step(model, data, steps)

    return job


def inputs_of(model: Any, scenario: Scenario, timestep: float) -> list[tuple[Inputs, int]]:
    """The inputs of a scenario, each with the number of steps for which it holds.

    Those of a controller are what it commands from the beginning: what is timed is the engine under
    the same commands, as the controller takes the same in all.
    """
    if scenario.loop is None:
        return [
            (inputs, round((end - begin) / timestep)) for begin, end, inputs in scenario.holds()
        ]
    model = copy.copy(model)
    model.opt.timestep = timestep
    data, holds = initial_data(scenario, model), list[tuple[Inputs, int]]()
    for outside in scenario.inputs(timestep):
        outside.give(data)
        advance(model, data)
        inputs = replace(outside, controls=tuple(data.ctrl.tolist()))
        if holds and holds[-1][0] == inputs:
            holds[-1] = inputs, holds[-1][1] + 1
        else:
            holds.append((inputs, 1))
    return holds
