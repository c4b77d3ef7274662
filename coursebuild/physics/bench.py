"""Speed against error of a model in its scenarios.

Entry point: `measure_scene(model, declared, quick=…, clock=…, said=…)`.

1. A first run in small steps says what acts in a scenario and how far it can be told (`pilot`).
2. The reference is made, and made again in another way (`knowing`).
3. Every setting is run and compared (`rows`), then timed beside the model's own (`costs`).
4. Orders are fitted, stability limits looked for, the front drawn (`front`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import mujoco
import numpy as np

from coursebuild.measured.bench import (
    OrderRow,
    ScenarioReport,
    Setting,
    StableRow,
    Verdict,
    WorkPrecisionRow,
)
from coursebuild.model.scenarios import Declarations
from coursebuild.physics.costs import Cost, costs, subnormal
from coursebuild.physics.detector import Judgement, Status
from coursebuild.physics.engine import Run, begun, invariants, simulate_model, varied
from coursebuild.physics.front import Placed, Point, front, verdict, words
from coursebuild.physics.grid import apply, own_setting, settings
from coursebuild.physics.knowing import Known, difference, itself, know
from coursebuild.physics.measure import (
    Error,
    Errors,
    energy_drift,
    energy_scale,
    momentum_drift,
    order,
)
from coursebuild.physics.pilot import Pilot, pilot
from coursebuild.physics.problem import STANDARD, Integrator
from coursebuild.physics.rows import Conserved, Measured, figure_name, measured, visible_error
from coursebuild.physics.scene import Scene, scenes, thickness
from coursebuild.physics.stability import Trial, attempted, scan
from coursebuild.physics.timing import Clock
from coursebuild.values import dataclass

CONSERVED = 1e-8
"""Relative change, over the reference, of what is called conserved."""
SEARCH = (0.25, 64.0)
"""Between which multiples of the model's timestep the largest stable one is looked for."""
MOST_STEPS = 200_000
"""Steps of one trial of a timestep."""


def measure_scene(
    model: Any,
    declared: Declarations | None,
    *,
    quick: bool = False,
    clock: Clock | None,
    said: Callable[[str], None] = lambda _: None,
) -> tuple[ScenarioReport, ...]:
    """Measure a model (`mjModel`) in its scenarios.

    Args:
        model: compiled; it is not changed.
        declared: what its author wrote of it, if anything.
        quick: fewer timesteps, fewer repeats.
        clock: time so far in ns, best the processor time of the thread; `None`: nothing is timed.
        said: is told what is being done.

    Raises:
        SceneError: a scenario does not fit the model, or diverges at every timestep.
    """
    return tuple(
        measure_scenario(model, one, quick=quick, clock=clock, said=said)
        for one in scenes(model, declared, quick=quick)
    )


def measure_scenario(
    model: Any,
    scene: Scene,
    *,
    quick: bool = False,
    clock: Clock | None,
    said: Callable[[str], None] = lambda _: None,
) -> ScenarioReport:
    """Measure a model in one of its scenarios; see `measure_scene`."""
    said(f"{scene.name}: a first run")
    first = pilot(model, scene)
    said(f"{scene.name}: the reference")
    by_cone = _references(model, scene, first, quick)
    own = own_setting(model, scene, first)
    chosen = settings(model, scene, first, quick=quick)
    known = by_cone[own.cone].known
    conserved = _conserved(model, scene, first, known)
    found = []
    for setting in chosen:
        said(f"{scene.name}: {words(setting)}")
        reference = by_cone[setting.cone].known
        found.append(measured(model, scene, first, reference, conserved, setting))
    taken: list[Cost | None] = [None] * len(found)
    if clock is not None:
        said(f"{scene.name}: times")
        taken = _times(model, scene, first, found, chosen.index(own), clock, quick)
    said(f"{scene.name}: stable timesteps")
    stable = _stable(model, scene, first, quick)
    beyond = _beyond(model, scene, first, known)
    points = [_point(row, cost, by_cone) for row, cost in zip(found, taken, strict=True)]
    placed = front(points)
    comparable = found[chosen.index(own)].judgement.ok
    rows = tuple(
        _row(model, scene, first, row, cost, place, by_cone, own, beyond, comparable)
        for row, cost, place in zip(found, taken, placed, strict=True)
    )
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
        smooth=first.smooth,
        notes=_notes(model, scene, first, known),
        figure=figure_name(model, scene),
        rows=rows,
        orders=_orders(found, known, own) if first.smooth else (),
        stable=stable,
        verdict=_verdict(chosen, points, placed, found, chosen.index(own), by_cone),
    )


# ------------------------------------------------------------------------------------- references


@dataclass(frozen=True, slots=True)
class _Cone:
    """What errors under a cone are measured against."""

    known: Known
    model_error: float | None
    """What remains of the error however small the timestep, m or rad."""
    seen: float
    """The same in a picture, where it is not in the errors already."""


def _references(model: Any, scene: Scene, first: Pilot, quick: bool) -> dict[str, _Cone]:
    """By cone; by "" where nothing touches."""
    known = know(model, scene, first, quick=quick)
    if not first.contact:
        return {"": _Cone(known, None, 0.0)}
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
        if known.kind == "closed":
            found[cone] = _Cone(known, gap.place, 0.0)
        elif cone == "elliptic":
            found[cone] = _Cone(limit, None, 0.0)
        else:
            seen = visible_error(model, scene, limit.until(count).states, truth.until(count).states)
            found[cone] = _Cone(limit, gap.place, seen)
    return found


def _conserved(model: Any, scene: Scene, first: Pilot, known: Known) -> Conserved:
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


def _beyond(model: Any, scene: Scene, first: Pilot, known: Known) -> float | None:
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


