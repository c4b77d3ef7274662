"""Speed against error of a model in its scenarios.

Every setting is run, judged and compared, then timed beside the model's own. The error of a lost
run is not given; no other is below ten floors of the reference. Errors count to the horizon, and
what should be conserved is watched to the end. Errors are also given as a learner sees them: how
far bodies are displaced or turned in a picture, where 1 is just visible.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mjbench import known_motion, measure, simulation
from mjbench.columns import LOST, WHOLE, Column, row_ratios
from mjbench.costs import Clock, costs
from mjbench.derive import derive_charts, derive_failures, derive_profile, derive_scenario
from mjbench.detector import driving_force
from mjbench.judge import compared_rows
from mjbench.measured_setting import Basis, find_references, least_known, measure_setting
from mjbench.parts import Parts
from mjbench.pilot import Pilot, horizon_error, nudges, run_pilot
from mjbench.profile import profile_rows
from mjbench.reports import reach_bound, scene_report
from mjbench.reports.shown_errors import (
    is_idle,
    setting_text,
    solving_parts,
)
from mjbench.scene import Scene, SceneError
from mjbench.settings import own_setting, settings, with_setting
from mjbench.stability import stable_rows
from mjbench.stability_runs import loop_note
from mjbench.sweep import DrawnModel
from mjbench.theory_figures import measure_expected

_CONSERVED = 1e-8
"""The relative change, over the reference, below which a quantity counts as conserved."""


def measure_scenario(
    model: Any,
    scene: Scene,
    variants: Sequence[DrawnModel] = (),
    *,
    quick: bool = False,
    clock: Clock | None,
    tell: Callable[[str], None] = lambda _: None,
    profile: bool = False,
) -> scene_report.ScenarioReport:
    """Measure a model (`mjModel`) in one of its scenarios.

    `variants`: the model with other parameters, for which a verdict has to hold too.
    `clock`: time so far in ns, best the processor time of the thread; `None`: nothing is timed.
    `tell` gets a line about each stage; `profile`: whether to say where the time goes. A
    `SceneError` where the scenario does not fit the model, or diverges at every timestep.
    """
    basis = find_basis(model, scene, quick=quick, tell=tell)
    pilot, cones, baseline, reference = basis.pilot, basis.cones, basis.baseline, basis.reference
    parts = Parts(tell)
    # A mistake in what is expected is told before all the rest is measured.
    figures = measure_expected(model, scene, baseline)
    expected = parts.collect(f"{scene.name}: what theory knows", figures, share=0.1)
    choices = settings(model, pilot, quick=quick)
    runs = _measure_settings(basis, choices, tell)
    rows = parts.collect(f"{scene.name}: settings", runs, share=0.25)
    rows.sort(key=lambda row: choices.index(row.setting))
    cost_of, no_verdict = None, scene_report.RowVerdict(None, "")
    if clock is not None and rows:
        timed = partial(_with_costs, basis, rows, clock, quick)
        result = parts.run(f"{scene.name}: times", timed, None, share=0.3)
        rows, cost_of = (rows, None) if result is None else result
    apart = partial(_error_parts, basis)
    error_parts = parts.run(f"{scene.name}: errors apart", apart, None, share=0.2)
    states = reference.states
    largest = stable_rows(model, pilot, states, parts, quick=quick)
    notes = list(_notes(basis, largest, rows, cost_of))
    draws = list[_Draw]()
    if variants:
        draw_all = _measure_draws(basis, variants, quick)
        draws = parts.collect(f"{scene.name}: drawn parameters", draw_all, share=0.5)
        notes += [draw.text for draw in draws]
    if scene.scenario.loop is not None:
        delays = partial(loop_note, model, pilot, states)
        notes.append(parts.run(f"{scene.name}: delays", delays, "", share=0.5))
    report = scene_report.ScenarioReport(
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
        notes=tuple(filter(None, notes)),
        overlaps=pilot.overlaps,
        figure=measure.quantity_name(model, scene),
        rows=tuple(rows),
        orders=measure.fit_scene_orders(model, rows, baseline, states, reference.floor)
        if pilot.smooth
        else (),
        figures=tuple(expected),
        stable=largest,
        verdict=no_verdict,
        least_seen=basis.least_seen,
        least_figure=basis.least_figure,
        cost_of=cost_of,
        horizon_error=horizon_error(model, scene),
        floors=(
            max(cone.reference.floor.place for cone in cones.values()),
            max(cone.reference.floor.velocity for cone in cones.values()),
        ),
        contact_model={name: cone.visible_model_error for name, cone in cones.items() if name},
        parts=error_parts,
        drawn=tuple(part.text for part in variants),
        failures=tuple(parts.failures),
    )

    def starts(number: int) -> Sequence[Mapping[Column, float]] | None:
        setting = report.rows[number].setting
        nearby = partial(_nearby_ratios, basis, report, setting, quick)
        near = parts.run(f"{scene.name}: starts nearby", nearby, None, share=0.8)
        if near is None or len(draws) < len(variants):
            return None
        with_draws = partial(_drawn_ratios, draws, report, setting)
        ratios = parts.run(f"{scene.name}: drawn parameters", with_draws, None)
        return None if ratios is None else [*near, *ratios]

    verdict = partial(derive_scenario, report, starts)
    report = parts.run(f"{scene.name}: verdict", verdict, report, at_once=True)
    report = parts.run(f"{scene.name}: plots", partial(derive_charts, report), report, at_once=True)
    if profile:
        phases = partial(profile_rows, model, scene, compared_rows(report), quick=quick)
        report = derive_profile(report, parts.run(f"{scene.name}: where the time goes", phases, ()))
    report = derive_failures(report, parts.failures)
    if parts.stopped:
        raise StoppedError(report)
    return report


def find_basis(
    model: Any, scene: Scene, *, quick: bool, tell: Callable[[str], None] = lambda _: None
) -> Basis:
    """What settings are compared with; a `SceneError` where the scene has no motion."""
    tell(f"{scene.name}: a first run")
    pilot = run_pilot(model, scene)
    tell(f"{scene.name}: the reference")
    cones = find_references(model, pilot, quick=quick)
    baseline = own_setting(model, pilot)
    reference = cones[baseline.cone].reference
    conserved = find_conserved(model, pilot, reference)
    leasts = zip(
        *(least_known(model, scene, cone.reference) for cone in cones.values()),
        strict=True,
    )
    return Basis(model, pilot, baseline, cones, *conserved, *map(max, leasts))


class StoppedError(Exception):
    """The user stopped a measurement; `report` has what is known."""

    def __init__(self, report: scene_report.ScenarioReport) -> None:
        super().__init__(f"stopped in the scenario {report.name}")
        self.report = report


def _error_parts(basis: Basis) -> scene_report.ErrorParts | None:
    """Where the error of the own setting comes from; `None` where it is lost or chaotic."""
    model, pilot, cone = basis.model, basis.pilot, basis.cones[basis.baseline.cone]
    if pilot.lyapunov is not None:
        return None
    scene, setup = pilot.scene, pilot.setup
    own_model = with_setting(model, basis.baseline)
    runs = [simulation.simulate(setup, own_model)]
    if pilot.constrained:
        runs.append(simulation.simulate(setup, simulation.with_converged_solver(own_model)))
    nudged = simulation.nudged(setup.scenario, model, nudges(model, 2, _LAST_DIGITS)[0])
    runs.append(simulation.simulate(replace(setup, scenario=nudged), own_model))
    if not all(run.judgement.ok for run in runs):
        return None
    count = len(cone.reference.states.times)
    own_states, *other_states = (run.states.head(count) for run in runs)
    best = other_states[0] if pilot.constrained else own_states
    return scene_report.ErrorParts(
        timestep=measure.visible_error(model, scene, best, cone.reference.states),
        solver=measure.visible_error(model, scene, own_states, best) if pilot.constrained else None,
        contact_model=cone.visible_model_error if pilot.contact else None,
        rounding=measure.visible_error(model, scene, own_states, other_states[-1]),
        least=basis.least_seen,
    )


_LAST_DIGITS = 1e-15
"""By how much a start differs whose last digits are others: rad, or relative to the extent."""


def find_conserved(
    model: Any, pilot: Pilot, reference: known_motion.KnownMotion
) -> tuple[float | None, bool]:
    """What the author says is conserved, or else what the reference conserves.

    The scale for changes of energy, J, or `None` where energy is not conserved; and whether the
    angular momentum about the centre of mass is.
    """
    scenario = pilot.scene.scenario
    conserved = pilot.scene.declaration.conserved
    data = simulation.initial_data(scenario, model)
    states = [
        (data.qpos.copy(), data.qvel.copy()),
        *zip(reference.states.qpos, reference.states.qvel, strict=True),
    ]
    table = np.array([simulation.invariants(model, data, qpos, qvel) for qpos, qvel in states])
    energies, momenta = table[:, :2], table[:, 2:]
    scale = measure.energy_scale(energies)
    if conserved is not None:
        energy = "energy" in conserved and scale > 0
        return scale if energy else None, "angular-momentum" in conserved
    if not pilot.smooth or reference.kind == "self":
        return None, False
    drifts = measure.energy_drift(energies), measure.momentum_drift(momenta)
    is_conserved = [drift is not None and abs(drift) < _CONSERVED for drift in drifts]
    return scale if is_conserved[0] else None, is_conserved[1]


def _measure_settings(
    basis: Basis, choices: Sequence[scene_report.MeasuredSetting], tell: Callable[[str], None]
) -> Iterator[scene_report.WorkPrecisionRow]:
    """The rows of settings, the scene's own first.

    What changes no bit at the own timestep is not crossed with others.
    """
    baseline, idle_solving = basis.baseline, set()
    base_states: simulation.EngineStates | None = None
    # Other solvers come last, and of them those at the own timestep first.
    for setting in sorted(
        choices,
        key=lambda s: (
            s != baseline,
            s.solver_settings != baseline.solver_settings,
            s.timestep != baseline.timestep,
        ),
    ):
        if setting.solver_settings in idle_solving and setting.timestep != baseline.timestep:
            continue
        tell(f"{basis.pilot.scene.name}: {setting_text(setting)}")
        row, states = measure_setting(basis, setting)
        base_states = states if row.own else base_states
        is_alike = setting == replace(setting, timestep=baseline.timestep)
        is_alike = is_alike and setting.integrator == baseline.integrator and not row.own
        if states is not None and base_states is not None and is_alike:
            pairs = ((states.qpos, base_states.qpos), (states.qvel, base_states.qvel))
            row = replace(row, same=all(np.array_equal(a, b) for a, b in pairs))
            idle_solving |= {setting.solver_settings} if row.same else set()
        yield row


def _nearby_ratios(
    basis: Basis,
    report: scene_report.ScenarioReport,
    rival: scene_report.MeasuredSetting,
    quick: bool,
) -> list[Mapping[Column, float]] | None:
    """From starts nearby, how many times as large errors are under another setting.

    `None` where nobody knows the motion from there.
    """
    model, pilot = basis.model, basis.pilot
    scene, scenario = pilot.scene, pilot.scene.scenario
    starts = nudges(model, 2 * (_QUICK_STARTS if quick else _STARTS), _NEARBY)
    part = max(rival.timestep, basis.baseline.timestep) / (_PARTS * (len(starts) + 1))
    fine = simulation.without_sleep(with_setting(model, replace(basis.baseline, timestep=part)))
    result: list[Mapping[Column, float]] = []
    for number, (position, velocity) in enumerate(starts, 1):
        data = simulation.initial_data(scenario, model)
        mujoco.mj_integratePos(model, data.qpos, position, 1.0)
        data.qvel[:] += velocity
        if pilot.jumps:
            simulation.advance(fine, data, _PARTS * number)
        start = {"qpos": tuple(data.qpos), "qvel": tuple(data.qvel)}
        nudged_scenario = replace(scenario, **start)
        setup = replace(pilot.setup, scenario=nudged_scenario)
        near = replace(pilot, scene=replace(scene, scenario=nudged_scenario), setup=setup)
        motions = {}
        for name in {basis.baseline.cone, rival.cone}:
            base = with_setting(model, replace(basis.baseline, cone=name))
            exact = known_motion.find_nearby(base, near, quick=quick)
            if exact is None:
                return None
            motions[name] = exact
        count, cones = min(len(exact.times) for exact in motions.values()), {}
        for name, exact in motions.items():
            reference = replace(basis.cones[name].reference, states=exact.head(count))
            cones[name] = replace(basis.cones[name], reference=reference, sticks=None)
        near_basis, pair = replace(basis, pilot=near, cones=cones), []
        for setting in (basis.baseline, rival):
            row, _ = measure_setting(near_basis, setting)
            if row.status != "ok":
                return result if setting == basis.baseline else [*result, {(LOST, WHOLE): math.inf}]
            pair.append(row)
        result.append(row_ratios(report, *pair))
    return result


class _Draw(Struct, frozen=True, eq=False):
    """The scene with drawn parameters."""

    basis: Basis | None
    """`None` where it has no motion."""
    row: scene_report.WorkPrecisionRow | None
    """Of the scene's own setting."""
    text: str


