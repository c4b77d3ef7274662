"""Speed against error of models, from the file to the report: errors, orders, drifts, statuses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import pytest

from coursebuild.measured.bench import ScenarioReport, WorkPrecisionRow
from coursebuild.model import Declarations
from coursebuild.physics.bench import measure_scenario, measure_scene
from coursebuild.physics.problems import problem_named
from coursebuild.physics.scene import SceneError, scenes
from coursebuild.source import Source
from coursebuild.syntax.scenarios import parse_declarations

MODELS = Path(__file__).parents[2] / "models"
FAMILY = ("Euler", "implicit", "implicitfast", "discrete")


def measured(model: Any, text: str = "", *, quick: bool = False) -> tuple[ScenarioReport, ...]:
    parsed = parse_declarations(Source("models/m.toml", text))
    assert parsed.value is not None, parsed.diagnostics
    return measure_scene(model, parsed.value, quick=quick, clock=None)


def of_problem(name: str, text: str) -> ScenarioReport:
    """A hard case, as a model with a scenario."""
    mjcf = problem_named(name).mjcf.replace("<mujoco>", '<mujoco><option timestep="0.004"/>')
    (found,) = measured(
        mujoco.MjModel.from_xml_string(mjcf),
        f'[[scenario]]\nname = "a"\nreference = "closed:{name}"\n{text}',
    )
    return found


def row(report: ScenarioReport, integrator: str, timestep: float) -> WorkPrecisionRow:
    (found,) = (
        one
        for one in report.rows
        if (one.setting.integrator, one.setting.timestep) == (integrator, timestep)
        and (one.setting.solver, one.setting.iterations, one.setting.cone)
        == next(
            (own.setting.solver, own.setting.iterations, own.setting.cone)
            for own in report.rows
            if own.own
        )
    )
    return found


def orders(report: ScenarioReport, part: str) -> dict[str, float]:
    found = {one.integrator: getattr(one, part) for one in report.orders}
    return {name: value for name, value in found.items() if value is not None}


# -------------------------------------------------------------------------------- the course's own


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


# -------------------------------------------------------------------------- commands, chaos, growth


SERVO = """\
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <body>
      <joint name="a" axis="0 1 0" damping="0.2"/>
      <geom type="capsule" size="0.02" fromto="0 0 0 0.4 0 0"/>
      <site name="tip" pos="0.4 0 0"/>
    </body>
  </worldbody>
  <actuator><position joint="a" kp="20"/></actuator>
  <sensor><jointpos name="angle" joint="a"/></sensor>
</mujoco>
"""
SERVO_TOML = """\
[[scenario]]
name = "reach"
controls = [[0.5], [-1], [0.2]]
hold = 0.3
sample = 0.05
measure = "site:tip"
"""


def test_commands_are_held_so_that_runge_kutta_keeps_its_order() -> None:
    (report,) = measured(mujoco.MjModel.from_xml_string(SERVO), SERVO_TOML)
    assert (report.reference, report.hold) == ("ode", 0.3)
    assert orders(report, "position")["RK4"] == pytest.approx(4.0, abs=0.15)
    assert report.figure == "place of the site tip [m]"
    fine = row(report, "RK4", 0.001)
    assert fine.figure is not None and fine.position is not None
    assert 0.1 * fine.position[0] < fine.figure[0] < fine.position[0]
    (sensed,) = measured(
        mujoco.MjModel.from_xml_string(SERVO),
        SERVO_TOML.replace("site:tip", "sensor:angle"),
        quick=True,
    )
    again = row(sensed, "RK4", 0.001)
    assert again.figure == pytest.approx(again.position)


DOUBLE = """\
<mujoco>
  <option timestep="0.005" integrator="RK4"><flag contact="disable"/></option>
  <worldbody>
    <body>
      <joint axis="0 1 0"/>
      <geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.3"/>
      <body pos="0 0 -0.3">
        <joint axis="0 1 0"/>
        <geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.3"/>
      </body>
    </body>
  </worldbody>
  <keyframe><key qpos="2.5 0.5"/></keyframe>
