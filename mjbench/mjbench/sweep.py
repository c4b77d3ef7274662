"""A model with its parameters at other values: its contacts, solver and cost.

1. A parameter is a field of the model's elements as `mujoco.MjSpec` names it, so that all that
   follows from it is compiled anew. One is changed at a time.
2. Every step of a run is looked at: a hit is over before the next sample. A slide goes on where two
   geoms touch again within a sample: what rolls or slides over a stiff surface hops on it.
3. In chaos the size of a change says nothing of the parameter once it is visible: two runs whose
   beginnings differ by 1e-10 are as far apart later. When it becomes visible is told instead.
"""

from __future__ import annotations

import copy
import re
import zlib
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from mjbench.costs import Clock, scenario_job, time_jobs
from mjbench.declarations import DeclaredScenario, DeclaredSweep, SweepValue, Variation
from mjbench.detector import pair_of
from mjbench.measure import (
    Pair,
    contact_speeds,
    quantity_name,
    quantity_values,
    touching_contacts,
    visible_error,
    visible_errors,
)
from mjbench.pilot import NUDGE, nudges
from mjbench.problem import Scenario, Setup
from mjbench.reports.scene_report import (
    SweepReport,
    SweepRow,
)
from mjbench.scene import Scene, SceneError
from mjbench.simulation import (
    EngineStates,
    advance,
    expect_passages,
    initial_data,
    nudged,
    runnable,
    silent,
    simulate,
)

_PARAMETER = re.compile(r"(?P<kind>[a-z]+)(:(?P<name>.+))?\.(?P<field>\w+)(\[(?P<at>\d+)\])?")
_PLURALS = {"body": "bodies", "equality": "equalities", "mesh": "meshes"}
_ENUMS = {
    "cone": mujoco.mjtCone,
    "integrator": mujoco.mjtIntegrator,
    "jacobian": mujoco.mjtJacobian,
    "solver": mujoco.mjtSolver,
}


def measure_sweep(
    spec: Any,
    scene: Scene,
    sweep: DeclaredSweep,
    clock: Clock | None,
    *,
    quick: bool = False,
) -> SweepReport:
    """Measure a model (`MjSpec`) with its parameters at other values.

    `clock`: as of `measure_scenario`. A `SceneError` where a value is none of the model.
    """
    base = runnable(spec.compile())
    variants = [
        _variant(spec, scene.scenario, part, value)
        for part in sweep.variations
        for value in part.values
    ]
    setup = Setup(scenario=scene.scenario)
    base_run = simulate(setup, base)
    if base_run.passing:
        setup = expect_passages(setup, base)
        base_run = simulate(setup, base)
    states = base_run.states if base_run.judgement.ok else None
    chaotic = states is not None and _is_chaotic(scene, setup, base, states)
    rows = [
        _measure_variant(scene, setup, base, states, chaotic, row, model) for row, model in variants
    ]
    if clock is not None:
        with silent():
            usable = [n for n, row in enumerate(rows) if row.status == "ok"]
            jobs = [
                scenario_job(model, [scene.scenario], float(model.opt.timestep))
                for model in (base, *(variants[n][1] for n in usable))
            ]
            timings = time_jobs(jobs, 0, clock, quick=quick)
            for n, timing in zip(usable, timings[1:], strict=True):
                rows[n] = replace(rows[n], cost=timing.ratio)
    show = tuple("parted" if chaotic and name == "change" else name for name in sweep.show)
    return SweepReport(sweep.name, sweep.title or sweep.name, scene.name, show, tuple(rows))


def _is_chaotic(scene: Scene, setup: Setup, model: Any, states: EngineStates) -> bool:
    """Whether a run whose beginning is off by 1e-10 comes to be visibly elsewhere."""
    for change in nudges(model, 2, NUDGE):
        aside = replace(setup, scenario=nudged(scene.scenario, model, change))
        run = simulate(aside, model)
        if run.judgement.ok and visible_error(model, scene, run.states, states) >= 1:
            return True
    return False


def _variant(
    spec: Any, scenario: Scenario, part: Variation, value: SweepValue
) -> tuple[SweepRow, Any]:
    """A row on which nothing is known, and the model with the parameter at this value."""
    changed_spec = spec.copy()
    before, after = _change(changed_spec, part, value)
    text = _text(part, value)
    try:
        model = runnable(changed_spec.compile())
        scenario.steps(float(model.opt.timestep))
    except ValueError as error:
        message = f"`{part.parameter}` cannot be `{text}`: {' '.join(str(error).split())}"
        raise SceneError(message, part.place) from None
    is_own = all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))
    return SweepRow(part.parameter, text, own=is_own, status="ok"), model


