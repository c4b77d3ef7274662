"""Measures models, and looks up rows and orders in their reports."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from msgspec.structs import replace

from coursebuild.core.model.measurements import ScenarioReport, WorkPrecisionRow
from coursebuild.numerics.scene import scenes
from coursebuild.numerics.work_precision import measure_scenario
from support.surveys import parse_declared

MODELS = Path(__file__).parents[2] / "models"
FAMILY = ("Euler", "implicit", "implicitfast", "discrete")


def measure(model: Any, text: str = "", *, quick: bool = False) -> tuple[ScenarioReport, ...]:
    return tuple(
        measure_scenario(model, scene, quick=quick, clock=None)
        for scene in scenes(model, parse_declared(text), quick=quick)
    )


def row(report: ScenarioReport, integrator: str, timestep: float) -> WorkPrecisionRow:
    assert report.own_setting is not None
    like = replace(report.own_setting, integrator=integrator, timestep=timestep)
    (match,) = (row for row in report.rows if row.setting == like)
    return match


def orders(report: ScenarioReport, part: str) -> dict[str, float]:
    fits = {order.integrator: getattr(order, part) for order in report.orders}
    return {name: fit.value for name, fit in fits.items() if fit is not None}