</mujoco>
"""


def test_chaos_has_a_horizon_and_then_statistics() -> None:
    (report,) = measured(
        mujoco.MjModel.from_xml_string(DOUBLE),
        '[[scenario]]\nname = "a"\nkeyframe = 0\nduration = 20\nsample = 0.04\n',
        quick=True,
    )
    assert report.lyapunov is not None and 1 < report.lyapunov < 10
    assert 1 < report.horizon < 20
    assert any("errors count until" in note for note in report.notes)
    own = next(one for one in report.rows if one.own)
    assert own.mean_energy is not None and abs(own.mean_energy) < 0.5
    assert own.energy_drift is not None


BLOCK = """\
<mujoco>
  <option timestep="{step}" gravity="{side} 0 -9.6"/>
  <worldbody>
    <geom type="plane" size="5 5 1"/>
    <body pos="0 0 0.1"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>
  </worldbody>
</mujoco>
"""


def block(step: float = 0.002, side: float = 2) -> Any:
    return mujoco.MjModel.from_xml_string(BLOCK.format(step=step, side=side))


@pytest.fixture(scope="module")
def sticks() -> ScenarioReport:
    model = block()
    before = (model.opt.timestep, model.opt.integrator, model.opt.cone, model.opt.disableflags)
    (report,) = measured(model, quick=True)
    opt = model.opt
    assert (opt.timestep, opt.integrator, opt.cone, opt.disableflags) == before
    return report


def test_measuring_twice_gives_the_same_figures(sticks: ScenarioReport) -> None:
    assert measured(block(), quick=True) == (sticks,)


def test_a_block_that_sticks_creeps(sticks: ScenarioReport) -> None:
    report = sticks
    assert (report.reference, report.smooth, report.orders) == ("self", False, ())
    assert report.notes == (
        "errors follow no power of the timestep, because of contact",
        "beyond 0.01 s refsafe softens constraints: stable, but another model",
    )
    settings = [one.setting for one in report.rows]
    assert {one.cone for one in settings} == {"pyramidal", "elliptic"}
    assert {one.solver for one in settings} == {"PGS", "CG", "Newton"}
    assert len({one.iterations for one in settings}) == 3
    creep = {one.setting.cone: one.slip for one in report.rows}
    assert creep["pyramidal"] and creep["elliptic"]
    assert 5e-4 < creep["elliptic"] < creep["pyramidal"] < 5e-3
    errors = {one.setting.cone: one.model_error for one in report.rows}
    assert errors["elliptic"] is None
    assert errors["pyramidal"] == pytest.approx(creep["pyramidal"] - creep["elliptic"], rel=0.2)
    assert {one.energy_drift for one in report.rows} == {None}


def test_the_error_of_a_pyramid_is_among_what_is_seen() -> None:
    mjcf = """\
    <mujoco>
      <option timestep="0.004" gravity="3 3 -9"/>
      <worldbody>
        <geom type="plane" size="50 50 1" friction="0.3"/>
        <body pos="0 0 0.1">
          <freejoint/><geom type="box" size="0.2 0.2 0.1" mass="1" friction="0.3"/>
        </body>
      </worldbody>
    </mujoco>
    """
    (report,) = measured(mujoco.MjModel.from_xml_string(mjcf), quick=True)
    own = next(one for one in report.rows if one.own)
    slope, time = 3 * 2**0.5, 2.0
    exact = (slope - 0.3 * 9 / 2**0.5 - (slope - 0.3 * 9)) * time**2 / 2  # half is enough
    assert own.model_error == pytest.approx(exact, rel=0.02)
    assert own.seen is not None and own.seen > 10
    (round_one,) = (
        one
        for one in report.rows
        if (one.setting.integrator, one.setting.timestep, one.setting.cone)
        == ("Euler", 0.004, "elliptic")
    )
    assert round_one.seen is not None and round_one.seen < own.seen / 5
    assert report.verdict.noticeable is True


def test_no_model_error_is_told_below_ten_floors() -> None:
    mjcf = """\
    <mujoco>
      <option timestep="0.004"/>
      <worldbody>
        <geom type="plane" size="1 1 1"/>
        <body pos="0 0 0.2"><freejoint/><geom size="0.1"/></body>
      </worldbody>
    </mujoco>
    """
    (report,) = measured(mujoco.MjModel.from_xml_string(mjcf), quick=True)
    for one in report.rows:
        assert (one.model_error is None) == (one.setting.cone == "elliptic")
        assert one.model_error is None or one.model_error >= 10 * report.floor > 0


def test_an_error_as_large_as_the_motion_has_no_order() -> None:
    spring = """\
    <mujoco>
      <option timestep="0.01" integrator="discrete"/>
      <worldbody>
        <body><joint type="slide" axis="1 0 0" stiffness="1e5"/><geom size="0.1" mass="1"/></body>
      </worldbody>
      <keyframe><key qpos="0.05"/></keyframe>
    </mujoco>
    """
    (report,) = measured(mujoco.MjModel.from_xml_string(spring), quick=True)
    errors = [
        one.position[0]
        for one in report.rows
        if one.setting.integrator == "discrete" and one.position is not None
    ]
    assert len(errors) == 4 and 0.04 < min(errors) <= max(errors) < 0.1
    assert orders(report, "position").get("discrete") is None


def test_softened_contacts_are_told() -> None:
    (report,) = measured(block(0.008), quick=True)
    refsafe = {one.setting.timestep: one.refsafe for one in report.rows if not one.own}
    assert refsafe == {0.002: False, 0.004: False, 0.008: False, 0.016: True}


# ------------------------------------------------------------------------------ seeded divergences


STIFF = """\
<mujoco>
  <option timestep="{step}"/>
  <worldbody>
    <body>
      <joint type="slide" stiffness="{stiffness}"/>
      <geom size="0.1" mass="1" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <keyframe><key qpos="{start}"/></keyframe>