class DrawnModel(Struct, frozen=True):
    """A model whose parameters were drawn from the ranges of a scenario."""

    model: Any
    """An `mjModel`."""
    text: str
    """What was drawn, so that it can be declared: `geom.friction[0] = 0.6312`."""


def drawn_models(spec: Any, declaration: DeclaredScenario) -> tuple[DrawnModel, ...]:
    """The models (of a `MjSpec`) that a scenario draws; a `SceneError` where one is none.

    What a parameter is depends on the number of the draw and on its name alone.
    """
    models = []
    for number in range(declaration.draws if declaration.draw else 0):
        changed_spec, texts, place = spec.copy(), [], declaration.place("draw")
        for part in declaration.ranges:
            if part.parameter in _COMPARED:
                message = f"`{part.parameter}` is what is compared, and cannot be drawn"
                raise SceneError(message, place)
            random = np.random.default_rng((number, zlib.crc32(part.parameter.encode())))
            low, high = sorted(value for value in part.values if isinstance(value, float))
            value = float(f"{random.uniform(low, high):.4g}")
            _change(changed_spec, part, value)
            texts.append(f"{part.parameter} {'' if part.relative else '= '}{_text(part, value)}")
        text = ", ".join(texts)
        try:
            models.append(DrawnModel(changed_spec.compile(), text))
        except ValueError as error:
            message = f"with {text} the model does not compile: {' '.join(str(error).split())}"
            raise SceneError(message, place) from None
    return tuple(models)


_COMPARED = ("option.timestep", "option.integrator")


def _text(part: Variation, value: SweepValue) -> str:
    if part.relative and isinstance(value, float):
        return f"{100 * (value - 1):+.4g} %"
    return _value_text(value)


def _change(spec: Any, part: Variation, value: SweepValue) -> tuple[list[Any], list[Any]]:
    """Give the elements of a variation a value; what they had before, and have now."""
    match = _PARAMETER.fullmatch(part.parameter)
    kind, name, field = match.group("kind", "name", "field") if match else ("", "", "")
    candidates = getattr(spec, _PLURALS.get(kind, f"{kind}s"), ())
    elements = (
        [spec.option] if kind == "option" else [o for o in candidates if name in (None, o.name)]
    )
    if match is None or not elements or not hasattr(elements[0], field):
        message = f"the model has no parameter `{part.parameter}`"
        help = "it is named as in `mujoco.MjSpec`: `option.timestep`, `geom:ball.solref[0]`"
        raise SceneError(message, part.place, help)
    before, after = [], []
    for element in elements:
        old = getattr(element, field)
        at: Any = None if match["at"] is None else int(match["at"])
        if at is None and isinstance(old, np.ndarray):  # a number alone is the first, as in MJCF
            at = slice(None) if part.relative or isinstance(value, tuple) else 0
        before.append(np.array(old, copy=True))
        try:
            new: Any = value
            if isinstance(value, str):
                members = _ENUMS[field].__members__
                numbers = {name.partition("_")[2].lower(): m for name, m in members.items()}
                new = int(numbers[value.lower()])
            if at is not None:
                old[at] = old[at] * new if part.relative else new
            else:
                setattr(element, field, type(old)(old * new if part.relative else new))
        except (TypeError, ValueError, KeyError, IndexError):
            message = f"`{part.parameter}` cannot be `{_value_text(value)}`"
            raise SceneError(message, part.place) from None
        after.append(np.array(getattr(element, field), copy=True))
        if part.relative and not np.isfinite(after[-1]).all():
            message = f"`{part.parameter}` is not given in the MJCF, so it cannot be scaled"
            raise SceneError(message, part.place)
    return before, after


def _value_text(value: SweepValue) -> str:
    if isinstance(value, tuple):
        return " ".join(f"{number:g}" for number in value)
    return value if isinstance(value, str) else f"{value:g}"