def _measure_draws(basis: Basis, variants: Sequence[DrawnModel], quick: bool) -> Iterator[_Draw]:
    """Measure the scene's own setting with parameters that are drawn."""
    scene = replace(basis.pilot.scene, exact=None)  # which is the motion of the model as it is
    for part in variants:
        words = f"with {part.text} (drawn) the scene's own setting"
        try:
            drawn_basis = find_basis(part.model, scene, quick=quick)
        except SceneError as error:
            yield _Draw(None, None, f"{words} cannot be measured: {error.message}")
            continue
        row, _ = measure_setting(drawn_basis, drawn_basis.baseline)
        text = f"{words} is lost: {'; '.join(row.reasons)}"
        if row.status == "ok":
            size = "what cannot be predicted" if row.seen is None else f"{row.seen:.2g}"
            text = f"{words} errs by {size} in what is seen"
        yield _Draw(drawn_basis, row, text)


def _drawn_ratios(
    draws: Sequence[_Draw],
    report: scene_report.ScenarioReport,
    rival: scene_report.MeasuredSetting,
) -> list[Mapping[Column, float]] | None:
    """How many times as large errors are under another setting, for each draw; `None`: unknown."""
    result: list[Mapping[Column, float]] = []
    for draw in draws:
        if draw.basis is None or draw.row is None or draw.row.status != "ok":
            return None
        cone = rival.cone if rival.cone in draw.basis.cones else draw.basis.baseline.cone
        row, _ = measure_setting(draw.basis, replace(rival, cone=cone))
        if row.status != "ok":
            return [*result, {(LOST, WHOLE): math.inf}]
        result.append(row_ratios(report, draw.row, row))
    return result