def _notes(model: Any, scene: Scene, first: Pilot, known: Known) -> tuple[str, ...]:
    """What to know when reading the figures."""
    notes = [known.note]
    if first.jumps:
        reasons = ", ".join(first.jumps)
        notes.append(f"errors follow no power of the timestep, because of {reasons}")
    if known.horizon < scene.scenario.duration * (1 - 1e-9):
        notes.append(f"errors count until {known.horizon:.6g} s: the motion is not known beyond")
    if subnormal(model, scene, first):
        notes.append("the state holds subnormal numbers, with which processors are slow")
    return tuple(note for note in notes if note)


def _verdict(
    chosen: Sequence[Setting],
    points: Sequence[Point | None],
    placed: Sequence[Placed],
    found: Sequence[Measured],
    own: int,
    by_cone: dict[str, _Cone],
) -> Verdict:
    """On the scene's own setting, number `own`."""
    mine = found[own]
    model_error = by_cone[mine.setting.cone].seen
    noticeable = True if model_error >= 1 and mine.judgement.ok else mine.noticeable
    seen = None if mine.seen is None or noticeable is None else mine.seen + model_error
    return verdict(chosen, points, placed, own, seen, mine.judgement.reasons)


# ------------------------------------------------------------------------------------------- rows


def _times(
    model: Any,
    scene: Scene,
    first: Pilot,
    found: Sequence[Measured],
    own: int,
    clock: Clock,
    quick: bool,
) -> list[Cost | None]:
    """What the usable settings cost; where the scene's own is not, relative to the first."""
    usable = [index for index, row in enumerate(found) if row.judgement.ok]
    taken: list[Cost | None] = [None] * len(found)
    if not usable:
        return taken
    chosen = [found[index].setting for index in usable]
    beside = usable.index(own) if own in usable else 0
    spent = costs(model, scene, first, chosen, beside, clock, quick=quick)
    for index, cost in zip(usable, spent, strict=True):
        taken[index] = cost
    return taken


def _point(row: Measured, cost: Cost | None, by_cone: dict[str, _Cone]) -> Point | None:
    if cost is None or row.seen is None:
        return None
    if row.figure is not None:
        return Point(cost.ratio, row.figure.largest)
    return Point(cost.ratio, row.seen + by_cone[row.setting.cone].seen)


def _row(
    model: Any,
    scene: Scene,
    first: Pilot,
    row: Measured,
    cost: Cost | None,
    place: Placed,
    by_cone: dict[str, _Cone],
    own: Setting,
    beyond: float | None,
    comparable: bool,
) -> WorkPrecisionRow:
    seconds = None if cost is None else cost.step * 1e-9 * row.steps
    mean, errors = row.mean_energy, row.errors or Errors(None, None, None)
    return WorkPrecisionRow(
        setting=row.setting,
        status=row.judgement.status.value,
        reasons=row.judgement.reasons,
        position=_both(errors.position),
        attitude=_both(errors.attitude),
        velocity=_both(errors.velocity),
        figure=_both(row.figure),
        seen=row.seen,
        energy_drift=row.energy_drift,
        momentum_drift=row.momentum_drift,
        mean_energy=None if mean is None or beyond is None else mean / beyond - 1,
        penetration=row.penetration,
        slip=None,
        model_error=by_cone[row.setting.cone].model_error,
        refsafe=row.refsafe,
        steps=row.steps,
        cost=None if cost is None or not comparable else cost.ratio,
        cost_uncertainty=None if cost is None or not comparable else cost.uncertainty,
        realtime=None if not seconds else scene.scenario.duration / seconds,
        spread=None if cost is None else cost.spread,
        growth=None if row.judgement.ok else _growth(model, scene, first, row),
        own=row.setting == own,
        front=place.front,
        dominated_by=place.dominated_by,
    )


def _both(error: Error | None) -> tuple[float, float] | None:
    return None if error is None else (error.largest, error.end)


def _growth(model: Any, scene: Scene, first: Pilot, row: Measured) -> float | None:
    one = varied(model, Integrator(row.setting.integrator), row.setting.timestep)
    apply(one, row.setting)
    try:
        growth = attempted(first.setup, one, row.steps).growth
    except mujoco.FatalError:
        return None
    return growth if math.isfinite(growth) and growth > 1 else None


def _orders(found: Sequence[Measured], known: Known, own: Setting) -> tuple[OrderRow, ...]:
    rows = []
    for integrator in STANDARD:
        mine = [
            row
            for row in found
            if row.setting.integrator == integrator.value
            and (row.setting.solver, row.setting.iterations) == (own.solver, own.iterations)
            and row.setting.cone == own.cone
        ]
        rows.append(
            OrderRow(
                integrator.value,
                _order(mine, "position", known.floor.position),
                _order(mine, "attitude", known.floor.attitude),
                _order(mine, "velocity", known.floor.velocity),
            )
        )
    return tuple(rows)


def _order(rows: Sequence[Measured], part: str, floor: float) -> float | None:
    pairs = [
        (row.setting.timestep, getattr(row.errors, part).largest)
        for row in rows
        if row.errors is not None and getattr(row.errors, part) is not None
    ]
    fit = order([step for step, _ in pairs], [error for _, error in pairs], floor)
    return None if fit is None else fit.value


# -------------------------------------------------------------------------------------- stability


def _stable(model: Any, scene: Scene, first: Pilot, quick: bool) -> tuple[StableRow, ...]:
    """The largest stable timestep of every integrator."""
    duration = scene.scenario.duration
    low, high = (part * scene.own for part in SEARCH)
    search = (max(low, duration / MOST_STEPS), min(high, duration / 20))
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
