"""What a scene's errors are measured against: by cone, where something touches.

Entry points: `references(model, scene, pilot)`, `conserved(…)`, `energy_beyond(…)`.

1. Errors under a cone are those of the timestep and the solver: they are measured against what the
   engine tends to under that cone in small steps.
2. What remains then is the model's own error, a figure by itself: against the closed form where the
   scenario names one, else of a pyramid against the cone that it stands for. As any error it is
   given no smaller than ten floors.
"""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct

from coursebuild.numerics.detector import Judgement, Status
from coursebuild.numerics.engine import Run, begun, invariants, simulate_model, varied
from coursebuild.numerics.knowing import Known, difference, itself, know
from coursebuild.numerics.measure import FLOORS, energy_drift, energy_scale, momentum_drift
from coursebuild.numerics.pilot import Pilot
from coursebuild.numerics.problem import Integrator
from coursebuild.numerics.rows import Conserved, visible_error
from coursebuild.numerics.scene import Scene
from coursebuild.numerics.slip import Sticks, sticking

CONSERVED = 1e-8
"""Relative change, over the reference, of what is called conserved."""


class Cone(Struct, frozen=True):
    """What errors under a cone are measured against."""

    known: Known
    model_error: float | None
    """What remains of the error however small the timestep, m or rad."""
    seen: float
    """The same in a picture, where it is not in the errors already."""
    sticks: Sticks | None = None
    """What sticks in the reference; `None` where nothing touches."""


def references(model: Any, scene: Scene, first: Pilot, *, quick: bool = False) -> dict[str, Cone]:
    """By cone; by "" where nothing touches."""
    known = know(model, scene, first, quick=quick)
    if not first.contact:
        return {"": Cone(known, None, 0.0)}
    limits = {}
    for cone, number in (
        ("elliptic", mujoco.mjtCone.mjCONE_ELLIPTIC),
        ("pyramidal", mujoco.mjtCone.mjCONE_PYRAMIDAL),
    ):
        other = varied(model, Integrator.EULER, scene.own)
        other.opt.cone = number
        limits[cone] = itself(other, scene, first, quick=quick)
    found = {}
    for cone, limit in limits.items():
        truth = known if known.kind == "closed" else limits["elliptic"]
        count = min(len(limit.states.times), len(truth.states.times))
        gap = difference(limit.until(count).motion, truth.until(count).motion)
        sticks = sticking(model, scene, limit.states)
        least = FLOORS * max(limit.floor.place, truth.floor.place)
        if known.kind == "closed":
            found[cone] = Cone(known, max(gap.place, least), 0.0, sticks)
        elif cone == "elliptic":
            found[cone] = Cone(limit, None, 0.0, sticks)
        else:
            near, true = limit.until(count).states, truth.until(count).states
            seen = visible_error(model, scene, near, true) if gap.place > least else 0.0
            found[cone] = Cone(limit, max(gap.place, least), seen, sticks)
    return found


def conserved(model: Any, scene: Scene, first: Pilot, known: Known) -> Conserved:
    """What the author says is conserved, or else what the reference conserves."""
    declared = scene.declared.conserved if scene.declared is not None else None
    data, other = begun(first.setup, model), begun(first.setup, model)
    states = [(data.qpos, data.qvel), *zip(known.states.qpos, known.states.qvel, strict=True)]
    table = np.array([invariants(model, other, qpos, qvel) for qpos, qvel in states])
    run = Run(
        known.states.times,
        known.states.qpos,
        known.states.qvel,
        table[:, :2],
        table[:, 2:],
        0.0,
        Judgement(Status.OK),
        known.states.act,
    )
    scale = energy_scale(run)
    if declared is not None:
        energy = "energy" in declared and scale > 0
        return Conserved(scale if energy else None, "angular-momentum" in declared)
    if not first.smooth or known.kind == "self":
        return Conserved(None, momentum=False)
    drifts = energy_drift(run), momentum_drift(run)
    held = [drift is not None and abs(drift) < CONSERVED for drift in drifts]
    return Conserved(scale if held[0] else None, held[1])


def energy_beyond(model: Any, scene: Scene, first: Pilot, known: Known) -> float | None:
    """Mean kinetic energy beyond the horizon, J, in the smallest steps; `None` without such."""
    if known.horizon > scene.scenario.duration - scene.scenario.sample * 1.5:
        return None
    fine = varied(model, Integrator.IMPLICITFAST, min(scene.timesteps) / 2)
    if first.smooth:
        fine.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    run = simulate_model(first.setup, fine)
    later = run.energy[1:][run.times > known.horizon * (1 + 1e-9), 1]
    mean = float(later.mean())
    return mean if math.isfinite(mean) and mean > 0 else None
