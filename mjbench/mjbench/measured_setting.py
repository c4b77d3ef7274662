"""One setting in a scene: run, judged and compared with its reference."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import asdict, replace

from mjbench import measure, simulation
from mjbench.cones import Cone
from mjbench.known_motion import KnownMotion
from mjbench.pilot import Pilot, horizon_errors, position_distances
from mjbench.reports import scene_report
from mjbench.settings import with_setting


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
        "status": "diverged",  # as of a run that MuJoCo refuses
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
        return replace(row, reasons=(f"MuJoCo does not run it: {error}",)), None
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
    sizes["step_error"] = measure.visible_errors(model, scene, states, reference.states)
    leasts = {
        "position": scene_report.FLOORS * reference.floor.position,
        "attitude": scene_report.FLOORS * reference.floor.attitude,
        "velocity": scene_report.FLOORS * reference.floor.velocity,
        "step_error": basis.least_seen,
        "figure": basis.least_figure,
    }
    if measure.quantity_name(model, scene):
        sizes["figure"] = measure.quantity_errors(model, scene, states, reference.states)
    middle = (len(states.times) + 1) // 2
    halves = {
        name: tuple(max(float(part.max()), leasts[name]) for part in (row[:middle], row[middle:]))
        for name, row in sizes.items()
        if len(row) > 1
    }
    step_error = max(float(sizes["step_error"].max(initial=0.0)), basis.least_seen)
    figure = None
    if "figure" in sizes:
        ends = np.maximum([sizes["figure"].max(), sizes["figure"][-1]], basis.least_figure)
        figure = float(ends[0]), float(ends[1])
    return replace(
        row,
        **asdict(measure.errors(motion, exact, reference.floor)),
        figure=figure,
        step_error=step_error,
        seen=step_error + cone.visible_model_error,
        slip=creep,
        halves=halves,
    )
