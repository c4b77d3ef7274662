"""Whether the engine itself tends to a motion that was integrated over its accelerations.

Entry point: `tends_to(model, setup, states, step, parted)`.

Two integrations over the same accelerations agree also where these are not the engine's own, as of
an activation that only a step clamps. So the engine is run in ever smaller steps: its difference
from the integration must vanish with them.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from coursebuild.numerics.engine import simulate_model, varied
from coursebuild.numerics.forward import States
from coursebuild.numerics.pilot import apart
from coursebuild.numerics.problem import Array, Integrator, Setup

AGREED = 1e-6
"""As near as the engine must come, in rad or relative to the extent, unless smaller steps bring it
nearer."""
NEARER = 0.75
"""The part of a difference that half the timestep may leave: half in first order, and some room."""
_PARTS = (2, 4, 8)
"""Parts of the timestep that are tried: the longer ones may be too long for any order to show."""


def tends_to(model: Any, setup: Setup, states: States, step: float, parted: float) -> bool:
    """Whether the engine comes nearer to these states, the smaller its steps are.

    Args:
        model: `mjModel`; it is not changed.
        setup: the scenario, as long as the states.
        states: at its samples.
        step: s; the longest to try.
        parted: the difference at which motions are compared, where it grows beyond: later they have
            nothing in common, however small the steps.
    """
    before = _gaps(model, setup, states, step)
    if before.max() <= AGREED:
        return True
    for part in _PARTS:
        now = _gaps(model, setup, states, step / part)
        beyond = np.flatnonzero(before > parted)
        at = int(beyond[0]) if beyond.size else int(np.argmax(before))
        if now[at] <= max(NEARER * before[at], AGREED):
            return True
        before = now
    return False


def _gaps(model: Any, setup: Setup, states: States, step: float) -> Array:
    """How far the engine is from these states at every sample: (n,); see `apart`."""
    for integrator in (Integrator.RK4, Integrator.IMPLICITFAST):
        try:
            run = simulate_model(setup, varied(model, integrator, step))
        except mujoco.FatalError:  # it does not run with everything
            continue
        if np.isfinite(run.qpos).all():
            pairs = zip(run.qpos, states.qpos, strict=True)
            return np.array([apart(model, mine, theirs) for mine, theirs in pairs])
    return np.full(len(states.times), np.inf)
