"""Speed against error of models as JSON: a table with one object a row.

Entry point: `bench_values(scenes)`.

`rows` has everything that was measured of each setting, with all that is needed to read it, so that
it can be loaded as a table. `scenarios` has what is said of all rows together, `scenes` what the
models are made of; `sweeps` is a table again, of parameters at other values.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from coursebuild.numerics.reports import Interval
from coursebuild.numerics.reports.bench import ScenarioReport, SceneReport, WorkPrecisionRow
from coursebuild.numerics.reports.text import quantities
from coursebuild.report.values import plain

_QUANTITIES = ("position", "attitude", "velocity")
_OF_ROW = (
    *("status", "reasons", "energy_drift", "mean_energy", "momentum_drift", "penetration", "slip"),
    *("model_error", "refsafe", "steps", "growth"),
    *("own", "front", "dominated_by"),
)
_RENAMED = {"visible_error": "seen", "real_time_factor": "realtime"}


def bench_values(scenes: Sequence[SceneReport]) -> dict[str, object]:
    """What was measured, see above. What is not known is `None`, or no finite number."""
    scenarios = [(scene, one) for scene in scenes for one in scene.scenarios]
    return {
        "rows": [
            {**_context(scene, scenario, number), **_row(scenario, row)}
            for scene, scenario in scenarios
            for number, row in enumerate(scenario.rows)
        ],
        "scenarios": [_scenario(scene, scenario) for scene, scenario in scenarios],
        "sweeps": [
            {"scene": scene.model, "sweep": sweep.name, "scenario": sweep.scenario, **plain(row)}
            for scene in scenes
            for sweep in scene.sweeps
            for row in sweep.rows
        ],
        "scenes": [
            {"scene": one.model, "digest": one.digest, "quick": one.quick, "card": one.card}
            for one in scenes
        ],
    }


def _context(scene: SceneReport, scenario: ScenarioReport, number: int) -> dict[str, object]:
    """What is the same for all rows of a scenario, but for their number."""
    machine = scene.machine
    return {
        "scene": scene.model,
        "scenario": scenario.name,
        "row": number,
        "engine_version": machine.engine,
        "python_version": machine.python,
        "numpy_version": machine.numpy,
        "system": machine.system,
        **{name: getattr(machine, name) for name in ("cpu", "governor", "processors", "pinned")},
        "quick": scene.quick,
        "control_hold": scenario.hold,
        "duration": scenario.duration,
        "horizon": scenario.horizon,
        "reference_kind": scenario.reference,
        "reference_floor": scenario.floor,
        "velocity_floor": scenario.velocity_floor,
        "figure": scenario.figure,
    }


def _row(scenario: ScenarioReport, row: WorkPrecisionRow) -> dict[str, object]:
    value: dict[str, object] = plain(row.setting)
    least = {one.name: one.least for one in quantities(scenario)}
    for name in (*_QUANTITIES, "figure"):
        pair: tuple[float, float] = getattr(row, name) or (math.nan, math.nan)
        told = [max(one, least.get(name, 0.0)) for one in pair]  # what is no number stays so
        value[f"{name}_error"], value[f"{name}_error_end"] = told
    for name in ("cost", "seconds"):
        interval: Interval | None = getattr(row, name)
        for part in ("", "low", "high"):
            key = f"{name}_{part}" if part else name
            value[key] = None if interval is None else getattr(interval, part or "value")
    integrator = row.setting.integrator
    order = next((one for one in scenario.orders if one.integrator == integrator), None)
    fits = {name: getattr(order, name, None) for name in _QUANTITIES}
    stable = next((one for one in scenario.stable if one.integrator == integrator), None)
    return {
        **value,
        **{f"order_{name}": getattr(fit, "value", None) for name, fit in fits.items()},
        **{name: getattr(row, name) for name in _OF_ROW},
        **{name: getattr(row, field) for name, field in _RENAMED.items()},
        "largest_stable_timestep": None if stable is None else stable.largest,
        "monotone": None if stable is None else stable.monotone,
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
        "horizons": scenario.horizons,
        "smooth": scenario.smooth,
        "notes": scenario.notes,
        "stable": scenario.stable,
        "verdict": scenario.verdict,
    }
