"""Quantities that theory knows of a scenario: measured under every integrator, and guarded.

An expected quantity is an assertion too: one that small steps do not tend to is refused, as an
exact motion is.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping
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
    if expected:
        _check_expected(model, scene, baseline, expected)
    for integrator in STANDARD if expected else ():
        setting = replace(baseline, integrator=integrator.value)
        values = _measure_quantities(scene, with_setting(model, setting), expected)
        for name, exact in expected.items():
            unit = {"penetration": "m", "slip": "m"}.get(name, "")
            if name in _OF_READINGS:
                unit = "s" if name == "crossing" else _UNIT.sub(r"\1", quantity_name(model, scene))
            yield FigureLine(name, unit, integrator.value, values[name], exact, "as declared")


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
_FINER, _SHARE = 8, 2e-3
"""How many times shorter the steps are than the shortest measured; the share of itself by which an
expected quantity may be off in any case, as one of few digits is."""


def _check_expected(
    model: Any,
    scene: Scene,
    baseline: MeasuredSetting,
    expected: Mapping[Expected, float],
) -> None:
    """Check that small steps tend to what is expected; a `SceneError` where they do not.

    Theory may be that of a rigid scene: then the difference has to fall as what is soft in the
    model gets stiffer, be it a contact, friction, a limit or an equality.
    """
    step = min(scene.timesteps) / _FINER

    def measure(times: float, integrator: str) -> dict[Expected, float | None]:
        stiff = model if times == 1 else stiffened(model, times)
        fine = replace(baseline, integrator=integrator, timestep=step / times)
        return _measure_quantities(scene, with_setting(stiff, fine), expected)

    runs = [measure(1.0, name) for name in ("implicitfast", "RK4")]
    precision = scene.declaration.precision or 0.0
    for name, exact in expected.items():
        values = [value for run in runs if (value := run[name]) is not None]
        if not values:
            continue  # nothing to compare with, which the table shows
        room = max(precision, _SHARE * abs(exact), 10 * (max(values) - min(values)))
        gaps = [min(abs(value - exact) for value in values)]
        for times in _STIFFER if gaps[0] > room else ():
            value = measure(times, "implicitfast")[name]
            gaps.append(math.inf if value is None else abs(value - exact))
            if gaps[-1] > _NEARER * gaps[-2]:
                message = f"the expected {name}, {exact:g}, is not this scene's: it is "
                message += f"{values[0]:.6g} in small steps"
                stiffer = ", ".join(f"{times:g}" for times in _STIFFER[: len(gaps) - 1])
                off = ", ".join(f"{gap:.2g}" for gap in gaps)
                help = "with contacts and equalities as they are, and "
                help += (
                    f"{stiffer} times as stiff, it is off by {off}; `precision` says how far it "
                )
                raise SceneError(message, scene.declaration.place("expected"), f"{help}may be off")


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
