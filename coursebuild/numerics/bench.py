"""Speed against error of a model in its scenarios.

Entry point: `measure_scene(model, declared, quick=…, clock=…, tell=…)`.

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

from coursebuild.core.model.scenarios import Declarations
from coursebuild.numerics.engine import refsafe_from
from coursebuild.numerics.front import FrontPoint, PlacedPoint, front, verdict, words
from coursebuild.numerics.measure import Errors, Sizes, fitted_orders
from coursebuild.numerics.observe import quantity_name
from coursebuild.numerics.pilot import pilot
from coursebuild.numerics.problem import STANDARD
from coursebuild.numerics.references import conserved, energy_beyond, references
from coursebuild.numerics.reports.bench import (
    OrderRow,
    RowVerdict,
    ScenarioReport,
    StableRow,
    WorkPrecisionRow,
)
from coursebuild.numerics.rows import Basis, MeasuredRow, measured
from coursebuild.numerics.scene import Scene, scenes
from coursebuild.numerics.settings import own_setting, settings, stable
from coursebuild.numerics.timing import Clock, Cost, costs, subnormal
from mjcourse.spatial import angular_distance

_STRAIGHT = 0.75
"""The difference of slopes on the way from which on errors follow no one power of the timestep."""


def measure_scene(
    model: Any,
    declared: Declarations | None,
    *,
    quick: bool = False,
    clock: Clock | None,
    tell: Callable[[str], None] = lambda _: None,
) -> tuple[ScenarioReport, ...]:
    """Measure a model (`mjModel`) in its scenarios.

    Args:
        model: compiled; it is not changed.
        declared: what its author wrote of it, if anything.
        quick: fewer timesteps, fewer repeats.
        clock: time so far in ns, best the processor time of the thread; `None`: nothing is timed.
        tell: is told what is being done.

    Raises:
        SceneError: a scenario does not fit the model, or diverges at every timestep.
    """
    return tuple(
        measure_scenario(model, one, quick=quick, clock=clock, tell=tell)
        for one in scenes(model, declared, quick=quick)
    )


def measure_scenario(
    model: Any,
    scene: Scene,
    *,
    quick: bool = False,
    clock: Clock | None,
    tell: Callable[[str], None] = lambda _: None,
) -> ScenarioReport:
    """Measure a model in one of its scenarios; see `measure_scene`."""
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
        tell(f"{scene.name}: {words(setting)}")
        found.append(measured(basis, setting))
    taken: list[Cost | None] = [None] * len(found)
    if clock is not None:
        tell(f"{scene.name}: times")
        taken = _times(basis, found, clock, quick)
    tell(f"{scene.name}: stable timesteps")
    largest = stable(model, first, quick=quick)
    points = [_point(one.row, cost) for one, cost in zip(found, taken, strict=True)]
    placed = front(points)
    comparable = any(one.ok for one in found if one.row.own)
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
        notes=_notes(basis, largest),
        figure=quantity_name(model, scene),
        rows=tuple(
            _placed_row(one.row, cost, place, scene.scenario.duration, comparable=comparable)
            for one, cost, place in zip(found, taken, placed, strict=True)
        ),
        orders=_orders(basis, found) if first.smooth else (),
        stable=largest,
        verdict=_verdict(basis, found, points, placed),
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
    if subnormal(model, first):
        notes.append("the state holds subnormal numbers, with which processors are slow")
    soft = refsafe_from(model) if first.constrained else math.inf
    if any((one.searched[1] if one.largest is None else one.largest) > soft for one in largest):
        notes.append(f"beyond {soft:.6g} s refsafe softens constraints: stable, but another model")
    return tuple(note for note in notes if note)


def _verdict(
    basis: Basis,
    found: Sequence[MeasuredRow],
    points: Sequence[FrontPoint | None],
    placed: Sequence[PlacedPoint],
) -> RowVerdict:
    """On the scene's own setting."""
    own = next(number for number, one in enumerate(found) if one.row.own)
    mine, cone = found[own], basis.cones[basis.own.cone]
    noticeable = True if cone.seen >= 1 and mine.ok else mine.noticeable
    unseen = [
        (point.cost, number)
        for number, (point, one) in enumerate(zip(points, found, strict=True))
        if point is not None and one.row.seen is not None and one.row.seen < 1
    ]
    return verdict(
        [one.row.setting for one in found],
        points,
        placed,
        own,
        None if noticeable is None else mine.row.seen,
        mine.row.reasons,
        min(unseen)[1] if unseen else None,
        hopeless=all(one.noticeable for one in found if one.ok),
    )


# ------------------------------------------------------------------------------------------- rows


def _times(
    basis: Basis, found: Sequence[MeasuredRow], clock: Clock, quick: bool
) -> list[Cost | None]:
    """What the usable settings cost; where the scene's own is not, relative to the first."""
    usable = [index for index, one in enumerate(found) if one.ok]
    taken: list[Cost | None] = [None] * len(found)
    if not usable:
        return taken
    chosen = [found[index].row.setting for index in usable]
    own = next((n for n, index in enumerate(usable) if found[index].row.own), 0)
    spent = costs(basis.model, basis.first, chosen, own, clock, quick=quick)
    for index, cost in zip(usable, spent, strict=True):
        taken[index] = cost
    return taken


def _point(row: WorkPrecisionRow, cost: Cost | None) -> FrontPoint | None:
    if cost is None or row.seen is None:
        return None
    return FrontPoint(cost.ratio, row.seen if row.figure is None else row.figure[0])


def _placed_row(
    row: WorkPrecisionRow,
    cost: Cost | None,
    place: PlacedPoint,
    duration: float,
    *,
    comparable: bool,
) -> WorkPrecisionRow:
    """A row with its cost; `comparable`: whether the scene's own setting has one."""
    row = replace(row, front=place.front, dominated_by=place.dominated_by)
    if cost is None:
        return row
    seconds = cost.step * 1e-9 * row.steps
    return replace(
        row,
        cost=cost.ratio if comparable else None,
        cost_uncertainty=cost.uncertainty if comparable else None,
        realtime=duration / seconds if seconds else None,
        spread=cost.spread,
    )


def _orders(basis: Basis, found: Sequence[MeasuredRow]) -> tuple[OrderRow, ...]:
    own, known = basis.own, basis.known
    motion = known.motion
    turned = angular_distance(motion.attitude[:1], motion.attitude)
    extent = Sizes(
        float(np.linalg.norm(np.ptp(motion.position, axis=0))),
        float(turned.max(initial=0.0)),
        float(np.linalg.norm(np.ptp(motion.velocity, axis=0))),
    )
    rows = []
    for integrator in STANDARD:
        runs = [
            (row.setting.timestep, Errors(row.position, row.attitude, row.velocity))
            for row in (one.row for one in found)
            if replace(row.setting, timestep=own.timestep)
            == replace(own, integrator=integrator.value)
        ]
        rows.append(
            fitted_orders(integrator.value, runs, known.floor, extent=extent, bent=_STRAIGHT)
        )
    return tuple(rows)