_NEARBY, _PARTS = 1e-4, 8
"""How far starts nearby are off: rad, or relative to the extent; velocities per s. Where something
is hit, they are also later by parts of a timestep, in so many steps each: where in a step a hit
falls is luck."""
_STARTS, _QUICK_STARTS = 2, 1
"""From how many random directions starts nearby come, each to both sides."""


def _notes(
    basis: Basis,
    largest: Sequence[scene_report.StableRow],
    rows: Sequence[scene_report.WorkPrecisionRow],
    cost_of: scene_report.MeasuredSetting | None,
) -> tuple[str, ...]:
    model, pilot, reference = basis.model, basis.pilot, basis.reference
    notes = [reference.note]
    if cost_of is not None:
        text = setting_text(cost_of)
        notes.append(f"costs are relative to {text}, as the scene's own setting does not run")
    idle = [", ".join(solving_parts(r.setting, basis.baseline)) for r in rows if is_idle(r)]
    if idle:
        notes.append(f"the same motion to the bit, and no time saved, with {'; '.join(idle)}")
    if pilot.jumps:
        reasons = ", ".join(pilot.jumps)
        notes.append(f"no orders are given, as accelerations may jump: {reasons}")
    slip = next((row.slip for row in rows if row.own), None) or 0.0
    cone = basis.cones[basis.baseline.cone]
    if cone.is_held and slip > scene_report.FLOORS * reference.floor.position:
        notes.append(
            f"what sticks creeps by {slip:.3g} m under the scene's own setting, "
            "though friction stays below its limit: in the engine it is soft"
        )
    if reference.horizon < pilot.scene.scenario.duration * (1 - 1e-9):
        notes.append(
            f"errors count until {reference.horizon:.6g} s: the motion is not known beyond"
        )
    if int(model.opt.enableflags) & mujoco.mjtEnableBit.mjENBL_SLEEP:
        notes.append("nothing sleeps in the reference, so errors hold what sleep changes")
    if drivers := driving_force(model, pilot.scene.scenario):
        notes.append(f"energy is not judged: {drivers}")
    limit = simulation.refsafe_from(model, contact=pilot.contact)
    refsafe_limit = limit if pilot.constrained else math.inf
    if any(min(reach_bound(row.largest), row.searched[1]) > refsafe_limit for row in largest):
        notes.append(
            f"beyond {refsafe_limit:.6g} s refsafe softens constraints: stable, but another model"
        )
    return tuple(notes)


