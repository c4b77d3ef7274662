"""Speed against error of a model in its scenarios.

Entry point: `measure_scenario(model, scene, quick=…, clock=…, tell=…)`.

1. A first run in small steps shows what acts in a scenario and how long its motion can be
   predicted (`pilot`).
2. The reference is computed twice, in two ways (`known_motion`).
3. Every setting is run, judged and compared, then timed beside the model's own (`costs`). The
   error of a lost run is not given; no other is below ten floors of the reference. Errors count to
   the horizon, and what should be conserved is watched to the end. Errors are also given as a
   learner sees them: how far bodies are displaced or turned in a picture, where 1 is just visible.
4. Orders are fitted, stability limits looked for, the front drawn.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import asdict, replace

from coursebuild.numerics.costs import Clock, costs, front, verdict
from coursebuild.numerics.detector import driving_force
from coursebuild.numerics.known_motion import (
    Cone,
    KnownMotion,
    find_conserved,
    find_references,
    mean_late_energy,
)
from coursebuild.numerics.measure import (
    energy_drift,
    errors,
    fit_orders,
    measure_slip,
    momentum_drift,
    quantity_name,
    quantity_values,
    visible_error,
)
from coursebuild.numerics.pilot import PARTING_DISTANCE as CHAOS_DISTANCE
from coursebuild.numerics.pilot import (
    Pilot,
    own_setting,
    position_distances,
    run_pilot,
    settings,
    with_setting,
)
from coursebuild.numerics.problem import STANDARD, Sizes
from coursebuild.numerics.reports.scene_report import (
    FLOORS,
    Errors,
    FigureLine,
    MeasuredSetting,
    OrderRow,
    ScenarioReport,
    StableRow,
    SweepRow,
    WorkPrecisionRow,
)
from coursebuild.numerics.reports.shown_errors import setting_text
from coursebuild.numerics.scene import Scene, thickness
from coursebuild.numerics.simulation import (
    EngineStates,
    Run,
    motion_of,
    refsafe_active,
    refsafe_from,
    simulate,
)
from coursebuild.numerics.stability import run_trial, stable_rows
from coursebuild.numerics.sweep import with_contacts
from mjcourse.spatial import angular_distance


class Basis(Struct, frozen=True, eq=False):
    """What is known of a scene before its settings are measured."""

    model: Any
    pilot: Pilot
    baseline: MeasuredSetting
    """The scene's own setting."""
    cones: Mapping[str, Cone]
    energy: float | None
    """The scale for changes of energy, J; `None` where energy is not conserved."""
    momentum_conserved: bool
    late_energy: float | None
    """Mean kinetic energy after the horizon, J; `None` where it is the end."""

    @property
    def reference(self) -> KnownMotion:
        """The reference of the scene's own setting."""
        return self.cones[self.baseline.cone].reference


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
        tell: gets a line about each stage.

    Raises:
        SceneError: the scenario does not fit the model, or diverges at every timestep.
    """
    tell(f"{scene.name}: a first run")
    pilot = run_pilot(model, scene)
    tell(f"{scene.name}: the reference")
    cones = find_references(model, pilot, quick=quick)
    baseline = own_setting(model, pilot)
    reference = cones[baseline.cone].reference
    conserved = find_conserved(model, pilot, reference)
    late_energy = mean_late_energy(model, pilot, reference)
    basis = Basis(model, pilot, baseline, cones, *conserved, late_energy)
    measurements = []
    for setting in settings(model, pilot, quick=quick):
        tell(f"{scene.name}: {setting_text(setting)}")
        measurements.append(_measure_setting(basis, setting))
    rows = tuple(row for row, _ in measurements)
    if clock is not None:
        tell(f"{scene.name}: times")
        rows = _with_costs(basis, rows, clock, quick)
    tell(f"{scene.name}: stable timesteps")
    largest = stable_rows(model, pilot, quick=quick)
    rows = front(rows)
    judgement = verdict(rows, [noticeable for _, noticeable in measurements])
    if not any(row.own and row.status == "ok" for row in rows):  # nothing to compare costs with
        rows = tuple(replace(row, cost=None) for row in rows)
    return ScenarioReport(
        name=scene.name,
        title=scene.title,
        duration=scene.scenario.duration,
        horizon=reference.horizon,
        hold=scene.scenario.hold,
        reference=reference.kind,
        source=reference.source,
        floor=reference.floor.place,
        velocity_floor=reference.floor.velocity,
        second=reference.second,
        agreement=reference.agreement,
        lyapunov=pilot.lyapunov,
        horizons=None if pilot.lyapunov is None else pilot.horizons,
        smooth=pilot.smooth,
        notes=_notes(basis, largest),
        figure=quantity_name(model, scene),
        rows=rows,
        orders=_fit_orders(basis, rows) if pilot.smooth else (),
        figures=tuple(_measure_expected(basis)),
        stable=largest,
        verdict=judgement,
    )


def _measure_expected(basis: Basis) -> Iterator[FigureLine]:
    """What the scenario knows in theory, under every integrator at its own timestep."""
    scene = basis.pilot.scene
    expected = scene.declaration.expected
    for integrator in STANDARD if expected else ():
        setting = replace(basis.baseline, integrator=integrator.value)
        row = SweepRow("integrator", integrator.value, own=False, status="ok")
        row = with_contacts(scene.scenario, with_setting(basis.model, setting), row)
        for name, exact in expected.items():
            unit = "" if name == "restitution" else "m"
            value = getattr(row, name)
            if name != "restitution" and value is None:  # nothing touched
                value = 0.0
            yield FigureLine(name, unit, integrator.value, value, exact, "as declared")


def _notes(basis: Basis, largest: Sequence[StableRow]) -> tuple[str, ...]:
    """Remarks for reading the figures."""
    model, pilot, reference = basis.model, basis.pilot, basis.reference
    notes = [reference.note]
    if pilot.jumps:
        reasons = ", ".join(pilot.jumps)
        notes.append(f"errors follow no power of the timestep, because of {reasons}")
    if reference.horizon < pilot.scene.scenario.duration * (1 - 1e-9):
        notes.append(
            f"errors count until {reference.horizon:.6g} s: the motion is not known beyond"
        )
    drivers = driving_force(model, pilot.scene.scenario)
    if drivers:
        notes.append(f"energy is not judged: {drivers}")
    states = np.abs(np.hstack([reference.states.qpos, reference.states.qvel, reference.states.act]))
    if np.any((states > 0) & (states < np.finfo(np.float64).tiny)):
        notes.append("the state holds subnormal numbers, with which processors are slow")
    refsafe_limit = refsafe_from(model) if pilot.constrained else math.inf
    if any(
        (row.searched[1] if row.largest is None else row.largest) > refsafe_limit for row in largest
    ):
        notes.append(
            f"beyond {refsafe_limit:.6g} s refsafe softens constraints: stable, but another model"
        )
    return tuple(note for note in notes if note)


def _with_costs(
    basis: Basis, rows: Sequence[WorkPrecisionRow], clock: Clock, quick: bool
) -> tuple[WorkPrecisionRow, ...]:
    """Add the costs of usable settings, relative to the scene's own, or to the first without it."""
    usable = [index for index, row in enumerate(rows) if row.status == "ok"]
    if not usable:
        return tuple(rows)
    baseline = next((n for n, index in enumerate(usable) if rows[index].own), 0)
    settings = [rows[index].setting for index in usable]
    scene = basis.pilot.scene
    timings = costs(basis.model, scene, settings, baseline, clock, quick=quick)
    timed_rows = list(rows)
    for index, timing in zip(usable, timings, strict=True):
        seconds = timing.nanoseconds.scale(1e-9 / scene.scenario.duration)
        timed_rows[index] = replace(rows[index], cost=timing.ratio, seconds=seconds)
    return tuple(timed_rows)


