"""Measures models, and looks up rows and orders in their reports."""

from __future__ import annotations

from typing import Any

from msgspec.structs import replace

from mjbench.problem import Integrator, Problem
from mjbench.reports.scene_report import ScenarioReport, WorkPrecisionRow
from mjbench.scene import Scene, scenes
from mjbench.simulation import compile_model
from mjbench.stability_runs import StabilityTrial, run_trial
from mjbench.work_precision import measure_scenario
from samples.surveys import parse_declared

BOX = """\
<mujoco>
  <option integrator="RK4" timestep="0.002" gravity="0 0 0"/>
  <worldbody>
    <body pos="0 0 0.5">
      <freejoint/>
      <geom type="box" size="0.10 0.05 0.02" mass="1" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <keyframe><key name="intermediate" qvel="0 0 0 0.001 6 0"/></keyframe>
</mujoco>
"""
FLIP = """\
[[scenario]]
name = "first-flip"
keyframe = "intermediate"
qvel = [0, 0, 0, 0.1, 6, 0]
duration = 2
sample = 0.1
"""


def measure(model: Any, text: str = "", *, quick: bool = False) -> tuple[ScenarioReport, ...]:
    """Reports without times; limits of stability are sought where `text` declares a `search`."""
    return tuple(
        measure_scenario(model, with_search(scene), quick=quick, clock=None)
        for scene in scenes(model, parse_declared(text), quick=quick)
    )


def attempt(problem: Problem, integrator: Integrator, timestep: float) -> StabilityTrial:
    """A run of a problem over its span at a timestep (s)."""
    return run_trial(problem, compile_model(problem.mjcf, integrator, timestep), problem.span)


def with_search(scene: Scene) -> Scene:
    """The scene; unless it says where, stability is looked for in runs of few steps."""
    search = scene.declaration.search or (20 * scene.timestep, 40 * scene.timestep)
    return replace(scene, declaration=replace(scene.declaration, search=search))


def row(report: ScenarioReport, integrator: str, timestep: float) -> WorkPrecisionRow:
    assert report.own_setting is not None
    like = replace(report.own_setting, integrator=integrator, timestep=timestep)
    (match,) = (row for row in report.rows if row.setting == like)
    return match


def orders(report: ScenarioReport, part: str) -> dict[str, float]:
    fits = {order.integrator: getattr(order, part) for order in report.orders}
    return {name: fit.value for name, fit in fits.items() if fit is not None}
