"""Models measured whole, and what is looked for in their reports."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from msgspec.structs import replace

from coursebuild.numerics.bench import measure_scenario
from coursebuild.numerics.reports.bench import ScenarioReport, WorkPrecisionRow
from coursebuild.numerics.scene import scenes
from support.surveys import parse_declared

MODELS = Path(__file__).parents[2] / "models"
FAMILY = ("Euler", "implicit", "implicitfast", "discrete")


def measure(model: Any, text: str = "", *, quick: bool = False) -> tuple[ScenarioReport, ...]:
    return tuple(
        measure_scenario(model, one, quick=quick, clock=None)
        for one in scenes(model, parse_declared(text), quick=quick)
    )


def row(report: ScenarioReport, integrator: str, timestep: float) -> WorkPrecisionRow:
    assert report.own_setting is not None
    like = replace(report.own_setting, integrator=integrator, timestep=timestep)
    (found,) = (one for one in report.rows if one.setting == like)
    return found


def orders(report: ScenarioReport, part: str) -> dict[str, float]:
    found = {one.integrator: getattr(one, part) for one in report.orders}
    return {name: fit.value for name, fit in found.items() if fit is not None}
