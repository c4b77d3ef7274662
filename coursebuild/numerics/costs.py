"""What each setting costs in a scene.

Entry point: `costs(model, scene, pilot, settings, clock)`.

1. The scene's own setting is run once, and its full state is kept at a few times: steps are timed
   from there, since what a step costs depends on what is going on (contacts, above all).
2. A job is a batch of steps from each of these states, in calls of the engine that make many; the
   batch is repeated rather than run on beyond the scenario.
3. What it takes to begin anew is measured by itself, and taken off.
4. The cost of a scenario is the cost of a step times its steps.
"""

from __future__ import annotations

import gc
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct

from coursebuild.numerics.engine import advance, begun, held, silent, varied
from coursebuild.numerics.grid import apply
from coursebuild.numerics.pilot import OWN, Pilot
from coursebuild.numerics.problem import Array, Integrator, whole_number
from coursebuild.numerics.reports.bench import Setting
from coursebuild.numerics.scene import Scene
from coursebuild.numerics.timing import MOST, QUICK_MOST, Clock, Job, Timing, timed

MOMENTS = 6
"""Times of a scenario from which steps are timed."""
FEWEST_STEPS, MOST_STEPS, _COORDINATES = 8, 64, 1000
"""Steps from each of them: fewer where there are many degrees of freedom."""
JOB = 1_000_000
"""ns that a job takes at least."""


class Cost(Struct, frozen=True):
    """What a setting costs."""

    ratio: float
    """Time for the scenario, relative to the own setting's."""
    uncertainty: float
    """Of the ratio, relative."""
    step: float
    """Least time for a step, ns."""
    spread: float
    """Median over least of the repeated times."""


def costs(
    model: Any,
    scene: Scene,
    first: Pilot,
    chosen: Sequence[Setting],
    own: int,
    clock: Clock,
    *,
    quick: bool = False,
) -> tuple[Cost, ...]:
    """The costs of settings, of which number `own` is the scene's own."""
    one = varied(model, Integrator(chosen[own].integrator), chosen[own].timestep)
    data = begun(first.setup, one)
    moments = _moments(one, data, scene, first)
    collecting = gc.isenabled()
    gc.disable()
    try:
        with silent():
            batches = [_batch(one, data, scene, setting, moments, clock) for setting in chosen]
            begin = _beginning(one, data, chosen[own], moments, clock)
            found = timed(
                [batch.job for batch in batches],
                own,
                clock,
                idle=[begin * batch.repeats for batch in batches],
                most=QUICK_MOST if quick else MOST,
            )
    finally:
        if collecting:
            gc.enable()
    ours = chosen[own].timestep * batches[own].steps
    return tuple(
        _cost(timing, batch.steps, batch.steps * setting.timestep / ours)
        for timing, setting, batch in zip(found, chosen, batches, strict=True)
    )


def _cost(timing: Timing, steps: int, per: float) -> Cost:
    """`per`: the simulated time in a job over that in the own setting's."""
    return Cost(timing.ratio / per, timing.uncertainty, timing.least / steps, timing.spread)


def subnormal(model: Any, scene: Scene, first: Pilot) -> bool:
    """Whether the state holds numbers so small that processors compute with them slowly."""
    one = varied(model, OWN[int(model.opt.integrator)], scene.own)
    moments = _moments(one, begun(first.setup, one), scene, first)
    small = np.abs(np.concatenate(moments))
    return bool(np.any((small > 0) & (small < np.finfo(np.float64).tiny)))


_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


def _moments(model: Any, data: Any, scene: Scene, first: Pilot) -> tuple[Array, ...]:
    """Full states of the engine at a few times, from the beginning on."""
    every = whole_number(
        scene.scenario.sample, float(model.opt.timestep), "the sampling interval", "the timestep"
    )
    looks, holds, rows = len(scene.scenario.times), held(first.setup), scene.scenario.controls
    wanted = {round(part * looks / MOMENTS) for part in range(MOMENTS)}
    found = []
    for index in range(looks):
        if rows:
            data.ctrl[:] = rows[min(index // holds, len(rows) - 1)]
        if index in wanted:
            state = np.empty(mujoco.mj_stateSize(model, _STATE))
            mujoco.mj_getState(model, data, state, _STATE)
            found.append(state)
        advance(model, data, every)
    return tuple(found)


class _Batch(Struct, frozen=True):
    """What is timed of a setting."""

    job: Job
    steps: int
    """In the whole job."""
    repeats: int
    """How often it begins at all moments."""


def _batch(
    model: Any, data: Any, scene: Scene, setting: Setting, moments: Sequence[Array], clock: Clock
) -> _Batch:
    """A job that takes about as long as it should.

    It begins at all moments more often where steps are cheap; what is done from each of them is
    always the same.
    """
    steps = _steps(model, scene, setting)
    repeats = 1
    while True:
        job = _job(model, data, setting, moments, steps, repeats)
        before = clock()
        job()
        took = clock() - before
        if took >= JOB or repeats >= 1 << 12:
            return _Batch(job, steps * repeats * len(moments), repeats)
        repeats *= 2


def _steps(model: Any, scene: Scene, setting: Setting) -> int:
    """Steps from each moment: over the same time with every timestep, as far as that is little."""
    most = min(MOST_STEPS, max(FEWEST_STEPS, _COORDINATES // max(1, int(model.nv))))
    end = scene.scenario.duration / MOMENTS
    span = min(most * scene.own, end)
    return max(1, min(round(span / setting.timestep), most))


def _job(
    model: Any, data: Any, setting: Setting, moments: Sequence[Array], steps: int, repeats: int
) -> Job:
    def job() -> None:
        apply(model, setting)
        for _ in range(repeats):
            for state in moments:
                mujoco.mj_setState(model, data, state, _STATE)
                mujoco.mj_step(model, data, steps)

    return job


def _beginning(
    model: Any, data: Any, setting: Setting, moments: Sequence[Array], clock: Clock
) -> float:
    """What it takes to begin at all moments, without any step, ns."""
    job = _job(model, data, setting, moments, 0, _EMPTY)
    taken = []
    for _ in range(7):
        before = clock()
        job()
        taken.append(clock() - before)
    return min(taken) / _EMPTY


_EMPTY = 20
