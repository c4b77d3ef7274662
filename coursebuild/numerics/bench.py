"""Speed against error of a model in its scenarios.

Entry point: `measure_scenario(model, scene, quick=…, clock=…, tell=…)`.

1. A first run in small steps says what acts in a scenario and how far it can be told (`pilot`).
2. The reference is made, and made again in another way (`references`).
3. Every setting is run, judged and compared, then timed beside the model's own (`timing`). The
   error of a run that was lost is not given; no other is below ten floors of the reference. Errors
   count to the horizon, and what should be conserved is watched to the end. Errors are also said as
   a learner sees them: by how far bodies are displaced or turned in a picture, where 1 is just
   visible.
4. Orders are fitted, stability limits looked for, the front drawn (`front`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import asdict, replace

from coursebuild.numerics.detector import driving_force
from coursebuild.numerics.engine import (
    EngineStates,
    Run,
    motion_of,
    refsafe_active,
    refsafe_from,
    simulate,
)
from coursebuild.numerics.front import front, verdict
from coursebuild.numerics.measure import energy_drift, errors, fitted_orders, momentum_drift
from coursebuild.numerics.observe import quantity_name, quantity_values, slip, visible_error
from coursebuild.numerics.pilot import Pilot, pilot
from coursebuild.numerics.problem import STANDARD, Sizes
from coursebuild.numerics.references import (
    Cone,
    KnownMotion,
    energy_beyond,
    find_conserved,
    references,
)
from coursebuild.numerics.reports.bench import (
    FLOORS,
    MeasuredSetting,
    OrderRow,
    ScenarioReport,
    StableRow,
    WorkPrecisionRow,
)
from coursebuild.numerics.reports.text import setting_text
from coursebuild.numerics.scene import Scene, thickness
from coursebuild.numerics.settings import own_setting, settings, stable, with_setting
from coursebuild.numerics.stability import run_trial
from coursebuild.numerics.timing import Clock, costs
from mjcourse.spatial import angular_distance


class Basis(Struct, frozen=True, eq=False):
    """All that is known of a scene before its settings are measured."""

    model: Any
    first: Pilot
    own: MeasuredSetting
    """The scene's own setting."""
    cones: Mapping[str, Cone]
    energy: float | None
    """What changes of energy are large against, J; `None` where energy is not conserved."""
    momentum_conserved: bool
    beyond: float | None
    """Mean kinetic energy beyond the horizon, J; `None` where nothing is beyond."""

    @property
    def known(self) -> KnownMotion:
        """The reference of the scene's own setting."""
        return self.cones[self.own.cone].known


def measure_scenario(
    model: Any,
    scene: Scene,
    *,
    quick: bool = False,
    clock: Clock | None,
    tell: Callable[[str], None] = lambda _: None,
) -> ScenarioReport:
    """Measure a model (`mjModel`) in one of its scenarios.

    Args:
        model: compiled; it is not changed.
        scene: the scenario.
        quick: fewer timesteps, fewer repeats.
        clock: time so far in ns, best the processor time of the thread; `None`: nothing is timed.
        tell: is told what is being done.

    Raises:
        SceneError: the scenario does not fit the model, or diverges at every timestep.
    """
    tell(f"{scene.name}: a first run")
    first = pilot(model, scene)
    tell(f"{scene.name}: the reference")
    cones = references(model, first, quick=quick)
    own = own_setting(model, first)
    known = cones[own.cone].known
    conserved, beyond = find_conserved(model, first, known), energy_beyond(model, first, known)
    basis = Basis(model, first, own, cones, *conserved, beyond)
    found = []
    for setting in settings(model, first, quick=quick):
        tell(f"{scene.name}: {setting_text(setting)}")
        found.append(_measured(basis, setting))
    rows = tuple(row for row, _ in found)
    if clock is not None:
        tell(f"{scene.name}: times")
        rows = _timed(basis, rows, clock, quick)
    tell(f"{scene.name}: stable timesteps")
    largest = stable(model, first, quick=quick)
    rows = front(rows)
    judged = verdict(rows, [noticeable for _, noticeable in found])
    if not any(row.own and row.status == "ok" for row in rows):  # nothing to compare costs with
        rows = tuple(replace(row, cost=None) for row in rows)
    return ScenarioReport(
        name=scene.name,
        title=scene.title,
        duration=scene.scenario.duration,
        horizon=known.horizon,
        hold=scene.scenario.hold,
        reference=known.kind,
        source=known.source,
        floor=known.floor.place,
        velocity_floor=known.floor.velocity,
        second=known.second,
        agreement=known.agreement,
        lyapunov=first.lyapunov,
        horizons=None if first.lyapunov is None else first.horizons,
        smooth=first.smooth,
        notes=_notes(basis, largest),
        figure=quantity_name(model, scene),
        rows=rows,
        orders=_orders(basis, rows) if first.smooth else (),
        stable=largest,
        verdict=judged,
    )