def _fit_orders(basis: Basis, rows: Sequence[WorkPrecisionRow]) -> tuple[OrderRow, ...]:
    baseline, reference = basis.baseline, basis.reference
    motion = motion_of(basis.model, reference.states)
    angles = angular_distance(motion.attitude[:1], motion.attitude)
    extent = Sizes(
        float(np.linalg.norm(np.ptp(motion.position, axis=0))),
        float(angles.max(initial=0.0)),
        float(np.linalg.norm(np.ptp(motion.velocity, axis=0))),
    )
    orders = []
    for integrator in STANDARD:
        runs = [
            (row.setting.timestep, row)
            for row in rows
            if (row.setting.integrator, row.setting.solver_settings)
            == (integrator.value, baseline.solver_settings)
        ]
        orders.append(fit_orders(integrator.value, runs, reference.floor, extent))
    return tuple(orders)


def _measure_setting(
    basis: Basis, setting: MeasuredSetting
) -> tuple[WorkPrecisionRow, bool | None]:
    """Run a scene under a setting and compare it with its reference; the cost is added later.

    The flag says whether a learner sees the error, for the scene's own setting with that of its
    cone; `None` where the reference is not known well enough.
    """
    model, pilot, cone = basis.model, basis.pilot, basis.cones[setting.cone]
    variant = with_setting(model, setting)
    steps, energy = round(pilot.scene.scenario.duration / setting.timestep), basis.energy
    figures: dict[str, Any] = dict.fromkeys(WorkPrecisionRow.__struct_fields__)
    figures |= {  # as of a run that MuJoCo refuses
        "setting": setting,
        "status": "diverged",
        "reasons": (),
        "penetration": 0.0,
        "model_error": cone.model_error,
        "refsafe": pilot.constrained and refsafe_active(variant),
        "steps": steps,
        "own": setting == basis.baseline,
        "front": False,
    }
    row = WorkPrecisionRow(**figures)
    try:
        run = simulate(pilot.setup, variant, thickness(model))
    except mujoco.FatalError as error:
        return replace(row, reasons=(f"MuJoCo does not run it: {error}",)), None
    row = replace(
        row,
        status=run.judgement.status.value,
        reasons=run.judgement.reasons,
        energy_drift=None if energy is None else energy_drift(run.energy, energy),
        momentum_drift=momentum_drift(run.momentum) if basis.momentum_conserved else None,
        mean_energy=_mean_energy(run, cone.reference.horizon, basis.late_energy),
        penetration=run.penetration,
    )
    if not run.judgement.ok:
        variant = with_setting(model, setting)
        growth = run_trial(pilot.setup, variant, pilot.setup.scenario.duration).growth
        has_grown = math.isfinite(growth) and growth > 1
        return replace(row, growth=growth if has_grown else None), None
    return _with_errors(basis, row, run)


