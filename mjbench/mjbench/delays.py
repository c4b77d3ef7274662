"""Up to which delay a controller in the loop does what it does without it."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from msgspec.structs import replace

from mjbench.pilot import Pilot, nudges
from mjbench.problem import Setup
from mjbench.simulation import (
    EngineStates,
    initial_data,
    integrator_of,
    simulate,
    with_integrator,
)
from mjbench.stability import bisect
from mjbench.stability_runs import NEARBY, StabilityTrial, kept_motion, run_trial

_COUNT, _RESOLUTION = 16, 1e-2
"""The delays that are tried in a decade, and the relative width at which a bisection ends; from one
half of a run to the other, what grows by less does not grow."""
_LONGEST_DELAY = 0.25
"""The longest delay that is tried, relative to the scenario."""


def loop_note(model: Any, pilot: Pilot, reference: EngineStates) -> str:
    """Up to which delay a controller does what it does at the scenario's own, in words.

    At the model's own timestep and integrator; `reference`: the motion of small steps. A loop that
    grows slowly is within its bounds for as long as a run lasts, so it is asked whether a run from
    nearby goes away from it, unless one does without more delay.
    """
    scene = pilot.scene
    loop = scene.scenario.loop
    assert loop is not None
    motion = kept_motion(model, pilot, reference)
    variant = with_integrator(model, integrator_of(model), scene.timestep)

    def setup(delay: float) -> Setup:
        late = replace(loop, delay=loop.delay + delay)
        return replace(pilot.setup, scenario=replace(scene.scenario, loop=late))

    @cache
    def trial(delay: float) -> StabilityTrial:
        return run_trial(setup(delay), variant, scene.scenario.duration, motion)

    is_calm = not _grows(variant, setup(0.0))

    def is_lost(delay: float) -> bool:
        return not trial(delay).stable or (is_calm and _grows(variant, setup(delay)))

    most = max(_LONGEST_DELAY * scene.scenario.duration, 2 * scene.timestep)
    count = max(2, round(_COUNT * math.log10(most / scene.timestep)) + 1)
    grid: list[float] = np.geomspace(scene.timestep, most, count).tolist()
    bounds = []
    for is_off in (is_lost, lambda delay: bool(trial(delay).astray)):
        largest = bisect(is_off, grid, _RESOLUTION, math.inf)
        delay = f"{loop.delay + min(largest, most):.3g} s"
        bounds.append(
            f"at every delay tried, up to {delay}"
            if math.isinf(largest)
            else f"up to a delay of {delay}"
            if largest
            else f"at no delay longer than {loop.delay:.3g} s"
        )
    span = f"for the {scene.scenario.duration:.3g} s of the scenario"
    clause = "small differences do not grow"
    if not is_calm:
        clause = f"small differences do not fade at its own delay, and it stays bounded {span}"
    return (
        f"with {Path(loop.path).name} every {loop.period:.3g} s {clause} {bounds[0]}, and it stays "
        f"near the motion of small steps {span if is_calm else 'for as long'} {bounds[1]}, at the "
        "scene's own setting"
    )


def _grows(model: Any, setup: Setup) -> bool:
    """Whether a run from nearby goes farther from the scenario's own in its second half."""
    data = initial_data(setup.scenario, model)
    position, velocity = nudges(model, 2, NEARBY)[0]
    mujoco.mj_integratePos(model, data.qpos, position, 1.0)
    start = {"qpos": tuple(data.qpos), "qvel": tuple(data.qvel + velocity)}
    nudged = replace(setup, scenario=replace(setup.scenario, **start))
    differences = simulate(nudged, model).states.qvel - simulate(setup, model).states.qvel
    first, second = np.array_split(differences, 2)
    return not np.linalg.norm(second) <= (1 + _RESOLUTION) * np.linalg.norm(first)
