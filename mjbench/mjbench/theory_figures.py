"""Quantities that theory knows of a scenario: measured under every integrator, and guarded.

An expected quantity is an assertion too: one that small steps do not tend to is refused, as an
exact motion is.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec.structs import replace

from mjbench.declarations import Expected
from mjbench.measure import quantity_name, quantity_values
from mjbench.problem import STANDARD, Setup
from mjbench.reports.scene_report import FigureLine, MeasuredSetting, SweepRow
from mjbench.scene import Scene, SceneError
from mjbench.settings import with_setting
from mjbench.simulation import EngineStates, initial_data, simulate, stiffened
from mjbench.sweep import with_contacts


def measure_expected(model: Any, scene: Scene, baseline: MeasuredSetting) -> Iterator[FigureLine]:
    """What is known in theory, under every integrator at the scene's own timestep."""
    expected = scene.declaration.expected
    sources = _check_expected(model, scene, baseline, expected) if expected else {}
    for integrator in STANDARD if expected else ():
        setting = replace(baseline, integrator=integrator.value)
        values = _measure_quantities(scene, with_setting(model, setting), expected)
        for name, exact in expected.items():
            unit = {"penetration": "m", "slip": "m"}.get(name, "")
            if name in _OF_READINGS:
                unit = "s" if name == "crossing" else _UNIT.sub(r"\1", quantity_name(model, scene))
            yield FigureLine(name, unit, integrator.value, values[name], exact, sources[name])


def _measure_quantities(
    scene: Scene, model: Any, names: Collection[Expected]
) -> dict[Expected, float | None]:
    """The quantities of these names in a run of a model under its own options."""
    values: dict[str, float | None] = {}
    if _OF_READINGS.intersection(names):
        values |= _reading_figures(scene, model)
    if not _OF_READINGS.issuperset(names):
        row = with_contacts(scene.scenario, model, SweepRow("", "", own=False, status="ok"))
        values["restitution"] = row.restitution
        values["penetration"], values["slip"] = row.penetration or 0.0, row.slip or 0.0
    return {name: values.get(name) for name in names}


_STIFFER, _NEARER = (2.0, 4.0, 8.0), 0.9
"""How many times as stiff what is soft is made, and the part of a difference that may be left each
time."""
_FINER, _SHARE, _APART = 8, 2e-3, 10.0
"""How many times shorter the steps are than the shortest measured, to begin with; the share of
itself by which an expected quantity may be off in any case, as one of few digits is; what is so
many times farther from two runs than these are apart is another quantity."""
_MOST_STEPS = 50_000
"""The most steps of runs that are to agree."""


def _check_expected(
    model: Any, scene: Scene, baseline: MeasuredSetting, expected: Mapping[Expected, float]
) -> dict[Expected, str]:
    """The sources of expected quantities; a `SceneError` where small steps tend to another one.

    Steps are halved until two runs in them tell; where they never do, the source says so. Theory
    may be that of a rigid scene: then the difference has to fall as what is soft in the model gets
    stiffer, be it a contact, friction, a limit or an equality.
    """

    def measure(step: float, integrator: str, times: float = 1.0) -> dict[Expected, float | None]:
        fine = replace(baseline, integrator=integrator, timestep=step / times)
        return _measure_quantities(scene, with_setting(stiffened(model, times), fine), expected)

    sources, step = dict[Expected, str](), min(scene.timesteps) / _FINER
    while len(sources) < len(expected):
        runs = [measure(step, integrator) for integrator in ("implicitfast", "RK4")]
        is_last = 2 * scene.scenario.duration > _MOST_STEPS * step
        for name in [name for name in expected if name not in sources]:
            values = [value for run in runs if (value := run[name]) is not None]
            exact = expected[name]
            room = max(scene.declaration.precision or 0.0, _SHARE * abs(exact))
            apart = max(values, default=0.0) - min(values, default=0.0)
            gaps = [min((abs(value - exact) for value in values), default=0.0)]
            if len(values) < len(runs) or max(gaps[0], apart) <= room:
                sources[name] = "as declared"  # where nothing is measured, the table shows that
            elif gaps[0] > max(room, _APART * apart):
                for times in _STIFFER:
                    value = measure(step, "implicitfast", times)[name]
                    gaps.append(math.inf if value is None else abs(value - exact))
                    if gaps[-1] > _NEARER * gaps[-2]:
                        raise _slip(scene, name, values[0], gaps)
                sources[name] = "as declared"
            elif is_last:
                open = f"small steps tell no more than {min(values):.6g} to {max(values):.6g}"
                sources[name] = f"as declared; {open}"
        step /= 2
    return sources


def _slip(scene: Scene, name: Expected, value: float, gaps: Sequence[float]) -> SceneError:
    """The refusal of an expected quantity; `gaps`: how far it is off in ever stiffer models."""
    exact = scene.declaration.expected[name]
    message = (
        f"the expected {name}, {exact:g}, is not this scene's: it is {value:.6g} in small steps"
    )
    stiffer = ", ".join(f"{times:g}" for times in _STIFFER[: len(gaps) - 1])
    help = f"with contacts and equalities as they are, and {stiffer} times as stiff, it is off by "
    help += f"{', '.join(f'{gap:.2g}' for gap in gaps)}; `precision` says how far it may be off"
    return SceneError(message, scene.declaration.place("expected"), help)


_OF_READINGS = frozenset(("crossing", "last", "largest", "smallest"))
"""Quantities of what a sensor reads at every step."""
_UNIT = re.compile(r"[^\[]*(?:\[(.*)\])?")


def _reading_figures(scene: Scene, model: Any) -> dict[str, float]:
    """When a sensor's reading first changes its sign, its last value, the largest and smallest."""
    from scipy.interpolate import CubicSpline

    quantity = scene.declaration.observable
    if quantity is None or quantity.kind != "sensor" or model.sensor(quantity.name).dim != 1:
        message = "a quantity of a reading is expected, and `measure` names no sensor of one number"
        raise SceneError(message, scene.declaration.place("expected"))
    every_step = replace(scene.scenario, sample=float(model.opt.timestep))
    run = simulate(Setup(scenario=every_step), model)
    if not run.judgement.ok:
        return {}
    scene, data = replace(scene, scenario=every_step), initial_data(scene.scenario, model)
    start = EngineStates(np.zeros(1), data.qpos[None], data.qvel[None], data.act[None])
    readings = np.concatenate(
        [quantity_values(model, scene, states)[:, 0] for states in (start, run.states)]
    )
    times = np.concatenate([start.times, run.states.times])
    figures = {
        "last": float(readings[-1]),
        "largest": float(readings.max()),
        "smallest": float(readings.min()),
    }
    signed = np.flatnonzero(readings)  # it may be exactly 0 on its way
    changes = np.flatnonzero(np.diff(np.sign(readings[signed])))
    if changes.size:
        before, after = signed[changes[0]], signed[changes[0] + 1]
        part = slice(max(0, before - 3), after + 4)
        roots = CubicSpline(times[part], readings[part]).roots(extrapolate=False)
        middle = (times[before] + times[after]) / 2
        figures["crossing"] = float(roots[np.nanargmin(np.abs(roots - middle))])
    return figures