def _with_errors(
    basis: Basis, row: WorkPrecisionRow, run: Run
) -> tuple[WorkPrecisionRow, bool | None]:
    """Add the errors of a run that went well."""
    model, scene, cone = basis.model, basis.pilot.scene, basis.cones[row.setting.cone]
    reference = cone.reference
    states = run.states.head(len(reference.states.times))
    exact = motion_of(model, reference.states)
    run_errors = errors(motion_of(model, states), exact, reference.floor)
    floor = FLOORS * visible_error(model, scene, reference.states, reference.second_states)
    visible = visible_error(model, scene, states, reference.states)
    noticeable = None if max(1, visible) <= floor else visible >= 1
    if row.own and cone.visible_model_error >= 1:
        noticeable = True
    creep = None if cone.sticks is None else measure_slip(model, scene, states, cone.sticks)
    if basis.pilot.lyapunov is not None:
        gaps = position_distances(model, states.qpos, reference.states.qpos)
        far = np.flatnonzero(gaps >= CHAOS_DISTANCE)
        if far.size:
            row = replace(row, parted=float(states.times[far[0]]))
            run_errors = Errors(None, None, None)
    row = replace(
        row,
        **asdict(run_errors),
        figure=_quantity_error(basis, states, reference),
        seen=max(visible, floor) + cone.visible_model_error,
        slip=creep,
    )
    return row, noticeable


def _mean_energy(run: Run, horizon: float, expected: float | None) -> float | None:
    """Mean kinetic energy from the horizon to the end, relative to the expected one, less 1."""
    energies = run.energy[1:][run.states.times > horizon * (1 + 1e-9), 1]
    if expected is None or len(energies) < 2 or not np.isfinite(energies).all():
        return None
    return float(energies.mean()) / expected - 1


def _quantity_error(
    basis: Basis, states: EngineStates, reference: KnownMotion
) -> tuple[float, float] | None:
    """The error of the quantity that the scenario declares, at its largest and at the end."""
    model, scene = basis.model, basis.pilot.scene
    if not quantity_name(model, scene):
        return None
    exact, second = (
        quantity_values(model, scene, s) for s in (reference.states, reference.second_states)
    )
    floor = FLOORS * float(np.linalg.norm(exact - second, axis=1).max())
    distances = np.linalg.norm(quantity_values(model, scene, states) - exact, axis=1)
    return max(float(distances.max()), floor), max(float(distances[-1]), floor)
