"""References of a scene under each model of contacts, and settings that are run against them.

Errors under a cone are those of the timestep and the solver: they are measured against what the
engine tends to under that cone in small steps. What remains then is the model's own error: against
the closed form where the course has one, else of a pyramid against the cone that it stands for.
Both count over the same time, which is as long as the motion is known under each cone.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import asdict, replace

from mjbench import measure, simulation
from mjbench.known_motion import KnownMotion, find_reference, motion_gap, self_reference
from mjbench.measure import (
    Sticks,
    find_sticks,
    friction_holds,
    quantity_errors,
    quantity_name,
    visible_error,
)
from mjbench.pilot import Pilot, horizon_errors, position_distances
from mjbench.problem import ROUNDING, Integrator
from mjbench.reports import scene_report
from mjbench.reports.scene_report import FLOORS
from mjbench.scene import Scene
from mjbench.settings import CONES, with_setting
from mjbench.simulation import with_integrator, without_sleep


class Basis(Struct, frozen=True, eq=False):
    """What is known of a scene before its settings are measured."""

    model: Any
    pilot: Pilot
    baseline: scene_report.MeasuredSetting
    """The scene's own setting."""
    cones: Mapping[str, Cone]
    energy: float | None
    """The scale for changes of energy, J; `None` where energy is not conserved."""
    momentum_conserved: bool
    least_seen: float
    """Below this nothing is known of what is seen."""
    least_figure: float
    """The same of the declared quantity."""

    @property
    def reference(self) -> KnownMotion:
        """The reference of the scene's own setting."""
        return self.cones[self.baseline.cone].reference


def measure_setting(
    basis: Basis, setting: scene_report.MeasuredSetting
) -> tuple[scene_report.WorkPrecisionRow, simulation.EngineStates | None]:
    """Run a scene under a setting and compare it with its reference; the cost is added later.

    The states are those of the run; `None` where it was lost.
    """
    model, pilot, cone = basis.model, basis.pilot, basis.cones[setting.cone]
    variant = with_setting(model, setting)
    steps, energy = round(pilot.scene.scenario.duration / setting.timestep), basis.energy
    figures: dict[str, Any] = dict.fromkeys(scene_report.WorkPrecisionRow.__struct_fields__) | {
        "setting": setting,
        "status": "refused",
        "reasons": (),
        "penetration": 0.0,
        "model_error": cone.model_error,
        "refsafe": pilot.constrained and simulation.refsafe_active(variant, contact=pilot.contact),
        "steps": steps,
        "evaluations": steps * scene_report.step_evaluations(setting.integrator),
        "own": setting == basis.baseline,
        "halves": {},
        **dict.fromkeys(("lucky", "name"), ""),
        **dict.fromkeys(("front", "same", "idle"), False),
    }
    row = scene_report.WorkPrecisionRow(**figures)
    iterations = list[int]() if pilot.constrained else None
    try:
        run = simulation.simulate(pilot.setup, variant, iterations)
    except mujoco.FatalError as error:
        return replace(row, reasons=(str(error),)), None
    row = replace(
        row,
        status=run.judgement.status.value,
        reasons=run.judgement.reasons,
        energy_drift=None if energy is None else measure.energy_drift(run.energy, energy),
        momentum_drift=measure.momentum_drift(run.momentum) if basis.momentum_conserved else None,
        penetration=run.penetration,
    )
    if not run.judgement.ok:
        return row, None
    if iterations is not None:
        # A step of RK4 has four times the iterations of its last evaluation.
        row = replace(row, iterations=sum(iterations) * row.evaluations / steps)
    return _with_errors(basis, row, run), run.states


