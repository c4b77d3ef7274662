"""Speed against error of a model in its scenarios.

Entry point: `measure_scene(model, declared, quick=…, clock=…, said=…)`.

1. A first run in small steps says what acts in a scenario and how far it can be told (`pilot`).
2. The reference is made, and made again in another way (`knowing`).
3. Every setting is run and compared (`rows`), then timed beside the model's own (`costs`).
4. Orders are fitted, stability limits looked for, the front drawn (`front`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import mujoco
import numpy as np

from coursebuild.model.scenarios import Declarations
from coursebuild.numerics.costs import Cost, costs, subnormal
from coursebuild.numerics.engine import refsafe_from, varied
from coursebuild.numerics.front import Placed, Point, front, verdict, words
from coursebuild.numerics.grid import apply, own_setting, settings
from coursebuild.numerics.knowing import Known
from coursebuild.numerics.limits import stable
from coursebuild.numerics.measure import HIGHEST, LOWEST, Error, Errors, order
from coursebuild.numerics.pilot import Pilot, pilot
from coursebuild.numerics.problem import STANDARD, Integrator
from coursebuild.numerics.reports.bench import (
    OrderRow,
    ScenarioReport,
    Setting,
    StableRow,
    Verdict,
    WorkPrecisionRow,
)
from coursebuild.numerics.rotation import angle_between
from coursebuild.numerics.rows import Measured, figure_name, measured
from coursebuild.numerics.scene import Scene, scenes
from coursebuild.numerics.stability import attempted
from coursebuild.numerics.timing import Clock
from coursebuild.numerics.truth import Cone, conserved, energy_beyond, references


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
    by_cone = references(model, scene, first, quick=quick)
    own = own_setting(model, scene, first)
    chosen = settings(model, scene, first, quick=quick)
    known = by_cone[own.cone].known
    invariant = conserved(model, scene, first, known)
    found = []
    for setting in chosen:
        said(f"{scene.name}: {words(setting)}")
        cone = by_cone[setting.cone]
        found.append(measured(model, scene, first, cone.known, invariant, setting, cone.sticks))
    taken: list[Cost | None] = [None] * len(found)
    if clock is not None:
        said(f"{scene.name}: times")
        taken = _times(model, scene, first, found, chosen.index(own), clock, quick)
    said(f"{scene.name}: stable timesteps")
    largest = stable(model, scene, first, quick=quick)
    beyond = energy_beyond(model, scene, first, known)
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
        notes=_notes(model, scene, first, known, largest),
        figure=figure_name(model, scene),
        rows=rows,
        orders=_orders(found, known, own, _extents(known)) if first.smooth else (),
        stable=largest,
        verdict=_verdict(chosen, points, placed, found, chosen.index(own), by_cone),
    )


# ------------------------------------------------------------------------------------------ words


def _notes(
    model: Any, scene: Scene, first: Pilot, known: Known, largest: Sequence[StableRow]
) -> tuple[str, ...]:
    """What to know when reading the figures."""
    notes = [known.note]
    if first.jumps:
        reasons = ", ".join(first.jumps)
        notes.append(f"errors follow no power of the timestep, because of {reasons}")
    if known.horizon < scene.scenario.duration * (1 - 1e-9):
        notes.append(f"errors count until {known.horizon:.6g} s: the motion is not known beyond")
    if subnormal(model, scene, first):
        notes.append("the state holds subnormal numbers, with which processors are slow")
    soft = refsafe_from(model) if first.constrained else math.inf
    if any((one.searched[1] if one.largest is None else one.largest) > soft for one in largest):
        notes.append(f"beyond {soft:.6g} s refsafe softens constraints: stable, but another model")
    return tuple(note for note in notes if note)


def _verdict(
    chosen: Sequence[Setting],
    points: Sequence[Point | None],
    placed: Sequence[Placed],
    found: Sequence[Measured],
    own: int,
    by_cone: dict[str, Cone],
) -> Verdict:
    """On the scene's own setting, number `own`."""
    mine = found[own]
    model_error = by_cone[mine.setting.cone].seen
    noticeable = True if model_error >= 1 and mine.judgement.ok else mine.noticeable
    seen = None if mine.seen is None or noticeable is None else mine.seen + model_error
    unseen = [
        (point.cost, number)
        for number, (point, row) in enumerate(zip(points, found, strict=True))
        if point is not None and row.seen is not None
        if row.seen + by_cone[row.setting.cone].seen < 1
    ]
    hopeless = all(row.noticeable for row in found if row.judgement.ok)
    return verdict(
        chosen,
        points,
        placed,
        own,
        seen,
        mine.judgement.reasons,
        min(unseen)[1] if unseen else None,
        hopeless=hopeless,
    )


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


def _point(row: Measured, cost: Cost | None, by_cone: dict[str, Cone]) -> Point | None:
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
    by_cone: dict[str, Cone],
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
        seen=None if row.seen is None else row.seen + by_cone[row.setting.cone].seen,
        energy_drift=row.energy_drift,
        momentum_drift=row.momentum_drift,
        mean_energy=None if mean is None or beyond is None else mean / beyond - 1,
        penetration=row.penetration,
        slip=row.slip,
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


def _extents(known: Known) -> tuple[float, float, float]:
    """How much positions, attitudes and velocities change: an error as large is no small one."""
    motion = known.motion
    turned = angle_between(motion.attitude[:1], motion.attitude)
    return (
        float(np.linalg.norm(np.ptp(motion.position, axis=0))),
        float(turned.max(initial=0.0)),
        float(np.linalg.norm(np.ptp(motion.velocity, axis=0))),
    )


def _orders(
    found: Sequence[Measured], known: Known, own: Setting, extents: tuple[float, float, float]
) -> tuple[OrderRow, ...]:
    place, turn, speed = extents
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
                _order(mine, "position", known.floor.position, place),
                _order(mine, "attitude", known.floor.attitude, turn),
                _order(mine, "velocity", known.floor.velocity, speed),
            )
        )
    return tuple(rows)


def _order(rows: Sequence[Measured], part: str, floor: float, extent: float) -> float | None:
    pairs = [
        (row.setting.timestep, getattr(row.errors, part).largest)
        for row in rows
        if row.errors is not None and getattr(row.errors, part) is not None
    ]
    pairs = sorted((step, error) for step, error in pairs if error < HIGHEST * min(1, extent))
    fit = order([step for step, _ in pairs], [error for _, error in pairs], floor)
    if fit is None:
        return None
    slopes = [
        math.log(more / less) / math.log(longer / shorter)
        for (shorter, less), (longer, more) in itertools.pairwise(pairs)
        if less > LOWEST * floor
    ]
    return fit.value if max(slopes) - min(slopes) < _STRAIGHT else None


_STRAIGHT = 0.75
"""The difference of slopes on the way from which on errors follow no one power of the timestep."""
