"""One setting in one scene: run, judge, compare.

Entry points: `Basis`, all that is known before; `measured(basis, setting)`.

1. A run is judged first: the error of one that was lost is not given.
2. Errors count to the horizon; what should be conserved is watched to the end.
3. Errors are also said as a learner sees them: by how far bodies are displaced or turned in a
   picture, where 1 is just visible.
4. No error is given below ten floors of its reference.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.numerics.engine import EngineStates, Run, motion_of, refsafe_active, simulate
from coursebuild.numerics.measure import Pair, energy_drift, errors, momentum_drift, raised
from coursebuild.numerics.observe import quantity_name, quantity_values, slip, visible_error
from coursebuild.numerics.pilot import Pilot
from coursebuild.numerics.references import Cone, Conserved, Known
from coursebuild.numerics.reports.bench import FLOORS, MeasuredSetting, WorkPrecisionRow
from coursebuild.numerics.scene import thickness
from coursebuild.numerics.settings import with_setting
from coursebuild.numerics.stability import attempted


class Basis(Struct, frozen=True, eq=False):
    """All that is known of a scene before its settings are measured."""

    model: Any
    first: Pilot
    own: MeasuredSetting
    """The scene's own setting."""
    cones: Mapping[str, Cone]
    conserved: Conserved
    beyond: float | None
    """Mean kinetic energy beyond the horizon, J; `None` where nothing is beyond."""

    @property
    def known(self) -> Known:
        """The reference of the scene's own setting."""
        return self.cones[self.own.cone].known


class MeasuredRow(Struct, frozen=True, eq=False):
    """What one setting gave; its cost is not known yet."""

    row: WorkPrecisionRow
    noticeable: bool | None
    """Whether a learner sees the error of the setting; `None` where the reference is not known well
    enough. The error of the cone is not counted."""

    @property
    def ok(self) -> bool:
        """Whether the run may be used."""
        return self.row.status == "ok"


def measured(basis: Basis, setting: MeasuredSetting) -> MeasuredRow:
    """Run a scene under a setting, and compare it with its reference."""
    model, first, cone = basis.model, basis.first, basis.cones[setting.cone]
    one = with_setting(model, setting)
    steps = round(first.scene.scenario.duration / setting.timestep)
    row = WorkPrecisionRow(
        setting=setting,
        status="diverged",
        reasons=(),
        position=None,
        attitude=None,
        velocity=None,
        figure=None,
        energy_drift=None,
        momentum_drift=None,
        penetration=0.0,
        slip=None,
        model_error=cone.model_error,
        refsafe=first.constrained and refsafe_active(one),
        steps=steps,
        cost=None,
        seconds=None,
        growth=None,
        own=setting == basis.own,
        front=False,
        dominated_by=None,
    )
    try:
        run = simulate(first.setup, one, thickness(model))
    except mujoco.FatalError as error:
        return MeasuredRow(replace(row, reasons=(f"MuJoCo does not run it: {error}",)), None)
    row = replace(
        row,
        status=run.judgement.status.value,
        reasons=run.judgement.reasons,
        energy_drift=_energy_drift(run, basis.conserved),
        momentum_drift=momentum_drift(run) if basis.conserved.momentum else None,
        mean_energy=_mean_energy(run, cone.known.horizon, basis.beyond),
        penetration=run.penetration,
    )
    if not run.judgement.ok:
        return MeasuredRow(replace(row, growth=_growth(basis, setting)), None)
    return _compared(basis, row, run)


def _compared(basis: Basis, row: WorkPrecisionRow, run: Run) -> MeasuredRow:
    """With the errors of a run that went well."""
    model, scene, cone = basis.model, basis.first.scene, basis.cones[row.setting.cone]
    known = cone.known
    states = run.states.head(len(known.states.times))
    found = raised(errors(motion_of(model, states), known.motion), known.floor)
    floor = FLOORS * visible_error(model, scene, known.states, known.other)
    shown = visible_error(model, scene, states, known.states)
    noticeable = None if max(1, shown) <= floor else shown >= 1
    creep = None if cone.sticks is None else slip(model, scene, states, cone.sticks)
    row = replace(
        row,
        position=found.position,
        attitude=found.attitude,
        velocity=found.velocity,
        figure=_quantity(basis, states, known),
        seen=max(shown, floor) + cone.seen,
        slip=creep,
    )
    return MeasuredRow(row, noticeable)


def _energy_drift(run: Run, conserved: Conserved) -> float | None:
    return None if conserved.energy is None else energy_drift(run, conserved.energy)


def _mean_energy(run: Run, horizon: float, expected: float | None) -> float | None:
    """Mean kinetic energy from the horizon to the end, relative to what it should be, less 1."""
    later = run.energy[1:][run.states.times > horizon * (1 + 1e-9), 1]
    if expected is None or len(later) < 2 or not np.isfinite(later).all():
        return None
    return float(later.mean()) / expected - 1


def _growth(basis: Basis, setting: MeasuredSetting) -> float | None:
    """By what velocities were multiplied in a step, where they grew."""
    first, model = basis.first, with_setting(basis.model, setting)
    try:
        growth = attempted(first.setup, model, first.setup.scenario.duration).growth
    except mujoco.FatalError:
        return None
    return growth if math.isfinite(growth) and growth > 1 else None


def _quantity(basis: Basis, states: EngineStates, known: Known) -> Pair | None:
    """The error of what the scenario declares to be measured."""
    model, scene = basis.model, basis.first.scene
    if not quantity_name(model, scene):
        return None
    exact, other = (quantity_values(model, scene, s) for s in (known.states, known.other))
    floor = FLOORS * float(np.linalg.norm(exact - other, axis=1).max())
    apart = np.linalg.norm(quantity_values(model, scene, states) - exact, axis=1)
    return max(float(apart.max()), floor), max(float(apart[-1]), floor)
