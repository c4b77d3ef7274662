"""Speed against error of models, from the file to the report: errors, orders, drifts, statuses."""

from __future__ import annotations

import functools

import mujoco
import pytest

from coursebuild.numerics.reports.scene_report import ScenarioReport
from coursebuild.numerics.scene import scenes
from coursebuild.numerics.work_precision import measure_scenario
from support.bench_runs import FAMILY, MODELS, orders, row
from support.surveys import parse_declared

pytestmark = pytest.mark.site


@functools.cache
def of_box() -> ScenarioReport:
    """The first flip of the tumbling box."""
    text = (MODELS / "tumbling_box.toml").read_text(encoding="utf-8")
    model = mujoco.MjModel.from_xml_path(str(MODELS / "tumbling_box.xml"))
    scene = next(s for s in scenes(model, parse_declared(text)) if s.name == "first-flip")
    return measure_scenario(model, scene, clock=None)


def test_a_report_on_the_tumbling_box() -> None:
    """Its references agree, no error lies below ten floors, what it conserves is found out."""
    report = of_box()
    assert report.reference == "closed"
    assert report.agreement is not None and report.agreement < 1e-10
    for line in report.rows:
        assert line.attitude is not None and line.velocity is not None
        assert min(line.attitude) >= 9.999 * max(report.floor, 1e-14)
        assert min(line.velocity) >= 9.999 * report.velocity_floor
        assert line.energy_drift is not None and line.momentum_drift is not None
        assert (line.status, line.penetration, line.slip, line.refsafe) == ("ok", 0.0, None, False)
    (own_row,) = (line for line in report.rows if line.own)
    assert (own_row.setting.integrator, own_row.setting.timestep) == ("RK4", 0.002)
    assert (own_row.setting.solver, own_row.setting.cone) == ("", ""), "nothing is solved"
    assert report.verdict.noticeable is False
    assert len({line.setting for line in report.rows}) == len(report.rows) == 35


def test_orders_of_the_tumbling_box() -> None:
    first = dict.fromkeys(FAMILY, 1.0)
    assert orders(of_box(), "attitude") == pytest.approx({**first, "RK4": 2.0}, abs=0.05)
    assert orders(of_box(), "velocity") == pytest.approx({**first, "RK4": 4.0}, abs=0.1)
    assert orders(of_box(), "position") == {}, "its centre does not move"


def test_an_error_that_can_be_seen() -> None:
    coarse, fine = (row(of_box(), "Euler", h) for h in (0.004, 0.0005))
    assert coarse.attitude is not None and coarse.seen is not None and fine.seen is not None
    assert coarse.seen == pytest.approx(coarse.attitude[0] * 180 / 3.141592653589793)
    assert coarse.seen > 1 > fine.seen