</mujoco>
"""


def stiff(step: float, start: float, stiffness: float = 1e5) -> Any:
    text = STIFF.format(step=step, start=start, stiffness=stiffness)
    return mujoco.MjModel.from_xml_string(text)


def test_a_scene_that_blows_up_under_its_own_setting() -> None:
    """Without `autoreset="disable"` such a run ends where it began, with error 0."""
    (report,) = measured(stiff(0.008, 0.01), quick=True)
    (own,) = (one for one in report.rows if one.own)
    assert own.status == "diverged"
    assert "MuJoCo warned of bad accelerations" in own.reasons
    assert (own.position, own.velocity, own.seen) == (None, None, None)
    assert own.growth is None or own.growth > 1
    assert not report.verdict.on_front
    assert report.verdict.text.startswith(
        "the scene does not run under its own setting, Euler at 8 ms: "
    )
    limits = {one.integrator: one.largest for one in report.stable}
    for name in ("Euler", "implicit", "implicitfast"):
        assert limits[name] == pytest.approx(2 / 1e5**0.5, rel=0.02)
    assert limits["discrete"] is None


def test_a_slow_growth_without_any_warning() -> None:
    (report,) = measured(stiff(0.00635, 1e-30), quick=True)
    own = next(one for one in report.rows if one.own)
    assert own.status in ("slow-growth", "diverged")
    assert own.position is None


def test_bodies_that_lie_in_each_other_without_any_warning() -> None:
    text = """\
<mujoco>
  <option timestep="0.001"/>
  <worldbody>
    <geom type="box" size="1 1 0.05"/>
    <body pos="0 0 0.03">
      <joint type="slide" axis="0 0 1"/>
      <geom type="box" size="0.1 0.1 0.01" density="100"/>
    </body>
  </worldbody>
</mujoco>
"""
    (report,) = measured(mujoco.MjModel.from_xml_string(text), quick=True)
    statuses = {one.status for one in report.rows}
    assert statuses == {"diverged"}
    assert all("in each other" in " ".join(one.reasons) for one in report.rows)
    warned = " ".join(" ".join(one.reasons) for one in report.rows)
    assert "MuJoCo warned" not in warned


def test_a_scene_that_diverges_at_every_timestep_is_refused() -> None:
    with pytest.raises(SceneError, match=r"it diverges within .* s even at 0\.25 s a step"):
        measured(stiff(1.0, 0.01), quick=True)


# -------------------------------------------------------------------------------------- everything


def test_what_is_being_done_is_told() -> None:
    said: list[str] = []
    measure_scene(stiff(0.01, 0.1, 10), None, quick=True, clock=None, said=said.append)
    assert said[:3] == [
        "keyframe-0: a first run",
        "keyframe-0: the reference",
        "keyframe-0: Euler at 20 ms",
    ]
    assert said[-1] == "keyframe-0: stable timesteps"


def test_times_are_of_the_clock() -> None:
    """A clock that ticks evenly: whatever is timed takes the same, and nothing is uncertain."""
    ticks = iter(range(0, 10**15, 2_000_000))
    (report,) = measure_scene(stiff(0.01, 0.1, 10), None, quick=True, clock=lambda: next(ticks))
    for one in report.rows:
        assert one.cost is not None and one.cost > 0
        assert one.realtime is not None and one.realtime > 0
        assert one.spread == 1.0
        assert one.cost_uncertainty == pytest.approx(0.0, abs=1e-12)
    assert [one.cost for one in report.rows if one.own] == [1.0]
    assert any(one.front for one in report.rows)