def _with_costs(
    basis: Basis, rows: Sequence[scene_report.WorkPrecisionRow], clock: Clock, quick: bool
) -> tuple[list[scene_report.WorkPrecisionRow], scene_report.MeasuredSetting | None]:
    """Add the costs of usable settings, relative to the scene's own.

    Where that one was lost they are relative to the longest timestep under its integrator that
    runs, or else to the first setting that does; this is returned.
    """
    timed_rows = list(rows)
    usable = [index for index, row in enumerate(rows) if row.status == "ok"]
    if not usable:
        return timed_rows, None
    settings, baseline = [rows[index].setting for index in usable], basis.baseline
    alike = [s for s in settings if s == replace(baseline, timestep=s.timestep)]
    base = max(alike, key=lambda s: s.timestep, default=settings[0])
    base = baseline if baseline in settings else base
    scene, first = basis.pilot.scene, settings.index(base)
    # Where there is no time for all of them, there is for what they are compared with.
    settings.insert(0, settings.pop(first))
    usable.insert(0, usable.pop(first))
    timings = costs(basis.model, scene, settings, 0, clock, quick=quick)
    for index, timing in zip(usable, timings, strict=False):
        seconds = timing.nanoseconds.scale(1e-9 / scene.scenario.duration)
        timed_rows[index] = replace(rows[index], cost=timing.ratio, seconds=seconds)
    return timed_rows, None if base == baseline else base
