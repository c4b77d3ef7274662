"""Speed against error of a model in its scenarios.

Entry point: `measure_scenario(model, scene, quick=…, clock=…, tell=…)`.

1. A first run in small steps says what acts in a scenario and how far it can be told (`pilot`).
2. The reference is made, and made again in another way (`references`).
3. Every setting is run and compared (`rows`), then timed beside the model's own (`timing`).
4. Orders are fitted, stability limits looked for, the front drawn (`front`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from msgspec.structs import replace

from coursebuild.numerics.detector import driving_force
from coursebuild.numerics.engine import refsafe_from
from coursebuild.numerics.front import front, verdict
from coursebuild.numerics.measure import Errors, fitted_orders
from coursebuild.numerics.observe import quantity_name
from coursebuild.numerics.pilot import pilot
from coursebuild.numerics.problem import STANDARD, Sizes
from coursebuild.numerics.references import conserved, energy_beyond, references
from coursebuild.numerics.reports.bench import (
    OrderRow,
    ScenarioReport,
    StableRow,
    WorkPrecisionRow,
)
from coursebuild.numerics.reports.text import setting_text, solving
from coursebuild.numerics.rows import Basis, MeasuredRow, measured
from coursebuild.numerics.scene import Scene
from coursebuild.numerics.settings import own_setting, settings, stable
from coursebuild.numerics.timing import Clock, costs
from mjcourse.spatial import angular_distance


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
    invariant, beyond = conserved(model, first, known), energy_beyond(model, first, known)
    basis = Basis(model, first, own, cones, invariant, beyond)
    found = []
    for setting in settings(model, first, quick=quick):
        tell(f"{scene.name}: {setting_text(setting)}")
        found.append(measured(basis, setting))
    rows = tuple(one.row for one in found)
    if clock is not None:
        tell(f"{scene.name}: times")
        rows = _timed(basis, rows, clock, quick)
    tell(f"{scene.name}: stable timesteps")
    largest = stable(model, first, quick=quick)
    rows = front(rows)
    judged = verdict(rows, [_noticeable(basis, one) for one in found])
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


def _noticeable(basis: Basis, one: MeasuredRow) -> bool | None:
    """Whether a learner sees the error of a row, for the scene's own with that of its cone."""
    if one.row.own and one.ok and basis.cones[basis.own.cone].seen >= 1:
        return True
    return one.noticeable


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
            (row.setting.timestep, Errors(row.position, row.attitude, row.velocity))
            for row in found
            if (row.setting.integrator, solving(row.setting)) == (integrator.value, solving(own))
        ]
        orders.append(fitted_orders(integrator.value, runs, known.floor, extent))
    return tuple(orders)
