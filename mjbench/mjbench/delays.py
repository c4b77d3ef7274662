"""Up to which delay a controller in the loop does what it does without it."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace

from mjbench.pilot import Pilot
from mjbench.simulation import EngineStates, integrator_of, with_integrator
from mjbench.stability import bisect
from mjbench.stability_runs import StabilityTrial, kept_motion, run_trial

_COUNT, _RESOLUTION = 16, 1e-2
"""The delays that are tried in a decade, and the relative width at which a bisection ends."""
_LONGEST_DELAY = 0.25
"""The longest delay that is tried, relative to the scenario."""


def loop_note(model: Any, pilot: Pilot, reference: EngineStates) -> str:
    """Up to which delay a controller does what it does at the scenario's own, in words.

    At the model's own timestep and integrator; `reference`: the motion of small steps.
    """
    scene, setup = pilot.scene, pilot.setup
    loop = scene.scenario.loop
    assert loop is not None
    motion = kept_motion(model, pilot, reference)

    @cache
    def trial(delay: float) -> StabilityTrial:
        scenario = replace(scene.scenario, loop=replace(loop, delay=loop.delay + delay))
        variant = with_integrator(model, integrator_of(model), scene.timestep)
        return run_trial(replace(setup, scenario=scenario), variant, scenario.duration, motion)

    most = max(_LONGEST_DELAY * scene.scenario.duration, 2 * scene.timestep)
    count = max(2, round(_COUNT * math.log10(most / scene.timestep)) + 1)
    grid: list[float] = np.geomspace(scene.timestep, most, count).tolist()
    bounds = []
    for is_lost in (lambda h: not trial(h).stable, lambda h: bool(trial(h).astray)):
        largest = bisect(is_lost, grid, _RESOLUTION, math.inf)
        delay = f"{loop.delay + min(largest, most):.3g} s"
        bounds.append(
            f"at every delay tried, up to {delay}"
            if math.isinf(largest)
            else f"up to a delay of {delay}"
            if largest
            else f"at no delay longer than {loop.delay:.3g} s"
        )
    return (
        f"with {Path(loop.path).name} every {loop.period:.3g} s it stays bounded {bounds[0]}, and "
        f"near the motion of small steps {bounds[1]}, at the scene's own setting, for the "
        f"{scene.scenario.duration:.3g} s of the scenario: what grows slowly takes longer to show"
    )
