"""Speed against error of models as JSON: a table with one object a row.

Entry point: `bench_json(scenes, …)`.

`rows` has everything that was measured of each setting, with all that is needed to read it, so that
it can be loaded as a table. `scenarios` has what is said of all rows together, `scenes` what the
models are made of, `checked` what left the band of a recorded report, `diagnostics` and `failures`
what is wrong.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from typing import Any

import msgspec

from coursebuild.diagnostics import Diagnostic
from coursebuild.numerics.reports.bench import ScenarioReport, SceneReport, WorkPrecisionRow
from coursebuild.numerics.reports.departures import Checked
from coursebuild.numerics.reports.points import quantities
from coursebuild.numerics.reports.records import Failure

COLUMNS = (
    *("scene", "scenario", "row", "engine_version", "python_version", "numpy_version"),
    *("system", "cpu", "quick", "integrator", "timestep", "solver", "iterations", "cone"),
    *("control_hold", "duration", "horizon", "reference_kind", "reference_floor", "velocity_floor"),
    *("position_error", "position_error_end", "attitude_error", "attitude_error_end"),
    *("velocity_error", "velocity_error_end", "figure", "figure_error", "figure_error_end"),
    *("visible_error", "mean_energy"),
    *("order_position", "order_attitude", "order_velocity", "energy_drift", "momentum_drift"),
    *("penetration", "slip", "model_error", "steps", "cost", "cost_uncertainty"),
    *("real_time_factor", "timing_spread"),
    *("status", "reasons", "growth", "largest_stable_timestep", "monotone", "refsafe"),
    *("front", "own", "dominated_by"),
)


def bench_json(
    scenes: Sequence[SceneReport],
    diagnostics: Sequence[Diagnostic] = (),
    failures: Sequence[Failure] = (),
    checked: Sequence[Checked] = (),
    remarks: Sequence[str] = (),
) -> str:
    """One JSON object, see above. What is not known is `null`."""
    value = {
        "rows": [row for scene in scenes for row in _rows(scene)],
        "scenarios": [
            _scenario(scene, scenario) for scene in scenes for scenario in scene.scenarios
        ],
        "scenes": [_scene(scene) for scene in scenes],
        "diagnostics": [_diagnostic(one) for one in diagnostics],
        "failures": [msgspec.to_builtins(one) for one in failures],
        "checked": [msgspec.to_builtins(one) for one in checked],
        "remarks": list(remarks),
    }
    return json.dumps(value, ensure_ascii=True, indent=2, allow_nan=False) + "\n"


def _rows(scene: SceneReport) -> Iterator[dict[str, Any]]:
    for scenario in scene.scenarios:
        for number, row in enumerate(scenario.rows):
            value = {
                **_where(scene, scenario, number),
                **_setting(scenario, row),
                **_figures(scenario, row),
                **_judged(scenario, row),
            }
            yield {name: value[name] for name in COLUMNS}


def _where(scene: SceneReport, scenario: ScenarioReport, number: int) -> dict[str, Any]:
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


def _setting(scenario: ScenarioReport, row: WorkPrecisionRow) -> dict[str, Any]:
    setting = row.setting
    return {
        "integrator": setting.integrator,
        "timestep": _finite(setting.timestep),
        "solver": setting.solver,
        "iterations": setting.iterations,
        "cone": setting.cone,
        "control_hold": _finite(scenario.hold),
        "duration": _finite(scenario.duration),
        "horizon": _finite(scenario.horizon),
        "reference_kind": scenario.reference,
        "reference_floor": _finite(scenario.floor),
        "velocity_floor": _finite(scenario.velocity_floor),
    }


def _figures(scenario: ScenarioReport, row: WorkPrecisionRow) -> dict[str, Any]:
    value: dict[str, Any] = {"figure": scenario.figure}
    least = {one.name: one.least for one in quantities(scenario)}
    for name in ("position", "attitude", "velocity", "figure"):
        pair: tuple[float, float] = getattr(row, name) or (math.nan, math.nan)
        told = (max(one, least.get(name, 0.0)) for one in pair)  # what is no number stays so
        value[f"{name}_error"], value[f"{name}_error_end"] = map(_finite, told)
    order = next((o for o in scenario.orders if o.integrator == row.setting.integrator), None)
    for name in ("position", "attitude", "velocity"):
        value[f"order_{name}"] = _finite(None if order is None else getattr(order, name))
    for name in ("energy_drift", "momentum_drift", "penetration", "slip", "model_error", "cost"):
        value[name] = _finite(getattr(row, name))
    return value | {
        "visible_error": _finite(row.seen),
        "mean_energy": _finite(row.mean_energy),
        "steps": row.steps,
        "cost_uncertainty": _finite(row.cost_uncertainty),
        "real_time_factor": _finite(row.realtime),
        "timing_spread": _finite(row.spread),
    }


def _judged(scenario: ScenarioReport, row: WorkPrecisionRow) -> dict[str, Any]:
    stable = next((s for s in scenario.stable if s.integrator == row.setting.integrator), None)
    return {
        "status": row.status,
        "reasons": list(row.reasons),
        "growth": _finite(row.growth),
        "largest_stable_timestep": _finite(None if stable is None else stable.largest),
        "monotone": None if stable is None else stable.monotone,
        "refsafe": row.refsafe,
        "front": row.front,
        "own": row.own,
        "dominated_by": row.dominated_by,
    }


def _scenario(scene: SceneReport, scenario: ScenarioReport) -> dict[str, Any]:
    verdict = scenario.verdict
    return {
        "scene": scene.model,
        "scenario": scenario.name,
        "title": scenario.title,
        "reference_source": scenario.source,
        "second_reference": scenario.second,
        "agreement": _finite(scenario.agreement),
        "lyapunov_exponent": _finite(scenario.lyapunov),
        "smooth": scenario.smooth,
        "notes": list(scenario.notes),
        "stable": [
            {
                "integrator": one.integrator,
                "largest": _finite(one.largest),
                "monotone": one.monotone,
                "searched": [_finite(value) for value in one.searched],
            }
            for one in scenario.stable
        ],
        "verdict": {
            "on_front": verdict.on_front,
            "better": verdict.better,
            "cost_ratio": _finite(verdict.cost_ratio),
            "error_ratio": _finite(verdict.error_ratio),
            "noticeable": verdict.noticeable,
            "text": verdict.text,
        },
    }


def _scene(scene: SceneReport) -> dict[str, Any]:
    return {
        "scene": scene.model,
        "digest": scene.digest,
        "quick": scene.quick,
        "card": None if scene.card is None else msgspec.to_builtins(scene.card),
    }


def _diagnostic(one: Diagnostic) -> dict[str, Any]:
    span = one.span
    return {
        "rule": one.rule,
        "severity": one.severity.value,
        "path": span.path,
        "line": span.line,
        "column": span.column,
        "message": one.message,
        "help": one.help,
    }


def _finite(value: float | None) -> float | None:
    """JSON has no number for what is none."""
    return value if value is not None and math.isfinite(value) else None