def _notes(basis: Basis, largest: Sequence[StableRow]) -> tuple[str, ...]:
    """What to know when reading the figures."""
    model, first, known = basis.model, basis.first, basis.known
    notes = [known.note]
    if first.jumps:
        reasons = ", ".join(first.jumps)
        notes.append(f"errors follow no power of the timestep, because of {reasons}")
    if known.horizon < first.scene.scenario.duration * (1 - 1e-9):
        notes.append(f"errors count until {known.horizon:.6g} s: the motion is not known beyond")
    driven = driving_force(model, first.scene.scenario)
    if driven:
        notes.append(f"energy is not judged: {driven}")
    states = np.abs(np.hstack([known.states.qpos, known.states.qvel, known.states.act]))
    if np.any((states > 0) & (states < np.finfo(np.float64).tiny)):
        notes.append("the state holds subnormal numbers, with which processors are slow")
    soft = refsafe_from(model) if first.constrained else math.inf
    if any((one.searched[1] if one.largest is None else one.largest) > soft for one in largest):
        notes.append(f"beyond {soft:.6g} s refsafe softens constraints: stable, but another model")
    return tuple(note for note in notes if note)


def _timed(
    basis: Basis, rows: Sequence[WorkPrecisionRow], clock: Clock, quick: bool
) -> tuple[WorkPrecisionRow, ...]:
    """Rows with what usable settings cost; where the own one is not, relative to the first."""
    usable = [index for index, row in enumerate(rows) if row.status == "ok"]
    if not usable:
        return tuple(rows)
    own = next((n for n, index in enumerate(usable) if rows[index].own), 0)
    settings = [rows[index].setting for index in usable]
    scene = basis.first.scene
    spent = costs(basis.model, scene, settings, own, clock, quick=quick)
    found = list(rows)
    for index, timing in zip(usable, spent, strict=True):
        seconds = timing.nanoseconds.scaled(1e-9 / scene.scenario.duration)
        found[index] = replace(rows[index], cost=timing.ratio, seconds=seconds)
    return tuple(found)


def _orders(basis: Basis, found: Sequence[WorkPrecisionRow]) -> tuple[OrderRow, ...]:
    own, known = basis.own, basis.known
    motion = known.motion
    turned = angular_distance(motion.attitude[:1], motion.attitude)
    extent = Sizes(
        float(np.linalg.norm(np.ptp(motion.position, axis=0))),
        float(turned.max(initial=0.0)),
        float(np.linalg.norm(np.ptp(motion.velocity, axis=0))),
    )
    orders = []
    for integrator in STANDARD:
        runs = [
            (row.setting.timestep, row)
            for row in found
            if (row.setting.integrator, row.setting.solving) == (integrator.value, own.solving)
        ]
        orders.append(fitted_orders(integrator.value, runs, known.floor, extent))
    return tuple(orders)


