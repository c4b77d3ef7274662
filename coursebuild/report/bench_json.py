"""Speed against error of models as JSON: a table with one object a row.

Entry point: `bench_values(scenes)`.

`rows` has everything that was measured of each setting, with all that is needed to read it, so that
it can be loaded as a table. `scenarios` has what is said of all rows together, `scenes` what the
models are made of.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from coursebuild.numerics.reports.bench import ScenarioReport, SceneReport, WorkPrecisionRow
from coursebuild.numerics.reports.points import quantities

_QUANTITIES = ("position", "attitude", "velocity")


def bench_values(scenes: Sequence[SceneReport]) -> dict[str, object]:
    """What was measured, see above. What is not known is `None`, or no finite number."""
    return {
        "rows": [row for scene in scenes for row in _rows(scene)],
        "scenarios": [_scenario(scene, one) for scene in scenes for one in scene.scenarios],
        "scenes": [
            {"scene": one.model, "digest": one.digest, "quick": one.quick, "card": one.card}
            for one in scenes
        ],
    }


def _rows(scene: SceneReport) -> Iterator[dict[str, object]]:
    for scenario in scene.scenarios:
        for number, row in enumerate(scenario.rows):
            yield {
                **_where(scene, scenario, number),
                **_setting(scenario, row),
                **_errors(scenario, row),
                **_cost(row),
                **_judged(scenario, row),
            }


def _where(scene: SceneReport, scenario: ScenarioReport, number: int) -> dict[str, object]:
    machine = scene.machine
    return {
        "scene": scene.model,
        "scenario": scenario.name,
        "row": number,
        "engine_version": machine.engine,
        "python_version": machine.python,
        "numpy_version": machine.numpy,
        "system": machine.system,
        "cpu": machine.cpu,
        "quick": scene.quick,
    }


def _setting(scenario: ScenarioReport, row: WorkPrecisionRow) -> dict[str, object]:
    setting = row.setting
    return {
        "integrator": setting.integrator,
        "timestep": setting.timestep,
        "solver": setting.solver,
        "iterations": setting.iterations,
        "cone": setting.cone,
        "control_hold": scenario.hold,
        "duration": scenario.duration,
        "horizon": scenario.horizon,
        "reference_kind": scenario.reference,
        "reference_floor": scenario.floor,
        "velocity_floor": scenario.velocity_floor,
    }


def _errors(scenario: ScenarioReport, row: WorkPrecisionRow) -> dict[str, object]:
    value: dict[str, object] = {"figure": scenario.figure}
    least = {one.name: one.least for one in quantities(scenario)}
    for name in (*_QUANTITIES, "figure"):
        pair: tuple[float, float] = getattr(row, name) or (math.nan, math.nan)
        told = [max(one, least.get(name, 0.0)) for one in pair]  # what is no number stays so
        value[f"{name}_error"], value[f"{name}_error_end"] = told
    order = next((o for o in scenario.orders if o.integrator == row.setting.integrator), None)
    for name in _QUANTITIES:
        value[f"order_{name}"] = getattr(order, name, None)
    return value


def _cost(row: WorkPrecisionRow) -> dict[str, object]:
    return {
        "visible_error": row.seen,
        "mean_energy": row.mean_energy,
        "energy_drift": row.energy_drift,
        "momentum_drift": row.momentum_drift,
        "penetration": row.penetration,
        "slip": row.slip,
        "model_error": row.model_error,
        "steps": row.steps,
        "cost": row.cost,
        "cost_uncertainty": row.cost_uncertainty,
        "real_time_factor": row.realtime,
        "timing_spread": row.spread,
    }


def _judged(scenario: ScenarioReport, row: WorkPrecisionRow) -> dict[str, object]:
    stable = next((s for s in scenario.stable if s.integrator == row.setting.integrator), None)
    return {
        "status": row.status,
        "reasons": row.reasons,
        "growth": row.growth,
        "largest_stable_timestep": None if stable is None else stable.largest,
        "monotone": None if stable is None else stable.monotone,
        "refsafe": row.refsafe,
        "front": row.front,
        "own": row.own,
        "dominated_by": row.dominated_by,
    }


def _scenario(scene: SceneReport, scenario: ScenarioReport) -> dict[str, object]:
    return {
        "scene": scene.model,
        "scenario": scenario.name,
        "title": scenario.title,
        "reference_source": scenario.source,
        "second_reference": scenario.second,
        "agreement": scenario.agreement,
        "lyapunov_exponent": scenario.lyapunov,
        "smooth": scenario.smooth,
        "notes": scenario.notes,
        "stable": scenario.stable,
        "verdict": scenario.verdict,
    }
