"""A model with its parameters at other values: what contacts, solver and cost are then.

Entry point: `measure_sweep(spec, scene, sweep, …)`.

1. A parameter is a field of the model's elements as `mujoco.MjSpec` names it, so that all that
   follows from it is compiled anew. One is changed at a time.
2. Every step of a run is looked at: a hit is over before the next sample.
3. The parameter `threads` is that of `mujoco.rollout`, which runs copies of the scenario.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Iterator
from itertools import islice
from typing import Any

import mujoco
import mujoco.rollout
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.model.scenarios import DeclaredSweep, SweepValue, Variation
from coursebuild.numerics.engine import (
    EngineStates,
    advance,
    full_state,
    initial_data,
    integrator_of,
    silent,
    simulate,
    with_integrator,
)
from coursebuild.numerics.observe import (
    Pair,
    quantity_name,
    quantity_values,
    speeds,
    touching,
    visible_error,
)
from coursebuild.numerics.problem import Scenario, Setup
from coursebuild.numerics.reports import Interval
from coursebuild.numerics.reports.sweep import SweepReport, SweepRow
from coursebuild.numerics.scene import Scene, SceneError, thickness
from coursebuild.numerics.timing import Clock, Job, scenario_job, time_jobs

THREADS = "threads"
_PARAMETER = re.compile(r"(?P<kind>[a-z]+)(:(?P<name>.+))?\.(?P<field>\w+)(\[(?P<at>\d+)\])?")
_PLURALS = {"body": "bodies", "equality": "equalities", "mesh": "meshes"}
_ENUMS = {
    "cone": mujoco.mjtCone,
    "integrator": mujoco.mjtIntegrator,
    "jacobian": mujoco.mjtJacobian,
    "solver": mujoco.mjtSolver,
}
_COPIES, _MOST_STEPS = 8, 2000
"""Scenarios that each thread runs in a rollout, and steps of one at most."""


def measure_sweep(
    spec: Any,
    scene: Scene,
    sweep: DeclaredSweep,
    clocks: tuple[Clock, Clock] | None,
    *,
    quick: bool = False,
) -> SweepReport:
    """Measure a model (`MjSpec`) with its parameters at other values.

    `clocks`: processor time of the thread and wall time, in ns; `None`: nothing is timed.

    Raises:
        SceneError: a parameter or a value is none of the model.
    """
    base = _runnable(spec.compile())
    threads = [part for part in sweep.variations if part.parameter == THREADS]
    parts = [part for part in sweep.variations if part.parameter != THREADS]
    variants = [one for part in parts for one in _variants(spec, scene.scenario, part)]
    own = simulate(Setup(scenario=scene.scenario), base, thickness(base))
    states = own.states if own.judgement.ok else None
    rows = [_measured(scene, base, states, row, model) for row, model in variants]
    if clocks is not None:
        models = [base, *(model for _, model in variants)]
        with silent():
            rows = _timed(scene.scenario, models, rows, clocks[0], quick=quick)
            for part in threads:
                rows += _rollouts(scene.scenario, base, part, clocks[1], quick=quick)
    return SweepReport(sweep.name, sweep.title or sweep.name, scene.name, sweep.show, tuple(rows))


def _variants(spec: Any, scenario: Scenario, part: Variation) -> Iterator[tuple[SweepRow, Any]]:
    """The model with the parameter at each of its values, and a row on which nothing is known."""
    for value in part.values:
        changed = spec.copy()
        before, after = _change(changed, part, value)
        try:
            model = _runnable(changed.compile())
            scenario.steps(float(model.opt.timestep))
        except ValueError as error:
            message = f"`{part.parameter}` cannot be {_text(value)}: {' '.join(str(error).split())}"
            raise SceneError(message, part.span) from None
        shown = f"{100 * (float(value) - 1):+g} %" if part.relative else _text(value)  # type: ignore[arg-type]
        same = all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))
        yield SweepRow(part.parameter, shown, own=same, status="ok"), model


def _change(spec: Any, part: Variation, value: SweepValue) -> tuple[list[Any], list[Any]]:
    """Give all elements that are meant the value; what they had before, and have now."""
    match = _PARAMETER.fullmatch(part.parameter)
    kind, name, field = match.group("kind", "name", "field") if match else ("", "", "")
    several = getattr(spec, _PLURALS.get(kind, f"{kind}s"), ())
    found = [spec.option] if kind == "option" else [o for o in several if name in (None, o.name)]
    if match is None or not found or not hasattr(found[0], field):
        message = f"the model has no parameter `{part.parameter}`"
        help = "it is named as in `mujoco.MjSpec`: `option.timestep`, `geom:ball.solref[0]`"
        raise SceneError(message, part.span, help)
    at, before, after = match["at"], [], []
    for one in found:
        old = getattr(one, field)
        before.append(np.array(old, copy=True))
        try:
            _set(one, field, at, value, relative=part.relative)
        except (TypeError, ValueError, KeyError, IndexError):
            message = f"`{part.parameter}` cannot be {_text(value)}"
            raise SceneError(message, part.span) from None
        after.append(np.array(getattr(one, field), copy=True))
        if part.relative and not np.isfinite(after[-1]).all():
            message = f"`{part.parameter}` is not given in the MJCF, so that it has no share"
            raise SceneError(message, part.span)
    return before, after


def _set(one: Any, field: str, at: str | None, value: SweepValue, *, relative: bool) -> None:
    old = getattr(one, field)
    if isinstance(value, str):
        members = _ENUMS[field].__members__
        value = int(
            {name.partition("_")[2].lower(): m for name, m in members.items()}[value.lower()]
        )
    if at is not None:
        old[int(at)] = old[int(at)] * value if relative else value
    elif isinstance(old, np.ndarray):
        old[:] = old * value if relative else value
    else:
        setattr(one, field, type(old)(old * value if relative else value))


def _text(value: SweepValue) -> str:
    if isinstance(value, tuple):
        return " ".join(f"{one:g}" for one in value)
    return value if isinstance(value, str) else f"{value:g}"


def _runnable(model: Any) -> Any:
    """A copy of a model with automatic reset off."""
    return with_integrator(model, integrator_of(model), float(model.opt.timestep))


def _measured(
    scene: Scene, base: Any, own: EngineStates | None, row: SweepRow, model: Any
) -> SweepRow:
    """With what a model does; `own`: the motion of the model as it is, unless it is lost."""
    try:
        run = simulate(Setup(scenario=scene.scenario), model, thickness(model))
    except mujoco.FatalError as error:
        return replace(row, status="diverged", reasons=(f"MuJoCo does not run it: {error}",))
    judged = run.judgement
    row = replace(row, status=judged.status.value, reasons=judged.reasons)
    if not judged.ok:
        return row
    row = _contacts(scene.scenario, model, row)
    if own is None:
        return row
    row = replace(row, change=visible_error(base, scene, run.states, own))
    if quantity_name(base, scene):
        mine = quantity_values(model, scene, run.states)
        apart = np.linalg.norm(mine - quantity_values(base, scene, own), axis=1)
        row = replace(row, figure=float(apart.max()))
    return row


class _Hit(Struct):
    """Two geoms that touch."""

    closing: float
    """Speed together at the beginning, m/s."""
    contact: Any
    """Where, at last."""
    apart: float = 0.0
    """Speed apart at the end, m/s; 0 for what stays."""
    slid: float = 0.0
    """m."""


def _contacts(scenario: Scenario, model: Any, row: SweepRow) -> SweepRow:
    """With what contacts and solver do, step by step."""
    one = _runnable(model)
    one.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_FWDINV)
    step = float(one.opt.timestep)
    steps = scenario.steps(step) * len(scenario.times)
    data, other = initial_data(scenario, one), initial_data(scenario, one)
    now: dict[Pair, _Hit] = {}
    hits: list[_Hit] = []
    deepest = residual = force = iterations = 0.0
    for command in scenario.commands(step):
        if command:
            data.ctrl[:] = command
        advance(one, data)
        residual = max(residual, float(data.solver_fwdinv.max()))
        force = max(force, float(np.linalg.norm(data.qfrc_constraint)))
        iterations += int(data.solver_niter.sum())
        other.qpos[:], other.qvel[:] = data.qpos, data.qvel
        mujoco.mj_fwdPosition(one, other)
        mujoco.mj_fwdVelocity(one, other)
        before, now = now, {}
        for contact in touching(other):
            pair = (int(contact.geom[0]), int(contact.geom[1]))
            apart, along = speeds(one, other, contact)
            hit = before.pop(pair, None) or now.get(pair)
            if hit is None:
                hit = _Hit(-apart, contact)
                hits.append(hit)
            if pair not in now:
                hit.slid += along * step
            now[pair], hit.contact = hit, copy.copy(contact)
            deepest = max(deepest, -float(contact.dist))
        for hit in before.values():
            hit.apart = max(0.0, speeds(one, other, hit.contact)[0])
    closing = (hit for hit in hits if hit.closing > 0)
    hardest = max(closing, key=lambda hit: hit.closing, default=None)
    return replace(
        row,
        penetration=deepest if hits else None,
        slip=max(hit.slid for hit in hits) if hits else None,
        restitution=hardest.apart / hardest.closing if hardest is not None else None,
        residual=residual / force if force else None,
        iterations=iterations / steps if force else None,
    )


def _timed(
    scenario: Scenario, models: list[Any], rows: list[SweepRow], clock: Clock, *, quick: bool
) -> list[SweepRow]:
    """With costs; the first model is as it is, the others are those of the rows."""
    usable = [n for n, row in enumerate(rows) if row.status == "ok"]
    jobs = [_job(scenario, models[n]) for n in (0, *(n + 1 for n in usable))]
    for n, timing in zip(usable, time_jobs(jobs, 0, clock, quick=quick)[1:], strict=True):
        rows[n] = replace(rows[n], cost=timing.ratio)
    return rows


def _job(scenario: Scenario, model: Any) -> Job:
    state = full_state(model, initial_data(scenario, model))
    return scenario_job(model, [(scenario, state)], float(model.opt.timestep))


def _rollouts(
    scenario: Scenario, model: Any, part: Variation, clock: Clock, *, quick: bool
) -> Iterator[SweepRow]:
    """How much is simulated in a second by so many threads."""
    counts = [int(value) for value in part.values if not isinstance(value, str | tuple)]
    batch, step = _COPIES * max(counts, default=1), float(model.opt.timestep)
    steps = min(_MOST_STEPS, scenario.steps(step) * len(scenario.times))
    state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    data = initial_data(scenario, model)
    mujoco.mj_getState(model, data, state, int(mujoco.mjtState.mjSTATE_FULLPHYSICS))
    begins, control = np.tile(state, (batch, 1)), None
    if scenario.controls:
        control = np.tile([*islice(scenario.commands(step), steps)], (batch, 1, 1))

    def job(pool: mujoco.rollout.Rollout) -> Job:
        datas = [mujoco.MjData(model) for _ in range(max(1, pool.nthread))]
        return lambda: pool.rollout(model, datas, begins, control, nstep=steps)

    pools = [mujoco.rollout.Rollout(nthread=count) for count in counts]
    try:
        found = time_jobs([job(pool) for pool in pools], 0, clock, quick=quick)
    finally:
        for pool in pools:
            pool.close()
    for count, timing in zip(counts, found, strict=True):
        took, simulated = timing.nanoseconds, batch * steps * step * 1e9
        speed = Interval(simulated / took.value, simulated / took.high, simulated / took.low)
        yield SweepRow(THREADS, f"{count}", own=False, status="ok", throughput=speed)