def _measured(basis: Basis, setting: MeasuredSetting) -> tuple[WorkPrecisionRow, bool | None]:
    """Run a scene under a setting, and compare it with its reference; its cost is not known yet.

    Also whether a learner sees the error of the setting, for the scene's own with that of its cone;
    `None` where the reference is not known well enough.
    """
    model, first, cone = basis.model, basis.first, basis.cones[setting.cone]
    one = with_setting(model, setting)
    steps, energy = round(first.scene.scenario.duration / setting.timestep), basis.energy
    unknown = dict.fromkeys(("figure", "energy_drift", "momentum_drift", "slip", "cost", "seconds"))
    unknown |= dict.fromkeys(("position", "attitude", "velocity", "growth", "dominated_by"))
    row = WorkPrecisionRow(  # as of a run that MuJoCo refuses
        **unknown,
        setting=setting,
        status="diverged",
        reasons=(),
        penetration=0.0,
        model_error=cone.model_error,
        refsafe=first.constrained and refsafe_active(one),
        steps=steps,
        own=setting == basis.own,
        front=False,
    )
    try:
        run = simulate(first.setup, one, thickness(model))
    except mujoco.FatalError as error:
        return replace(row, reasons=(f"MuJoCo does not run it: {error}",)), None
    row = replace(
        row,
        status=run.judgement.status.value,
        reasons=run.judgement.reasons,
        energy_drift=None if energy is None else energy_drift(run, energy),
        momentum_drift=momentum_drift(run) if basis.momentum_conserved else None,
        mean_energy=_mean_energy(run, cone.known.horizon, basis.beyond),
        penetration=run.penetration,
    )
    if not run.judgement.ok:
        return replace(row, growth=_growth(basis, setting)), None
    return _with_errors(basis, row, run)


def _with_errors(
    basis: Basis, row: WorkPrecisionRow, run: Run
) -> tuple[WorkPrecisionRow, bool | None]:
    """With the errors of a run that went well."""
    model, scene, cone = basis.model, basis.first.scene, basis.cones[row.setting.cone]
    known = cone.known
    states = run.states.head(len(known.states.times))
    found = errors(motion_of(model, states), known.motion, known.floor)
    floor = FLOORS * visible_error(model, scene, known.states, known.other)
    shown = visible_error(model, scene, states, known.states)
    noticeable = None if max(1, shown) <= floor else shown >= 1
    if row.own and cone.seen >= 1:
        noticeable = True
    creep = None if cone.sticks is None else slip(model, scene, states, cone.sticks)
    row = replace(
        row,
        **asdict(found),
        figure=_quantity(basis, states, known),
        seen=max(shown, floor) + cone.seen,
        slip=creep,
    )
    return row, noticeable


def _mean_energy(run: Run, horizon: float, expected: float | None) -> float | None:
    """Mean kinetic energy from the horizon to the end, relative to what it should be, less 1."""
    later = run.energy[1:][run.states.times > horizon * (1 + 1e-9), 1]
    if expected is None or len(later) < 2 or not np.isfinite(later).all():
        return None
    return float(later.mean()) / expected - 1


def _growth(basis: Basis, setting: MeasuredSetting) -> float | None:
    """By what velocities were multiplied in a step, where they grew."""
    first, model = basis.first, with_setting(basis.model, setting)
    growth = run_trial(first.setup, model, first.setup.scenario.duration).growth
    return growth if math.isfinite(growth) and growth > 1 else None


def _quantity(basis: Basis, states: EngineStates, known: KnownMotion) -> tuple[float, float] | None:
    """The error of what the scenario declares to be measured."""
    model, scene = basis.model, basis.first.scene
    if not quantity_name(model, scene):
        return None
    exact, other = (quantity_values(model, scene, s) for s in (known.states, known.other))
    floor = FLOORS * float(np.linalg.norm(exact - other, axis=1).max())
    apart = np.linalg.norm(quantity_values(model, scene, states) - exact, axis=1)
    return max(float(apart.max()), floor), max(float(apart[-1]), floor)