def _measure_variant(
    scene: Scene,
    setup: Setup,
    base: Any,
    base_states: EngineStates | None,
    chaotic: bool,
    row: SweepRow,
    model: Any,
) -> SweepRow:
    """Run a model and fill its row; `base_states` is `None` where the model as it is was lost."""
    try:
        run = simulate(setup, model)
    except mujoco.FatalError as error:
        return replace(row, status="refused", reasons=(str(error),))
    judgement = run.judgement
    row = replace(row, status=judgement.status.value, reasons=judgement.reasons)
    if not judgement.ok:
        return row
    row = with_contacts(scene.scenario, model, row)
    if base_states is None:
        return row
    changes = visible_errors(base, scene, run.states, base_states)
    if chaotic and changes.max() >= 1:
        return replace(row, parted=float(run.states.times[np.argmax(changes >= 1)]))
    row = replace(row, change=float(changes.max()))
    if quantity_name(base, scene):
        values = quantity_values(model, scene, run.states)
        distances = np.linalg.norm(values - quantity_values(base, scene, base_states), axis=1)
        row = replace(row, figure=float(distances.max()))
    return row


class _Hit(Struct):
    """Two geoms that touch."""

    closing: float
    """Speed with which they approach at the beginning, m/s."""
    contact: Any
    """The latest one."""
    parting: float = 0.0
    """Speed with which they part at the end, m/s; 0 if they stay together."""
    depth: float = 0.0
    """Deepest contact, m."""


class _Slide(Struct):
    """Two geoms that slide on each other."""

    time: float
    """When they last touched, s."""
    speed: float
    """Of the one along the other then, m/s."""
    distance: float
    """Distance slid, m."""


def with_contacts(scenario: Scenario, model: Any, row: SweepRow) -> SweepRow:
    """Add what contacts and solver do, step by step."""
    model_copy = runnable(model)
    model_copy.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_FWDINV)
    step = float(model_copy.opt.timestep)
    steps = scenario.steps(step) * len(scenario.times)
    data, scratch = initial_data(scenario, model_copy), initial_data(scenario, model_copy)
    current: dict[Pair, _Hit] = {}
    hits: list[_Hit] = []
    slides: dict[Pair, _Slide] = {}
    longest: float | None = None
    residual = force = iterations = 0.0
    for number, inputs in enumerate(scenario.inputs(step), 1):
        inputs.give(data)
        advance(model_copy, data)
        residual = max(residual, float(data.solver_fwdinv.max()))
        force = max(force, float(np.linalg.norm(data.qfrc_constraint)))
        iterations += int(data.solver_niter.sum())
        scratch.qpos[:], scratch.qvel[:] = data.qpos, data.qvel
        mujoco.mj_fwdPosition(model_copy, scratch)
        mujoco.mj_fwdVelocity(model_copy, scratch)
        current = _follow_hits(model_copy, scratch, current, hits)
        for pair, hit in current.items():
            time, speed = number * step, contact_speeds(model_copy, scratch, hit.contact)[1]
            slide = slides.get(pair)
            if slide is None or time - slide.time > scenario.sample * (1 + 1e-9):
                slides[pair] = slide = _Slide(time, speed, speed * step)
            else:
                slide.distance += (time - slide.time) * (slide.speed + speed) / 2
                slide.time, slide.speed = time, speed
            longest = max(longest or 0.0, slide.distance)
    closing = (hit for hit in hits if hit.closing > 0)
    hardest = max(closing, key=lambda hit: hit.closing, default=None)
    return replace(
        row,
        penetration=max((hit.depth for hit in hits), default=None),
        slip=longest,
        restitution=hardest.parting / hardest.closing if hardest is not None else None,
        residual=residual / force if force else None,
        iterations=iterations / steps if force else None,
    )


def _follow_hits(
    model: Any, data: Any, previous: dict[Pair, _Hit], hits: list[_Hit]
) -> dict[Pair, _Hit]:
    """Note what happened to hits in a step, and add new ones; the pairs that touch now."""
    current: dict[Pair, _Hit] = {}
    for contact in touching_contacts(data):
        pair = pair_of(contact)
        hit = previous.get(pair) or current.get(pair)
        if hit is None:
            hit = _Hit(-contact_speeds(model, data, contact)[0], contact)
            hits.append(hit)
        current[pair], hit.contact = hit, copy.copy(contact)
        hit.depth = max(hit.depth, -float(contact.dist))
    for pair in previous.keys() - current.keys():
        hit = previous[pair]
        hit.parting = max(0.0, contact_speeds(model, data, hit.contact)[0])
    return current