def _with_errors(
    basis: Basis, row: scene_report.WorkPrecisionRow, run: simulation.Run
) -> scene_report.WorkPrecisionRow:
    model, scene, cone = basis.model, basis.pilot.scene, basis.cones[row.setting.cone]
    reference = cone.reference
    states = run.states.head(len(reference.states.times))
    motion, exact = (simulation.motion_of(model, s) for s in (states, reference.states))
    creep = None if cone.sticks is None else measure.measure_slip(model, scene, states, cone.sticks)
    if basis.pilot.lyapunov is not None:
        unit = horizon_errors(model, scene)
        gaps = position_distances(model, states.qpos, reference.states.qpos, unit)
        far = np.flatnonzero(gaps >= 1)
        if far.size:
            # How far apart they are later depends on the last digit of the start.
            return replace(row, parted=float(states.times[far[0]]), slip=creep)
    sizes = measure.error_sizes(motion, exact)
    # Where nothing touches there is no model of contacts to tell apart.
    visible = "step_error" if basis.pilot.contact else "seen"
    sizes[visible] = measure.visible_errors(model, scene, states, reference.states)
    leasts = {part: FLOORS * size for part, size in asdict(reference.floor).items()}
    leasts |= {visible: basis.least_seen, "figure": basis.least_figure}
    if measure.quantity_name(model, scene):
        sizes["figure"] = measure.quantity_errors(model, scene, states, reference.states)
    middle = (len(states.times) + 1) // 2
    halves = {
        name: tuple(max(float(part.max()), leasts[name]) for part in (row[:middle], row[middle:]))
        for name, row in sizes.items()
        if len(row) > 1
    }
    size = max(float(sizes[visible].max(initial=0.0)), basis.least_seen)
    figure = None
    if "figure" in sizes:
        ends = np.maximum([sizes["figure"].max(), sizes["figure"][-1]], basis.least_figure)
        figure = float(ends[0]), float(ends[1])
    return replace(
        row,
        **asdict(measure.errors(motion, exact, reference.floor)),
        figure=figure,
        step_error=size if basis.pilot.contact else None,
        seen=size + cone.visible_model_error,
        slip=creep,
        halves=halves,
    )


class Cone(Struct, frozen=True):
    """The reference for errors under a cone."""

    reference: KnownMotion
    model_error: float | None
    """What remains of the error however small the timestep, m or rad."""
    visible_model_error: float
    """The same as a visible error; 0 where the errors contain it already."""
    sticks: Sticks | None = None
    """What sticks in the reference; `None` where nothing touches."""
    is_held: bool = False
    """Whether friction is below its limit there, so that what moves is creep."""


def find_references(model: Any, pilot: Pilot, *, quick: bool = False) -> dict[str, Cone]:
    """The references of a scene by cone, over the same time; under "" where nothing touches."""
    model, scene = without_sleep(model), pilot.scene
    reference = find_reference(model, pilot, quick=quick)
    if not pilot.contact:
        return {"": Cone(reference, None, 0.0)}
    motions = {}
    for cone, number in CONES.items():
        motions[cone] = reference
        if reference.kind != "self" or model.opt.cone != number:
            variant = with_integrator(model, Integrator.EULER, scene.timestep)
            variant.opt.cone = number
            motions[cone] = self_reference(variant, pilot, quick=quick)
    count = min(len(motion.states.times) for motion in (reference, *motions.values()))
    limits = {cone: _until(model, motion, count) for cone, motion in motions.items()}
    exact = _until(model, reference, count) if reference.kind == "closed" else None
    truth = exact or limits["elliptic"]
    cones = {}
    for cone, limit in limits.items():
        sticks = find_sticks(model, scene, limit.states)
        is_held = friction_holds(model, scene, limit.states, sticks)
        if limit is truth:
            cones[cone] = Cone(limit, None, 0.0, sticks, is_held)
            continue
        gap = motion_gap(model, limit.states, truth.states).place
        least = FLOORS * max(limit.floor.place, truth.floor.place)
        visible = 0.0
        if exact is None and gap > least:
            visible = visible_error(model, scene, limit.states, truth.states)
        cones[cone] = Cone(exact or limit, max(gap, least), visible, sticks, is_held)
    return cones


def _until(model: Any, motion: KnownMotion, count: int) -> KnownMotion:
    """So many samples of a motion: errors of settings are compared over the same time."""
    if count == len(motion.states.times):
        return motion
    states, second_states = motion.states.head(count), motion.second_states.head(count)
    gap = motion_gap(model, states, second_states)
    return replace(
        motion,
        states=states,
        second_states=second_states,
        floor=gap.at_least(ROUNDING) if motion.kind == "self" else motion.floor,
        agreement=gap.largest,
        horizon=float(states.times[-1]),
    )


def least_known(model: Any, scene: Scene, reference: KnownMotion) -> tuple[float, float]:
    """Below which a reference knows nothing of what is seen, and of the declared quantity.

    It is as much of what its two motions differ by there as it may be off in itself: a formula that
    was checked is far nearer to the truth than to the engine, whose friction and contacts are soft.
    """
    states, second_states, floor = reference.states, reference.second_states, reference.floor
    gap = motion_gap(model, states, second_states)
    share = min(1.0, floor.place / (gap.place or 1.0))
    least_seen = FLOORS * share * visible_error(model, scene, states, second_states)
    if not quantity_name(model, scene):
        return least_seen, 0.0
    share = max(share, min(1.0, floor.velocity / (gap.velocity or 1.0)))
    distances = quantity_errors(model, scene, states, second_states)
    return least_seen, FLOORS * share * float(distances.max())
