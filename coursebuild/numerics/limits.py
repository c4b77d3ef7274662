"""The largest stable timestep of a scene for each integrator.

Entry point: `stable(model, scene, pilot)`.

Stable is what stays within what can be, over the scenario: the grid and the bisection are those of
the hard cases. No timestep is tried of which the scenario has fewer than 20: of so few steps none
would tell.
"""

from __future__ import annotations

import math
from typing import Any

import mujoco

from coursebuild.numerics.detector import Status
from coursebuild.numerics.engine import varied
from coursebuild.numerics.grid import apply
from coursebuild.numerics.pilot import Pilot
from coursebuild.numerics.problem import STANDARD, Integrator
from coursebuild.numerics.reports.bench import Setting, StableRow
from coursebuild.numerics.reports.points import FEWEST_STEPS
from coursebuild.numerics.scene import Scene, thickness
from coursebuild.numerics.stability import Trial, attempted, scan

SEARCH = (0.25, 64.0)
"""Between which multiples of the model's timestep the largest stable one is looked for."""
MOST_STEPS = 200_000
"""Steps of one trial of a timestep."""


def stable(model: Any, scene: Scene, first: Pilot, *, quick: bool = False) -> tuple[StableRow, ...]:
    """The largest stable timestep of every integrator."""
    duration = scene.scenario.duration
    low, high = (part * scene.own for part in SEARCH)
    search = (max(low, duration / MOST_STEPS), min(high, duration / FEWEST_STEPS))
    if search[1] <= search[0]:
        return ()
    one, thick = varied(model, Integrator.EULER, scene.own), thickness(model)
    rows = []
    for integrator in STANDARD:

        def attempt(step: float, integrator: Integrator = integrator) -> Trial:
            apply(one, Setting(integrator.value, step, "", 0, ""))
            try:
                return attempted(first.setup, one, round(duration / step), thick)
            except mujoco.FatalError:
                return Trial(step, Status.DIVERGED, math.nan)

        found = scan(attempt, search, grid=6 if quick else 12, resolution=1e-2 if quick else 1e-3)
        largest = None if math.isinf(found.largest) else found.largest
        rows.append(StableRow(integrator.value, largest, not found.islands, search))
    return tuple(rows)
