"""Speed against error of models, from the file to the report: errors, orders, drifts, statuses."""

from __future__ import annotations

from typing import Any

import mujoco
import pytest

from coursebuild.measured.bench import ScenarioReport
from coursebuild.model import Declarations
from coursebuild.physics.bench import measure_scenario, measure_scene
from coursebuild.physics.problems import problem_named
from coursebuild.physics.scene import scenes
from coursebuild.source import Source
from coursebuild.syntax.scenarios import parse_declarations
from support.bench_runs import FAMILY, MODELS, of_problem, orders, row


def course_box() -> tuple[Any, Declarations | None]:
    text = (MODELS / "tumbling_box.toml").read_text(encoding="utf-8")
    parsed = parse_declarations(Source("models/tumbling_box.toml", text))
    return mujoco.MjModel.from_xml_path(str(MODELS / "tumbling_box.xml")), parsed.value


@pytest.fixture(scope="module")
def box() -> dict[str, ScenarioReport]:
    reports = measure_scene(*course_box(), quick=True, clock=None)
    return {report.name: report for report in reports}


def test_energy_of_the_tumbling_box(box: dict[str, ScenarioReport]) -> None:
    drifts = {
        name: 100 * (row(box["flips"], name, 0.002).energy_drift or 0.0)
        for name in (*FAMILY, "RK4")
    }
    assert round(drifts["Euler"], 3) == 6.641
    for name in ("implicit", "implicitfast", "discrete"):
        assert round(drifts[name], 3) == -6.040
    assert 0 < abs(drifts["RK4"]) < 1e-8


def test_orders_of_the_tumbling_box() -> None:
    model, text = course_box()
    first = scenes(model, text)[0]
    report = measure_scenario(model, first, clock=None)
    assert report.reference == "closed"
    for part in ("attitude", "velocity"):
        found = orders(report, part)
        for name in FAMILY:
            assert found[name] == pytest.approx(1.0, abs=0.05)
    assert orders(report, "attitude")["RK4"] == pytest.approx(2.0, abs=0.05)
    assert orders(report, "velocity")["RK4"] == pytest.approx(4.0, abs=0.1)
    assert orders(report, "position") == {}, "its centre does not move"


def test_references_of_the_tumbling_box_agree(box: dict[str, ScenarioReport]) -> None:
    for name in ("first-flip", "major"):
        agreement = box[name].agreement
        assert agreement is not None and agreement < 1e-10
    assert box["flips"].floor > 1e-7, "an ill-conditioned motion is not called well known"


def test_no_error_is_told_below_ten_floors(box: dict[str, ScenarioReport]) -> None:
    for report in box.values():
        for one in report.rows:
            assert one.attitude is not None and one.velocity is not None
            assert min(one.attitude) >= 9.999 * max(report.floor, 1e-14)
            assert min(one.velocity) >= 9.999 * report.velocity_floor


def test_what_the_box_conserves_is_found_out(box: dict[str, ScenarioReport]) -> None:
    for report in box.values():
        for one in report.rows:
            assert one.energy_drift is not None and one.momentum_drift is not None
            assert (one.status, one.penetration, one.slip) == ("ok", 0.0, None)
            assert not one.refsafe


def test_the_boxs_own_setting_is_there_once(box: dict[str, ScenarioReport]) -> None:
    for report in box.values():
        (own,) = (one for one in report.rows if one.own)
        assert (own.setting.integrator, own.setting.timestep) == ("RK4", 0.002)
        assert (own.setting.solver, own.setting.cone) == ("", ""), "nothing is solved"
        assert report.verdict.noticeable is False
        assert len({one.setting for one in report.rows}) == len(report.rows) == 20


def test_an_error_that_can_be_seen(box: dict[str, ScenarioReport]) -> None:
    coarse, fine = (row(box["first-flip"], "Euler", h) for h in (0.004, 0.0005))
    assert coarse.attitude is not None and coarse.seen is not None and fine.seen is not None
    assert coarse.seen == pytest.approx(coarse.attitude[0] * 180 / 3.141592653589793)
    assert coarse.seen > 1 > fine.seen


# ------------------------------------------------------------------------------------- hard cases


def test_a_pendulum_from_90_degrees() -> None:
    qpos = problem_named("pendulum-hinge-90").scenario.qpos
    report = of_problem("pendulum-hinge-90", f"qpos = {list(qpos)}\nduration = 4\nsample = 0.2\n")
    assert orders(report, "position")["RK4"] >= 3.8
    assert orders(report, "velocity")["RK4"] >= 3.8
    for name in FAMILY:
        assert orders(report, "position")[name] == pytest.approx(1.0, abs=0.05)
    assert {one.energy_drift is None for one in report.rows} == {False}
    assert {one.momentum_drift for one in report.rows} == {None}, "the pin turns it"


@pytest.mark.parametrize("name", ["damped-spring-0", "damped-spring-0.1"])
def test_springs(name: str) -> None:
    report = of_problem(name, "qpos = [1]\nqvel = [5]\nduration = 1\nsample = 0.1\n")
    for part in ("position", "velocity"):
        assert orders(report, part)["RK4"] == pytest.approx(4.0, abs=0.1)
    damped = name != "damped-spring-0"
    assert {one.energy_drift is None for one in report.rows} == {damped}
